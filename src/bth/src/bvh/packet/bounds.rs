//! Bounds of all rays of a packet, which boxes and triangles are tested against before the single rays are.

use crate::simd::Simd;
use bth_format::layout::WideNode;

/// A set that contains every point at which rays of a packet can hit something.
pub(crate) trait PacketBounds<S: Simd> {
    /// Whether the directions of the rays may lie in different octants.
    const MIXED_OCTANTS: bool;
    /// Whether all rays start at one point. The corners of boxes ([`Self::corners`]) are then relative to it.
    const COMMON_ORIGIN: bool;
    /// Origin and slopes of the rays, with [`Self::COMMON_ORIGIN`].
    fn view(&self) -> Option<&FrustumView>;
    /// The children of a node whose boxes rays may enter before the depth `limit`, as bits, and lower bounds of the depths at
    /// which any ray enters them.
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F);
    /// Outcodes of sixteen points, given as rows of x, y and z: a bit for each side of the bounds beyond which the point lies. A
    /// triangle whose corners have a bit in common is missed by all rays.
    fn outcodes(&self, s: S, rows: [S::F; 3]) -> S::U;
    /// The two corners of a child's box, as [`RayGroup::meets`](super::ray_group::RayGroup::meets) expects them.
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2];
}

/// The center of a frustum, and the interval of the slopes of its rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrustumView {
    /// The rays' common origin, or the middle of the interval of their origins.
    pub(crate) origin: [f32; 3],
    /// The two axes of the plane of projection, and the main axis ([`Span::main_axis`](super::coherence::Span::main_axis)).
    pub(super) axis: [usize; 3],
    /// Middle of the interval of the slopes: change of the two coordinates in the plane per unit of the third.
    pub(super) shear: [f32; 2],
    /// Half the width of that interval.
    pub(super) shear_width: [f32; 2],
}

impl FrustumView {
    /// The axis along which the rays advance most.
    #[inline(always)]
    pub(crate) fn main_axis(&self) -> usize {
        self.axis[2]
    }

    /// Bounds of sixteen points relative to the origin, given as rows of x, y and z: the greatest |x| or |y| to which any ray
    /// projects each point, and its |depth|.
    ///
    /// The first is the coordinate sheared by the middle of the interval of slopes plus half the interval's width times |depth|. An
    /// addition of 2^-20 of the depth and a factor of 1 + 2^-20 exceed the roundings here and in the rays' own slopes.
    #[inline(always)]
    pub(crate) fn projected_bounds<S: Simd>(&self, s: S, rows: [S::F; 3]) -> [S::F; 2] {
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
