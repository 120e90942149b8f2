//! Exact arithmetic on coordinates of `f32`: sums of products without rounding, and the predicates made of them.

mod expansion;
mod predicates;

pub use expansion::{EDGE, Expansion, VOLUME};
pub use predicates::{is_zero_area, side};
