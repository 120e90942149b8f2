//! The options of `stress`.

use super::output::Output;
use super::values::at_least_one;
use clap::Args;

/// `stress`.
#[derive(Debug, Args)]
pub struct Stress {
    /// Rays to trace in all, in millions; each counts once for every structure and query that it goes through. At least one round is traced:
    /// 12,288 rays of each shape through every structure, which takes minutes, as does compiling them.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub millions: u64,
    /// Size of the shapes: the number of their triangles grows with its square.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(i32).range(1..=64))]
    pub size: i32,
    /// One of this many rays is compared with every triangle.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = at_least_one)]
    pub one_in: usize,
    /// Start of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Only structures with this in their names, such as `deformed bvh` or `bth`.
    #[arg(long, value_name = "NAME", default_value = "")]
    pub structure: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub output: Output,
}
