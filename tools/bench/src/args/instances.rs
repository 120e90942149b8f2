//! The options of `instances`.

use super::run::RunOptions;
use super::values::at_least_one;
use clap::Args;

/// `instances`.
#[derive(Debug, Args)]
pub struct Instances {
    /// Numbers of instances.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_values_t = [10_000], value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub counts: Vec<u32>,
    /// Numbers of threads.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// Rounds of which the median counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 51, value_parser = at_least_one)]
    pub rounds: usize,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
