//! The options of `quality`.

use super::models::Models;
use super::output::Output;
use super::values::at_least_one;
use crate::names::Names;
use clap::Args;

/// `quality`.
#[derive(Debug, Args)]
pub struct Quality {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 60_000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the fastest counts.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = at_least_one)]
    pub rounds: usize,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub sets: Names,
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
