//! The options of `quality`.

use super::models::Models;
use super::run::RunOptions;
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
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}
