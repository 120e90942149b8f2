//! The exact orientation of tetrahedra.

use crate::number::{Coordinate, cross, dot, exact, sub};
use std::cmp::Ordering;

/// On which side of the plane through the first three points the fourth lies: `Greater` where (b −
/// a) × (c − a) points to.
///
/// # Panics
/// If a coordinate is not finite.
pub fn orientation<T: Coordinate>(points: [[T; 3]; 4]) -> Ordering {
    let [a, b, c, d] = points.map(exact);
    let volume = dot(&cross(&sub(&b, &a), &sub(&c, &a)), &sub(&d, &a));
    volume.is_positive().cmp(&volume.is_negative())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_above_on_and_below_a_plane() {
        let face = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let with = |z| orientation([face[0], face[1], face[2], [0.3, 0.3, z]]);
        assert_eq!([1e-45f32, 0.0, -1e-45].map(with), [Ordering::Greater, Ordering::Equal, Ordering::Less]);
    }
}
