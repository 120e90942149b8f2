//! Hooks for comparisons with other methods, which the benchmarks make. The compiler does not use
//! them.

pub use crate::costs::{area_steps, mean_steps};
