//! The options of `shutter`.

use super::run::RunOptions;
use super::values::{at_least_one, positive};
use clap::Args;

/// `shutter`.
#[derive(Debug, Args)]
pub struct Shutter {
    /// glTF files, manifests, scenes of `bth-scenes list`, or `twist:MODEL` for a model that is twisted.
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// For how many frames the shutter is open.
    #[arg(long, value_name = "FRAMES,…", value_delimiter = ',', default_value = "0.5,1,4", value_parser = positive)]
    pub open: Vec<f64>,
    /// Rounds of which the quickest counts.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Width of the pictures, which are 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 240, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub width: u32,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}

impl Shutter {
    /// Width and height of the pictures, multiples of 4.
    pub fn size(&self) -> (u32, u32) {
        let width = if self.run.quick { 64 } else { self.width.next_multiple_of(4) };
        (width, (width * 9 / 16).next_multiple_of(4))
    }
}
