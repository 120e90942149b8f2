//! Axis-aligned boxes with exact ends.

use super::Node;

/// A box, object space. Its ends are copies of input coordinates, never rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    /// Lower end per axis.
    pub(super) lower: [f32; 3],
    /// Upper end per axis.
    pub(super) upper: [f32; 3],
}

impl Bounds {
    /// Contains nothing; the neutral element of [`Bounds::grow`].
    pub(super) const EMPTY: Bounds = Bounds { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    pub(super) fn of_points(points: &[[f32; 3]]) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for &point in points {
            bounds.grow(&Bounds { lower: point, upper: point });
        }
        bounds
    }

    pub(super) fn of_node(node: &Node) -> Bounds {
        Bounds { lower: node.lower, upper: node.upper }
    }

    /// Extends to contain `other`. Written with comparisons instead of `f32::min`, which also
    /// handles NaN and is slower.
    #[inline(always)]
    pub(super) fn grow(&mut self, other: &Bounds) {
        for k in 0..3 {
            self.lower[k] = if other.lower[k] < self.lower[k] { other.lower[k] } else { self.lower[k] };
            self.upper[k] = if other.upper[k] > self.upper[k] { other.upper[k] } else { self.upper[k] };
        }
    }

    #[inline(always)]
    pub(super) fn union(mut self, other: &Bounds) -> Bounds {
        self.grow(other);
        self
    }

    /// Half the surface area of a box that is not empty. In `f64`, where the products of any two
    /// finite `f32` extents neither overflow nor vanish.
    #[inline(always)]
    pub(super) fn half_area(&self) -> f64 {
        let [x, y, z]: [f64; 3] =
            std::array::from_fn(|k| f64::from(self.upper[k]) - f64::from(self.lower[k]));
        x * y + y * z + z * x
    }

    /// A quarter of the sum of both ends: half the centre. Halved once more than needed so that
    /// neither it nor the difference of two of them overflows.
    #[inline(always)]
    pub(super) fn half_center(&self) -> [f32; 3] {
        std::array::from_fn(|k| 0.25 * self.lower[k] + 0.25 * self.upper[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_area_of_extreme_boxes_is_finite_and_positive() {
        let wide = Bounds { lower: [-f32::MAX; 3], upper: [f32::MAX; 3] };
        assert!(wide.half_area().is_finite());
        assert!(wide.half_center().iter().all(|c| *c == 0.0));
        let tiny = Bounds { lower: [0.0; 3], upper: [f32::from_bits(1), f32::from_bits(1), 0.0] };
        assert!(tiny.half_area() > 0.0);
    }

    #[test]
    fn bounds_of_points_are_their_extremes() {
        let bounds = Bounds::of_points(&[[1.0, 5.0, -2.0], [0.5, 6.0, -3.0]]);
        assert_eq!(bounds, Bounds { lower: [0.5, 5.0, -3.0], upper: [1.0, 6.0, -2.0] });
    }
}
