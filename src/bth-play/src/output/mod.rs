//! Pictures and where they go: tone mapping, the color bar, PNG files, animations and streams.

mod animation;
mod heat_map;
mod picture;
mod sink;
mod tone_mapping;

pub(crate) use picture::Picture;
pub(crate) use sink::{Pattern, Sink, refuse_inputs};
pub(crate) use tone_mapping::{shoulder, to_picture};
