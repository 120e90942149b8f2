//! The projection of points along sixteen rays.

use crate::simd::Simd;

/// The projection of sixteen rays, a lane each: onto the plane of the two axes along which a ray goes less far.
#[derive(Clone, Copy)]
pub(crate) struct Projection<S: Simd> {
    pub(crate) origin: [S::F; 2],
    /// Slopes of the rays: how far they go along the plane's axes while they go 1 along the third, whichever way.
    pub(crate) shear: [S::F; 2],
    pub(crate) forward: S::F,
    pub(crate) start: S::F,
}

impl<S: Simd> Projection<S> {
    /// A point, given along the axes of the projection: its place in the plane, negated (which shows in no weight), and its depth.
    #[inline(always)]
    pub(crate) fn of(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let depth = s.fma(z, self.forward, self.start);
        let (x, y) = (s.sub(self.origin[0], x), s.sub(self.origin[1], y));
        [s.fma(self.shear[0], depth, x), s.fma(self.shear[1], depth, y), depth]
    }

    /// For points relative to the one at which the rays start: with slopes that count on coordinates as they are.
    #[inline(always)]
    pub(crate) fn relative(mut self, s: S) -> Self {
        self.shear = [s.mul(self.shear[0], self.forward), s.mul(self.shear[1], self.forward)];
        self
    }

    /// As [`Self::of`], of such a point. (The depth apart: for most triangles nobody asks.)
    #[inline(always)]
    pub(crate) fn of_relative(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        [s.fnma(self.shear[0], z, x), s.fnma(self.shear[1], z, y), s.mul(z, self.forward)]
    }
}
