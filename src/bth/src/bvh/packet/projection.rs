//! The projection of points along sixteen rays.

use crate::simd::Simd;

/// The projection of points along sixteen rays, one in a lane, onto the plane of the two axes other than that of the direction's
/// greatest |component|. Its fields are those of [`TriangleFilter`](crate::intersect::filter::TriangleFilter).
#[derive(Clone, Copy)]
pub(crate) struct Projection<S: Simd> {
    /// The rays' origins along the two axes of the plane.
    pub(crate) origin: [S::F; 2],
    /// Change of the plane's coordinates along the ray per unit of depth.
    pub(crate) shear: [S::F; 2],
    /// 1 or -1, the sign of the direction along the third axis.
    pub(crate) forward: S::F,
    /// Depth of the coordinate 0 along the third axis.
    pub(crate) start: S::F,
}

impl<S: Simd> Projection<S> {
    /// Projects a point, given in the axes of the projection, to x, y and depth. x and y are negated, which changes no weight,
    /// because weights are sums of products of an x and a y.
    #[inline(always)]
    pub(crate) fn project(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let depth = s.fma(z, self.forward, self.start);
        let (x, y) = (s.sub(self.origin[0], x), s.sub(self.origin[1], y));
        [s.fma(self.shear[0], depth, x), s.fma(self.shear[1], depth, y), depth]
    }

    /// The projection for [`Self::project_relative`]: its `shear` is per unit of the third coordinate instead of depth.
    #[inline(always)]
    pub(crate) fn to_relative(mut self, s: S) -> Self {
        self.shear = [s.mul(self.shear[0], self.forward), s.mul(self.shear[1], self.forward)];
        self
    }

    /// Projects a point that is relative to the common origin of the rays, given in the axes of the projection, to x, y and depth.
    /// The depth is not used for x and y, so that it need not be computed for the triangles that are excluded without it.
    #[inline(always)]
    pub(crate) fn project_relative(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        [s.fnma(self.shear[0], z, x), s.fnma(self.shear[1], z, y), s.mul(z, self.forward)]
    }
}
