//! The bounds of triangles as the builder compares them: in one pose, or in several at once.

use super::bounds::Bounds;

/// Bounds whose area the builder sums up. Every stage of the builder is written once over this
/// trait: [`Bounds`] for one pose, [`PoseBounds`](super::pose_bounds::PoseBounds) for several.
pub(super) trait Extent: Copy + PartialEq + Send + Sync {
    /// A value for each order in which triangles are sorted and binned: the axes of one pose or of
    /// several.
    type Orders<T: Clone + Send + Sync>: Clone + Send + Sync + AsRef<[T]> + AsMut<[T]>;

    /// Contains nothing; the neutral element of [`Extent::grow`].
    const EMPTY: Self;

    /// Makes the value of each order.
    fn orders<T: Clone + Send + Sync>(value: impl FnMut(usize) -> T) -> Self::Orders<T>;

    /// Extends to contain `other`.
    fn grow(&mut self, other: &Self);

    /// Contains both.
    #[inline(always)]
    fn union(mut self, other: &Self) -> Self {
        self.grow(other);
        self
    }

    /// Half the surface area of bounds that are not empty, summed over the poses.
    fn half_area(&self) -> f64;

    /// Half the centre along the axis of each order.
    fn half_center(&self) -> Self::Orders<f32>;

    /// The box that the builder writes into its nodes.
    fn node_box(&self) -> Bounds;
}

impl Extent for Bounds {
    type Orders<T: Clone + Send + Sync> = [T; 3];

    const EMPTY: Self = Bounds::EMPTY;

    #[inline(always)]
    fn orders<T: Clone + Send + Sync>(value: impl FnMut(usize) -> T) -> [T; 3] {
        std::array::from_fn(value)
    }

    #[inline(always)]
    fn grow(&mut self, other: &Self) {
        Bounds::grow(self, other);
    }

    #[inline(always)]
    fn half_area(&self) -> f64 {
        Bounds::half_area(self)
    }

    #[inline(always)]
    fn half_center(&self) -> [f32; 3] {
        Bounds::half_center(self)
    }

    #[inline(always)]
    fn node_box(&self) -> Bounds {
        *self
    }
}
