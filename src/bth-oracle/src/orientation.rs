//! The exact orientation of tetrahedra.

use crate::intersection::{determinant, integer, sub};
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// On which side of the plane through the first three points the fourth lies: `Greater` where (b −
/// a) × (c − a) points to.
///
/// # Panics
/// If a coordinate is not finite.
pub fn orientation(points: [[f32; 3]; 4]) -> Ordering {
    let [a, b, c, d] = points.map(|p| p.map(integer));
    let volume: BigInt = determinant(&sub(&b, &a), &sub(&c, &a), &sub(&d, &a));
    match volume.sign() {
        Sign::Plus => Ordering::Greater,
        Sign::NoSign => Ordering::Equal,
        Sign::Minus => Ordering::Less,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_above_on_and_below_a_plane() {
        let face = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let with = |z: f32| orientation([face[0], face[1], face[2], [0.3, 0.3, z]]);
        assert_eq!([1e-45, 0.0, -1e-45].map(with), [Ordering::Greater, Ordering::Equal, Ordering::Less]);
    }
}
