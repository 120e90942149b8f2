//! Exact arithmetic on coordinates: sums of products without rounding, of `f32` values and of any
//! `f64`, and geometric predicates made of them.

mod dyadic;
mod expansion;
mod natural;
mod predicates;

pub use dyadic::{Dyadic, DyadicVector, dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
pub(crate) use expansion::two_sum;
pub use expansion::{EDGE_PARTS, Expansion, VOLUME_PARTS, wide_volume};
pub use predicates::{is_zero_area, side, wide_side};
