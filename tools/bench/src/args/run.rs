//! How a measurement runs and where its results go.

use super::output::Output;
use clap::Args;

/// Options that measurements of pictures and ray sets share.
#[derive(Clone, Debug, Default, Args)]
pub struct RunOptions {
    /// Vector instructions of our kernels; the best that the machine has when absent.
    #[arg(long, value_name = "NAME")]
    pub isa: Option<String>,
    /// Small pictures and one round: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
