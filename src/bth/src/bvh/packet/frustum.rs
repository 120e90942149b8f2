//! Packet bounds of coherent rays: a frustum, by interval arithmetic.

use super::bounds::{FrustumView, PacketBounds};
use super::ray_group::RayGroup;
use crate::bvh::coherence::Span;
use crate::bvh::shaft::Shaft;
use crate::intersect::boxes::{self, PAD};
use crate::intersect::prepare;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectBounds;

/// Bounds of coherent rays: a [`Shaft`] for boxes, and for triangles what follows.
///
/// With s = d_x/d_z along one axis z for all, a point's sheared x is
/// (x - c_x) - s₀(z - c_z) + (s₀ - s)(z - c_z) + a with a = (c_x - o_x) - s(c_z - o_z): the middle of the interval of s,
/// its half width, and an interval of a. Coherent rays have |s| <= 1.25, rounded at most twice. Roundings: 6uE for the first two
/// terms, 8uE for s in the third, 20uE for a, 8uE for the sums; the pad is 64uE.
/// Where all rays have the same origin (`POINT`), the intervals of origins, widened by their pads, are also used for the single rays
/// ([`RayGroup::may_enter`]), and the interval of a is zero.
pub(crate) struct Frustum<S: Simd, const POINT: bool> {
    view: FrustumView,
    shaft: Shaft<S>,
    /// Padded bound of the sheared coordinates of points within the upper sides.
    upper: [f32; 2],
    /// The same for the lower sides, negated.
    lower: [f32; 2],
}

impl<S: Simd, const POINT: bool> Frustum<S, POINT> {
    /// The frustum of coherent rays ([`Span::is_coherent`]) that are prepared in `groups`.
    #[inline(always)]
    pub(crate) fn new(s: S, bounds: &ObjectBounds, span: &Span, groups: &[RayGroup<S>]) -> Self {
        let zero = s.splat(0.0);
        let extent = prepare::extent(bounds, span.farthest_origin());
        let padded = prepare::padded_extent(bounds, span.farthest_origin());
        let (main, _) = span.main_axis();
        let axis = [(main + 1) % 3, (main + 2) % 3, main];
        let mut center = [0.0; 3];
        for k in 0..3 {
            let [least, greatest] = span.origin[k];
            center[k] = if POINT { least } else { 0.5 * least + 0.5 * greatest };
        }
        // The ranges of three reciprocals, two slopes and two terms a of sheared coordinates, and the least depth.
        let (mut least, mut greatest) = ([s.splat(f32::INFINITY); 8], [s.splat(f32::NEG_INFINITY); 7]);
        for group in groups {
            for k in 0..3 {
                let r = group.reciprocal[k];
                (least[k], greatest[k]) = (s.min(least[k], r), s.max(greatest[k], r));
            }
            for j in 0..2 {
                let slope = match group.common {
                    // This is the same slope, computed when the rays were prepared.
                    Some(common) if common.0 == main => {
                        s.mul(group.projection.shear[j], group.projection.forward)
                    }
                    _ => s.div(group.direction[axis[j]], group.direction[main]),
                };
                (least[3 + j], greatest[3 + j]) = (s.min(least[3 + j], slope), s.max(greatest[3 + j], slope));
                let addend = if POINT {
                    zero
                } else {
                    let from = s.sub(s.splat(center[main]), group.origin[main]);
                    let beside = s.sub(s.splat(center[axis[j]]), group.origin[axis[j]]);
                    s.fnma(slope, from, beside)
                };
                (least[5 + j], greatest[5 + j]) =
                    (s.min(least[5 + j], addend), s.max(greatest[5 + j], addend));
            }
            least[7] = s.min(least[7], group.first);
        }
        let mut ends = [least[7]; LANES];
        for i in 0..7 {
            (ends[i], ends[8 + i]) = (least[i], s.sub(s.splat(0.0), greatest[i]));
        }
        let mut least = [0.0; LANES];
        s.store(s.least_of_each(ends), &mut least);
        let ends = least;
        let both = |of: usize| [ends[of], -ends[8 + of]];
        let view = FrustumView { origin: center, axis, shear: [0.0; 2], shear_width: [0.0; 2] };
        let shaft = Shaft::new(s, span, [both(0), both(1), both(2)], ends[7], padded);
        let mut frustum = Frustum { view, shaft, upper: [0.0; 2], lower: [0.0; 2] };
        let pad = 4.0 * PAD as f32 * extent;
        for j in 0..2 {
            let (shear, addend) = (both(3 + j), both(5 + j));
            let middle = 0.5 * (shear[0] + shear[1]);
            frustum.view.shear[j] = middle;
            frustum.view.shear_width[j] = (shear[1] - middle).max(middle - shear[0]);
            frustum.upper[j] = pad - addend[0];
            frustum.lower[j] = pad + addend[1];
        }
        frustum
    }
}

/// [`Frustum::new`] as a part of kernels.
pub(crate) struct FrustumOf<'a, S: Simd, const POINT: bool> {
    pub(crate) bounds: &'a ObjectBounds,
    pub(crate) span: &'a Span,
    pub(crate) groups: &'a [RayGroup<S>],
}

impl<S: Simd, const POINT: bool> Part<S> for FrustumOf<'_, S, POINT> {
    type Output = Frustum<S, POINT>;
    #[inline(always)]
    fn run(self, s: S) -> Frustum<S, POINT> {
        Frustum::new(s, self.bounds, self.span, self.groups)
    }
}

impl<S: Simd, const POINT: bool> PacketBounds<S> for Frustum<S, POINT> {
    const MIXED_OCTANTS: bool = false;
    const COMMON_ORIGIN: bool = POINT;
    const IS_ANY: Option<bool> = if POINT { Some(false) } else { None };

    #[inline(always)]
    fn view(&self) -> Option<&FrustumView> {
        POINT.then_some(&self.view)
    }

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        self.shaft.children(s, node, limit)
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let FrustumView { origin, axis, shear, shear_width } = &self.view;
        let depth = s.sub(rows[axis[2]], s.splat(origin[axis[2]]));
        let far = s.abs(depth);
        let mut out = s.splat_u(0);
        for j in 0..2 {
            let x = s.sub(rows[axis[j]], s.splat(origin[axis[j]]));
            let x = s.fnma(s.splat(shear[j]), depth, x);
            let width = s.splat(shear_width[j]);
            let above = s.lt(s.fma(far, width, s.splat(self.upper[j])), x);
            let below = s.lt(s.fma(far, width, s.add(x, s.splat(self.lower[j]))), s.splat(0.0));
            out = s.or_u(out, s.select_u(above, s.splat_u(1 << (2 * j)), s.splat_u(0)));
            out = s.or_u(out, s.select_u(below, s.splat_u(2 << (2 * j)), s.splat_u(0)));
        }
        out
    }

    #[inline(always)]
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2] {
        let mut out = [[0.0; 3]; 2];
        for k in 0..3 {
            out[0][k] = boxes::row(&node.bounds[k], self.shaft.near[k])[slot % WIDTH];
            out[1][k] = boxes::row(&node.bounds[k], self.shaft.near[k] ^ boxes::FAR)[slot % WIDTH];
            if POINT {
                out[0][k] -= self.shaft.near_origin[k];
                out[1][k] -= self.shaft.far_origin[k];
            }
        }
        out
    }
}
