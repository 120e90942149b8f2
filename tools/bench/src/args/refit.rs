//! The options of `refit`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `refit`.
#[derive(Debug, Args)]
pub struct Refit {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Numbers of threads.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = at_least_one)]
    pub rounds: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
