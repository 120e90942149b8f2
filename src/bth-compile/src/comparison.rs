//! Hooks for comparisons with other methods, which the benchmarks make; the compiler itself does not use them.

pub use crate::bvh::{Decide, Decision, Planner, Role, Vertices, collapse_by};
pub use crate::costs::{area_steps, mean_steps};
