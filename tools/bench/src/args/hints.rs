//! The options of `hints`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `hints`.
#[derive(Debug, Args)]
pub struct Hints {
    /// Scenes of `bth-scenes list`, manifests, or glTF files.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Width of the picture, which is 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 480, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}

impl Hints {
    /// Width and height, multiples of 4.
    pub fn size(&self) -> (u32, u32) {
        let width = if self.run.quick { 96 } else { self.width.next_multiple_of(4) };
        (width, (width * 9 / 16).next_multiple_of(4))
    }
}
