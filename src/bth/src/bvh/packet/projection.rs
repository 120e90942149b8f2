//! The projection of points along sixteen rays.

use crate::simd::{Lanewise, Simd};

/// The projection along sixteen rays, one in each lane, onto the plane that is perpendicular to the
/// axis of the direction's largest
/// |component|.
#[derive(Clone, Copy)]
pub(crate) struct Projection<S: Lanewise> {
    /// Origins of the rays in the plane.
    pub(crate) origin: [S::F; 2],
    /// Slopes of the rays: change of the plane's coordinates per unit of depth.
    pub(crate) shear: [S::F; 2],
    /// 1 or -1, the sign of the direction along the third axis; a depth is `forward * z + start`.
    pub(crate) forward: S::F,
    /// Depth of the coordinate 0 along the third axis.
    pub(crate) start: S::F,
}

impl<S: Lanewise> Projection<S> {
    /// Projects a point whose coordinates are in the order of the axes. The two coordinates in the
    /// plane are negated, which does not change any weight.
    #[inline(always)]
    pub(crate) fn of(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let depth = s.fma(z, self.forward, self.start);
        let (x, y) = (s.sub(self.origin[0], x), s.sub(self.origin[1], y));
        [s.fma(self.shear[0], depth, x), s.fma(self.shear[1], depth, y), depth]
    }

    /// The projection for points relative to the common origin of the rays: its slopes are per unit
    /// of z, not of depth.
    #[inline(always)]
    pub(crate) fn relative(mut self, s: S) -> Self {
        self.shear = [s.mul(self.shear[0], self.forward), s.mul(self.shear[1], self.forward)];
        self
    }

    /// Like [`Self::of`] for a point relative to the common origin. The depth is not used by the
    /// other coordinates, because for most triangles it is not needed and its computation is
    /// removed.
    #[inline(always)]
    pub(crate) fn of_relative(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        [s.fnma(self.shear[0], z, x), s.fnma(self.shear[1], z, y), s.mul(z, self.forward)]
    }
}

impl<S: Simd> Projection<S> {
    /// The projection along the rays of a piece.
    #[inline(always)]
    pub(crate) fn pick(&self, piece: S::Piece) -> Projection<S::Piece> {
        let Projection { origin: [x, y], shear, forward, start } = self;
        Projection {
            origin: [S::pick(piece, x), S::pick(piece, y)],
            shear: [S::pick(piece, &shear[0]), S::pick(piece, &shear[1])],
            forward: S::pick(piece, forward),
            start: S::pick(piece, start),
        }
    }
}
