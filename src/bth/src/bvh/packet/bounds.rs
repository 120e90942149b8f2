//! What bounds all rays of a packet together: tested before the single rays are.

use crate::simd::Simd;
use bth_format::layout::WideNode;

/// A set that contains every point at which rays of a packet can hit something.
pub(crate) trait PacketBounds<S: Simd> {
    /// Whether the rays go into different octants.
    const MIXED: bool;
    /// Whether they start at one point, and corners of boxes are given relative to that.
    const FROM_POINT: bool;
    /// How they look from there, if they do.
    fn view(&self) -> Option<&FrustumView>;
    /// The children of a node that it may meet before a depth, a bit each, and lower bounds of the depth at
    /// which any of the rays enters them.
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F);
    /// For sixteen points, given as rows of x, y and z, the sides on which they lie outside, a bit each. A
    /// triangle whose corners all have a bit in common is missed by all rays.
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U;
    /// The corners of a child's box, as [`RayGroup::meets`] wants them.
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2];
}

/// What coherent rays have in common, seen from where they start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrustumView {
    /// Where they start, or the middle of that.
    pub(crate) origin: [f32; 3],
    /// Two axes, and the one along which they go.
    pub(super) axis: [usize; 3],
    /// The middle of the interval of their slopes along those two, and half its width.
    pub(super) shear: [f32; 2],
    pub(super) shear_width: [f32; 2],
}

impl FrustumView {
    /// The axis along which the rays go.
    #[inline(always)]
    pub(crate) fn axis(&self) -> usize {
        self.axis[2]
    }

    /// Of sixteen points relative to the origin, given as rows of x, y and z: bounds of |x| and |y| as any ray sees them, and
    /// |depth|. Coordinates sheared by the middle of the slopes' interval, and half its width times the depth; 2^-20 of the
    /// depth, and of the sum, is more than the roundings here and in the rays' own slopes.
    #[inline(always)]
    pub(crate) fn spread<S: Simd>(&self, s: S, rows: [S::F; 3]) -> [S::F; 2] {
        const UP: f32 = 1.0 / (1 << 20) as f32;
        let depth = rows[self.axis[2]];
        let far = s.abs(depth);
        let mut greatest = s.splat(0.0);
        for j in 0..2 {
            let middle = s.abs(s.fnma(s.splat(self.shear[j]), depth, rows[self.axis[j]]));
            greatest = s.max(s.fma(far, s.splat(self.shear_width[j] + UP), middle), greatest);
        }
        [s.mul(greatest, s.splat(1.0 + UP)), far]
    }
}
