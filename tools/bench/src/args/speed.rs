//! The options of `speed`.

use super::models::Models;
use super::run::RunOptions;
use super::values::at_least_one;
use crate::names::Names;
use clap::Args;

/// `speed`.
#[derive(Debug, Args)]
pub struct Speed {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = at_least_one)]
    pub rays: usize,
    /// Rounds of which the median counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub rounds: usize,
    /// Numbers of threads to trace on: CPU time is measured for 1, wall-clock time for more.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1", value_parser = at_least_one)]
    pub threads: Vec<usize>,
    /// Only these tracers; a star at the end stands for any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub tracers: Names,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub sets: Names,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
