//! The options of `paper`.

use super::output::Output;
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
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
