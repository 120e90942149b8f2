//! Rendering: tiles of samples in parallel, frames, and sequences of frames.

mod frame;
mod progress;
mod sequence;
mod tile;

pub(crate) use sequence::{FrameReport, Report, frame_range, frames_to_show, render_sequence};
pub(crate) use tile::{Tile, pixel_count, render_tile, tile_count};
