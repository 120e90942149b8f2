//! The exact test for triangles of zero area.

use robust::{Coord, orient2d};

/// Returns true if the corners are collinear, decided exactly (Shewchuk, "Adaptive Precision
/// Floating-Point Arithmetic and Fast Robust Geometric Predicates", 1997). The area is zero if and
/// only if the projections onto all three coordinate planes have zero area. Corners must be finite.
/// Coordinates in f32, and those in f64 that are rounded to numbers of f32, keep the terms of the
/// predicate far from overflow and underflow.
pub fn is_zero_area<T: Into<f64> + Copy>(corners: [[T; 3]; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].into_iter().all(|[i, j]| {
        let [a, b, c] = corners.map(|p| Coord { x: p[i].into(), y: p[j].into() });
        orient2d(a, b, c) == 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Collinear by the definition: (b - a) x (c - a) = 0 in integers.
    fn zero_by_integers(corners: [[i32; 3]; 3]) -> bool {
        let [a, b, c] = corners.map(|p| p.map(i128::from));
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        [[0, 1], [1, 2], [2, 0]].into_iter().all(|[i, j]| u[i] * v[j] == u[j] * v[i])
    }

    #[test]
    fn collinear_and_repeated_corners_have_zero_area() {
        let tiny = f32::from_bits(1);
        assert!(is_zero_area([[0.0f32; 3], [1.0; 3], [3.0; 3]]));
        assert!(is_zero_area([[1.0f32, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
        assert!(is_zero_area([[tiny; 3], [2.0 * tiny; 3], [f32::MAX; 3]]));
    }

    #[test]
    fn the_slightest_bend_is_not_zero_area() {
        let tiny = f32::from_bits(1);
        assert!(!is_zero_area([[0.0f32; 3], [f32::MAX, 0.0, 0.0], [0.0, tiny, 0.0]]));
        assert!(!is_zero_area([[0.0f32; 3], [tiny, 0.0, 0.0], [0.0, 0.0, tiny]]));
        assert!(!is_zero_area([[1.0; 3], [2.0; 3], [3.0, 3.0, 3.0f32.next_up()]]));
    }

    proptest! {
        #[test]
        fn zero_area_agrees_with_integer_arithmetic(
            a in prop::array::uniform3(-3i32..4), b in prop::array::uniform3(-3i32..4),
            c in prop::array::uniform3(-3i32..4), scale in 0u32..20,
        ) {
            let corners = [a, b, c].map(|p| p.map(|x| (x << scale) + 1));
            let floats = corners.map(|p| p.map(|x| x as f32));
            prop_assert_eq!(is_zero_area(floats), zero_by_integers(corners));
        }
    }
}
