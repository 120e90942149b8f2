//! Bounds of all rays of a packet, which are tested before the rays themselves.

use crate::query::Goal;
use crate::simd::Simd;
use bth_format::layout::WideNode;

/// A set that contains every point at which rays of a packet can hit something.
pub(crate) trait PacketBounds<S: Simd> {
    /// True if the directions of the rays may lie in different octants.
    const MIXED_OCTANTS: bool;
    /// True if the rays have the same origin, and corners of boxes are given relative to it.
    const COMMON_ORIGIN: bool;
    /// Where packets with such bounds are made for one goal only: whether that is any hit.
    const IS_ANY: Option<bool>;
    /// Returns true if a query with this goal, in a packet with such bounds, ends at the first hit
    /// found.
    #[inline(always)]
    fn is_any(goal: impl Goal) -> bool {
        Self::IS_ANY.unwrap_or(goal.is_any())
    }
    /// The view from that origin, if `COMMON_ORIGIN`.
    fn view(&self) -> Option<&FrustumView>;
    /// The children of a node that any ray may hit before the depth `limit`, one bit per child, and
    /// lower bounds of the depths at which any of the rays enters them.
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F);
    /// For sixteen points, given as rows of x, y and z, a bit for each side of the bounds beyond
    /// which they lie. A triangle whose three corners have a bit in common is missed by all rays.
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U;
    /// The two corners of a child's box that
    /// [`RayGroup::may_enter`](super::ray_group::RayGroup::may_enter) takes.
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2];
}

/// More than what roundings come to in projections that coherent rays share, relative to each term
/// of a sum: 32u with u = 2^-24.
pub(super) const SLACK: f32 = 1.0 / (1 << 19) as f32;

/// The projection that coherent rays share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrustumView {
    /// The common origin, or the middle of the origins.
    pub(crate) origin: [f32; 3],
    /// The two axes of the plane of projection, and the main axis of the directions.
    pub(super) axis: [usize; 3],
    /// For each axis of the plane the middle of the interval of slopes.
    pub(super) shear: [f32; 2],
    /// For each axis of the plane half the width of that interval, increased by [`SLACK`] of itself
    /// and of 1.
    pub(super) shear_width: [f32; 2],
}

impl FrustumView {
    /// The main axis of the directions.
    #[inline(always)]
    pub(crate) fn axis(&self) -> usize {
        self.axis[2]
    }

    /// For sixteen points relative to the origin, given as rows of x, y and z: an upper bound of
    /// |x| and |y| in the projection of any ray, and |depth|. The bound is the sheared coordinate
    /// for the middle of the interval of slopes, plus half the interval times the depth, plus
    /// [`SLACK`] of the sum.
    #[inline(always)]
    pub(crate) fn spread<S: Simd>(&self, s: S, rows: [S::F; 3]) -> [S::F; 2] {
        let depth = rows[self.axis[2]];
        let far = s.abs(depth);
        let mut greatest = s.splat(0.0);
        for j in 0..2 {
            let middle = s.abs(s.fnma(s.splat(self.shear[j]), depth, rows[self.axis[j]]));
            greatest = s.max(s.fma(far, s.splat(self.shear_width[j]), middle), greatest);
        }
        [s.mul(greatest, s.splat(1.0 + SLACK)), far]
    }
}
