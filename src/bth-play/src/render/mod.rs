//! Rendering: tiles of samples in parallel, exposures of frames, and sequences of frames.

mod frame;
mod progress;
mod sequence;
mod shutter;
mod tile;
mod warnings;

pub(crate) use sequence::{FrameReport, Report, frame_range, frames_to_show, render_sequence, shutter};
pub(crate) use shutter::{Exposure, Shutter};
pub(crate) use tile::{Tile, pixel_count, render_tile, tile_count};
