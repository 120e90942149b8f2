//! The options of `inside`.

use super::output::Output;
use super::values::at_least_one;
use clap::Args;

/// `inside`.
#[derive(Debug, Args)]
pub struct Inside {
    /// Closed model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Points to ask for in all, in millions.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub millions: u64,
    /// One of this many points is compared with every triangle.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = at_least_one)]
    pub one_in: usize,
    /// Start of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
