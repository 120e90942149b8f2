//! The options of `scenes`.

use super::run::RunOptions;
use super::values::at_least_one;
use crate::names::Names;
use clap::Args;

/// `scenes`.
#[derive(Debug, Args)]
pub struct Scenes {
    /// Scenes of `bth-scenes list`, or manifests.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Frames to measure, evenly over the range.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub frames: usize,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Width of the pictures, which are 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 640, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}

impl Scenes {
    /// Width and height, multiples of 4.
    pub fn size(&self) -> (u32, u32) {
        let width = self.width.next_multiple_of(4);
        (width, (width * 9 / 16).next_multiple_of(4))
    }
}
