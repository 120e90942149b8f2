//! Rendering: squares of samples in parallel, exposures of frames, and sequences of frames.

mod brightness;
mod frame;
mod parts;
mod region;
mod sequence;
mod shutter;

pub(crate) use brightness::light_factor;
pub(crate) use frame::{FrameReport, Tile, pixel_count, render_tile, tile_count};
pub(crate) use region::Region;
pub(crate) use sequence::{Report, frame_range, frames_to_show, render_sequence, shutter};
pub(crate) use shutter::{Exposure, Shutter};
