//! The options of `accuracy`.

use super::models::Models;
use super::output::Output;
use super::values::at_least_one;
use crate::names::Names;
use clap::Args;

/// `accuracy`.
#[derive(Debug, Args)]
pub struct Accuracy {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the median time counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub rounds: usize,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    /// One of this many rays is compared with every triangle in exact arithmetic.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = at_least_one)]
    pub one_in: usize,
    /// Small pictures, few rays and one round: whether it works, not how fast it is.
    #[arg(long)]
    pub quick: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
