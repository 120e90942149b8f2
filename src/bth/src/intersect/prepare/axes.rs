//! Axes of projection of sixteen rays.

use crate::simd::{Lanewise, Simd};

/// The axes of projection of sixteen rays: of each ray the axis z of its direction's largest
/// |component|, and for the plane of projection the next axis and the one after it in cyclic order.
/// [`Line`](crate::intersect::line::Line) swaps the plane's axes of rays with a negative z, to keep
/// the orientation; the conservative tests do not depend on the orientation.
pub(crate) trait Axes<S: Lanewise> {
    /// Permutes x, y and z of points to the coordinates along the plane's two axes and along the
    /// third axis.
    fn permute(&self, s: S, point: [S::F; 3]) -> [S::F; 3];
    /// Indices of the axes, in the same order.
    fn axes(&self, s: S) -> [S::U; 3];
}

/// Axes of rays whose largest |components| may lie along different axes. Where neither bit is set,
/// the axis is z.
#[derive(Clone, Copy)]
pub(crate) struct MixedAxes<S: Lanewise> {
    pub(crate) is_x: S::M,
    pub(crate) is_y: S::M,
}

impl<S: Lanewise> MixedAxes<S> {
    #[inline(always)]
    pub(crate) fn of(s: S, [x, y, z]: [S::F; 3]) -> Self {
        let size = [s.abs(x), s.abs(y), s.abs(z)];
        let is_x = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
        MixedAxes { is_x, is_y: s.and_not(s.lt(size[2], size[1]), is_x) }
    }

    /// The axes if they are the same for all of sixteen rays.
    #[inline(always)]
    pub(crate) fn common(&self, s: S) -> Option<CommonAxis> {
        match (s.mask_bits(self.is_x), s.mask_bits(self.is_y)) {
            (0xffff, _) => Some(CommonAxis(0)),
            (_, 0xffff) => Some(CommonAxis(1)),
            (0, 0) => Some(CommonAxis(2)),
            _ => None,
        }
    }

    #[inline(always)]
    fn select(&self, s: S, [x, y, z]: [S::F; 3]) -> S::F {
        s.select(self.is_x, x, s.select(self.is_y, y, z))
    }

    #[inline(always)]
    fn select_u(&self, s: S, [x, y, z]: [u32; 3]) -> S::U {
        s.select_u(self.is_x, s.splat_u(x), s.select_u(self.is_y, s.splat_u(y), s.splat_u(z)))
    }
}

impl<S: Lanewise> Axes<S> for MixedAxes<S> {
    #[inline(always)]
    fn permute(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        [self.select(s, [y, z, x]), self.select(s, [z, x, y]), self.select(s, [x, y, z])]
    }
    #[inline(always)]
    fn axes(&self, s: S) -> [S::U; 3] {
        [self.select_u(s, [1, 2, 0]), self.select_u(s, [2, 0, 1]), self.select_u(s, [0, 1, 2])]
    }
}

impl<S: Simd> MixedAxes<S> {
    /// The axes of the rays of a piece.
    #[inline(always)]
    pub(crate) fn pick(&self, p: S::Piece) -> MixedAxes<S::Piece> {
        MixedAxes { is_x: S::pick_mask(p, &self.is_x), is_y: S::pick_mask(p, &self.is_y) }
    }
}

/// Axes of rays whose largest |components| all lie along the axis of this index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CommonAxis(pub(crate) usize);

impl CommonAxis {
    /// The axes in the order of the projection.
    #[inline(always)]
    pub(crate) fn order(self) -> [usize; 3] {
        // A static, because indexing a constant would copy it first.
        static ORDER: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];
        ORDER[self.0]
    }
}

impl<S: Lanewise> Axes<S> for CommonAxis {
    #[inline(always)]
    fn permute(&self, _: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        match self.0 {
            0 => [y, z, x],
            1 => [z, x, y],
            _ => [x, y, z],
        }
    }
    #[inline(always)]
    fn axes(&self, s: S) -> [S::U; 3] {
        self.order().map(|k| s.splat_u(k as u32))
    }
}
