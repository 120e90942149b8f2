//! The options of `scales`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `scales`.
#[derive(Debug, Args)]
pub struct Scales {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Pixels of the camera, about; there are as many bounces as it sees hits.
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the least time counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub rounds: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
