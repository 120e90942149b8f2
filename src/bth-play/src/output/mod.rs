//! Pictures and where they go: tone mapping, the color bar, PNG files, animations and streams.

mod animation;
mod heat_map;
mod picture;
mod sink;

pub(crate) use picture::{Picture, shoulder, to_picture};
pub(crate) use sink::{Pattern, Sink, refuse_inputs};
