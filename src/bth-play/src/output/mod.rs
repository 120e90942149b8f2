//! Pictures and where they go: tone mapping, the color bar, PNG files, animations and streams.

mod animation;
mod denoise;
mod heat_map;
mod oidn;
mod picture;
mod sink;
mod tone_mapping;
mod video;

pub(crate) use picture::Picture;
pub(crate) use sink::{Pattern, Sink, refuse_inputs};
pub(crate) use tone_mapping::{has_library, margin, to_picture};
