//! Axis-aligned boxes with exact ends.

use super::Node;

/// A box, object space. Its ends are copies of input coordinates, never rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    /// Lower end per axis, then upper end per axis with its sign changed: all six only become
    /// smaller when the box grows, which takes vectors.
    ends: [f32; 6],
}

impl Bounds {
    /// Contains nothing; the neutral element of [`Bounds::grow`].
    pub(super) const EMPTY: Bounds = Bounds { ends: [f32::INFINITY; 6] };

    #[inline(always)]
    pub(super) fn new([a, b, c]: [f32; 3], [d, e, f]: [f32; 3]) -> Bounds {
        Bounds { ends: [a, b, c, -d, -e, -f] }
    }

    pub(super) fn of_points(points: &[[f32; 3]]) -> Bounds {
        points.iter().fold(Bounds::EMPTY, |bounds, point| bounds.union(&Bounds::new(*point, *point)))
    }

    #[inline(always)]
    pub(super) fn of_node(node: &Node) -> Bounds {
        Bounds::new(node.lower, node.upper)
    }

    /// Lower end per axis.
    #[inline(always)]
    pub(super) fn lower(&self) -> [f32; 3] {
        let [a, b, c, ..] = self.ends;
        [a, b, c]
    }

    /// Upper end per axis.
    #[inline(always)]
    pub(super) fn upper(&self) -> [f32; 3] {
        let [.., d, e, f] = self.ends;
        [-d, -e, -f]
    }

    /// Extends to contain `other`. Written with comparisons instead of `f32::min`, which also
    /// handles NaN and is slower.
    #[inline(always)]
    pub(super) fn grow(&mut self, other: &Bounds) {
        for (end, other) in self.ends.iter_mut().zip(&other.ends) {
            *end = if other < end { *other } else { *end };
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
            std::array::from_fn(|k| -f64::from(self.ends[k + 3]) - f64::from(self.ends[k]));
        x * y + y * z + z * x
    }

    /// A quarter of the sum of both ends: half the centre. Halved once more than needed so that
    /// neither it nor the difference of two of them overflows.
    #[inline(always)]
    pub(super) fn half_center(&self) -> [f32; 3] {
        std::array::from_fn(|k| 0.25 * self.ends[k] - 0.25 * self.ends[k + 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_area_of_extreme_boxes_is_finite_and_positive() {
        let wide = Bounds::new([-f32::MAX; 3], [f32::MAX; 3]);
        assert!(wide.half_area().is_finite());
        assert!(wide.half_center().iter().all(|c| *c == 0.0));
        let tiny = Bounds::new([0.0; 3], [f32::from_bits(1), f32::from_bits(1), 0.0]);
        assert!(tiny.half_area() > 0.0);
    }

    #[test]
    fn bounds_of_points_are_their_extremes() {
        let bounds = Bounds::of_points(&[[1.0, 5.0, -2.0], [0.5, 6.0, -3.0]]);
        assert_eq!(bounds, Bounds::new([0.5, 5.0, -3.0], [1.0, 6.0, -2.0]));
    }
}
