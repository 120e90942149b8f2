//! The options of `animation`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `animation`.
#[derive(Debug, Args)]
pub struct Animation {
    /// glTF files, manifests, scenes of `bth-scenes list`, or `twist:MODEL` for a model that is twisted.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Frames to measure, evenly over the range.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = at_least_one)]
    pub frames: usize,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Width of the pictures, which are 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 480, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    /// Numbers of threads for updates; rays are traced by one.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// As `bthc compile --poses`.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub poses: u32,
    /// As `bthc compile --segments`.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub segments: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}

impl Animation {
    /// Width and height of the pictures, multiples of 4.
    pub fn size(&self) -> (u32, u32) {
        let width = if self.run.quick { 96 } else { self.width.next_multiple_of(4) };
        (width, (width * 9 / 16).next_multiple_of(4))
    }
}
