//! Exact test for triangles without area.

use robust::{Coord, orient2d};

/// Whether the three corners lie on one line, decided exactly: they do if and only if their
/// projections along all three axes do. Coordinates must be finite.
pub(super) fn is_zero_area(corners: [[f32; 3]; 3]) -> bool {
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(i, j)| {
        let [a, b, c] = corners.map(|p| Coord { x: f64::from(p[i]), y: f64::from(p[j]) });
        orient2d(a, b, c) == 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_corners_and_corners_on_a_line_have_no_area() {
        let (a, b) = ([0.1, 0.2, 0.3], [1.0, 2.0, -3.0]);
        assert!(is_zero_area([a, a, b]));
        assert!(is_zero_area([a, b, b]));
        assert!(is_zero_area([a, a, a]));
        assert!(is_zero_area([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [4.0, 4.0, 4.0]]));
    }

    #[test]
    fn a_triangle_off_a_line_by_the_smallest_step_has_area() {
        let nearly = f32::from_bits(1.0f32.to_bits() + 1);
        assert!(!is_zero_area([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0 * nearly]]));
        let tiny = f32::from_bits(1);
        assert!(!is_zero_area([[0.0; 3], [tiny, 0.0, 0.0], [0.0, tiny, 0.0]]));
    }

    #[test]
    fn a_triangle_in_an_axis_plane_has_area() {
        for k in 0..3 {
            let mut corners = [[5.0f32; 3]; 3];
            corners[1][k] = 6.0;
            corners[2][(k + 1) % 3] = 7.0;
            assert!(!is_zero_area(corners));
        }
    }
}
