//! The options of `paper`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `paper`.
#[derive(Debug, Args)]
pub struct Paper {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Rounds of which the fastest counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub rounds: usize,
    /// Triangles of the largest model that gets a k-d tree, which takes long to build.
    #[arg(long, value_name = "N", default_value_t = 1_000_000)]
    pub most_kd: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
