//! The options of `costs`.

use super::output::Output;
use super::values::at_least_one;
use clap::Args;

/// `costs`.
#[derive(Debug, Args)]
pub struct Costs {
    /// Models that the estimators' errors are measured on: files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// Models that constants are fitted on.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',', required = true)]
    pub fit: Vec<String>,
    /// Small models, on which every selection is measured.
    #[arg(long, value_name = "MODEL,…", value_delimiter = ',')]
    pub small: Vec<String>,
    /// Least triangles of a node.
    #[arg(long, value_name = "N", default_value_t = 1024)]
    pub least: u32,
    /// Most triangles of a node.
    #[arg(long, value_name = "N", default_value_t = 300_000)]
    pub most: u32,
    /// Nodes of a model, at most.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = at_least_one)]
    pub nodes: usize,
    /// Nodes of a model to fit on, at most; by default as many.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub fit_nodes: Option<usize>,
    /// Rounds of which the fastest counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub rounds: usize,
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
