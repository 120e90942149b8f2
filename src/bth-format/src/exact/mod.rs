//! Exact arithmetic on `f32` coordinates: sums of products without rounding, and geometric
//! predicates made of them.

mod expansion;
mod predicates;

pub use expansion::{EDGE_PARTS, Expansion, VOLUME_PARTS};
pub use predicates::{is_zero_area, side};
