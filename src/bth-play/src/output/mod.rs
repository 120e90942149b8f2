//! Pictures and where they go: tone mapping, the color bar, PNG files, animations and streams.

mod animation;
mod color_bar;
mod color_map;
mod numbered;
mod picture;
mod sink;
mod tone_mapping;
mod y4m;

pub(crate) use numbered::Pattern;
pub(crate) use picture::Picture;
pub(crate) use sink::{Sink, refuse_inputs};
pub(crate) use tone_mapping::{shoulder, to_picture};
