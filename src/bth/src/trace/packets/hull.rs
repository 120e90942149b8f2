//! What all rays of a packet together can meet: tested before the single rays are.

use super::coherence::Span;
use super::group::Group;
use crate::simd::{LANES, Simd};
use crate::trace::prepare;
use crate::trace::slabs::{self, PAD};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectBounds;

/// A set that contains every point at which rays of a packet can hit something.
pub(crate) trait Hull<S: Simd> {
    /// Whether the rays go into different octants.
    const MIXED: bool;
    /// Whether they start at one point, and corners of boxes are given relative to that.
    const FROM_POINT: bool;
    /// How they look from there, if they do.
    fn view(&self) -> Option<&View>;
    /// The children of a node that it may meet before a depth, a bit each, and lower bounds of the depth at
    /// which any of the rays enters them.
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F);
    /// For sixteen points, given as rows of x, y and z, the sides on which they lie outside, a bit each. A
    /// triangle whose corners all have a bit in common is missed by all rays.
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U;
    /// The corners of a child's box, as [`Group::meets`] wants them.
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2];
}

/// What coherent rays have in common, seen from where they start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Where they start, or the middle of that.
    pub(crate) origin: [f32; 3],
    /// Two axes, and the one along which they go.
    axis: [usize; 3],
    /// The middle of the interval of their slopes along those two, and half its width.
    shear: [f32; 2],
    shear_width: [f32; 2],
}

impl View {
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

/// Rays into one octant: interval arithmetic over their origins and directions (Wald, Boulos and Shirley, "Ray Tracing
/// Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG 2007, cull boxes in this way).
///
/// **Boxes.** The depth at which ray l meets a plane is (plane - o)·r: an interval of o, widened by a pad on both sides, and
/// one of r bound it. As all operations round monotonically, only roundings need the pad. With u = 2^-24 and E the sum of the
/// greatest coordinate of the object and that of all origins, they come to at most uE|r| for the reciprocal, 2uE|r| for the
/// padded end, uE|r| for the difference and uE|r| for the product: with the half [`PAD`] = 8uE|r| of [`crate::trace::slabs`] for
/// clamped components less than 14uE|r|; the pad is 2 · PAD = 32uE.
///
/// **Triangles.** With s = d_x/d_z along one axis z for all, a point's sheared x is
/// (x - c_x) - s₀(z - c_z) + (s₀ - s)(z - c_z) + a with a = (c_x - o_x) - s(c_z - o_z): the middle of the interval of s,
/// its half width, and an interval of a. Coherent rays have |s| <= 1.25, rounded at most twice. Roundings: 6uE for the first two
/// terms, 8uE for s in the third, 20uE for a, 8uE for the sums; the pad is 64uE.
/// Where all rays start at one point (`POINT`), the intervals of origins, widened by their pads, serve for the single rays, too
/// ([`Group::meets`]), and those of a are zero.
pub(crate) struct Beam<S: Simd, const POINT: bool> {
    view: View,
    /// The end of the origins' interval that is nearest to the planes that are met first, and that nearest to the others.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    /// Least and greatest reciprocal.
    reciprocal: [[S::F; 2]; 3],
    /// Row of the ends that are met first.
    near: [u32; 3],
    first: S::F,
    /// What keeps points on the upper side, and on the lower.
    upper: [f32; 2],
    lower: [f32; 2],
}

impl<S: Simd, const POINT: bool> Beam<S, POINT> {
    /// Of a coherent run ([`Span::is_coherent`]).
    #[inline(always)]
    pub(crate) fn new(s: S, bounds: &ObjectBounds, span: &Span, groups: &[Group<S>]) -> Self {
        let zero = s.splat(0.0);
        let extent = prepare::extent(bounds, span.farthest_origin());
        let (main, _) = span.main_axis();
        let axis = [(main + 1) % 3, (main + 2) % 3, main];
        let mut center = [0.0; 3];
        for k in 0..3 {
            let [least, greatest] = span.origin[k];
            center[k] = if POINT { least } else { 0.5 * least + 0.5 * greatest };
        }
        // Of the reciprocals, the slopes and what is added to sheared coordinates; and of the first depth.
        let (mut least, mut greatest) = ([s.splat(f32::INFINITY); 8], [s.splat(f32::NEG_INFINITY); 7]);
        for group in groups {
            for k in 0..3 {
                let r = group.reciprocal[k];
                (least[k], greatest[k]) = (s.min(least[k], r), s.max(greatest[k], r));
            }
            for j in 0..2 {
                let slope = match group.common {
                    // As good as the quotient, and there already.
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
        let view = View { origin: center, axis, shear: [0.0; 2], shear_width: [0.0; 2] };
        let mut beam = Beam {
            view,
            near_origin: [0.0; 3],
            far_origin: [0.0; 3],
            reciprocal: [[zero; 2]; 3],
            near: [0; 3],
            first: s.splat(ends[7]),
            upper: [0.0; 2],
            lower: [0.0; 2],
        };
        let pad = 2.0 * PAD as f32 * extent;
        for k in 0..3 {
            let [least, greatest] = both(k);
            beam.reciprocal[k] = [s.splat(least), s.splat(greatest)];
            let [low, high] = [span.origin[k][0] - pad, span.origin[k][1] + pad];
            let is_negative = span.direction[k][0] < 0.0;
            [beam.near_origin[k], beam.far_origin[k]] = if is_negative { [low, high] } else { [high, low] };
            beam.near[k] = if is_negative { slabs::FAR } else { 0 };
        }
        let pad = 4.0 * PAD as f32 * extent;
        for j in 0..2 {
            let (shear, addend) = (both(3 + j), both(5 + j));
            let middle = 0.5 * (shear[0] + shear[1]);
            beam.view.shear[j] = middle;
            beam.view.shear_width[j] = (shear[1] - middle).max(middle - shear[0]);
            beam.upper[j] = pad - addend[0];
            beam.lower[j] = pad + addend[1];
        }
        beam
    }
}

impl<S: Simd, const POINT: bool> Hull<S> for Beam<S, POINT> {
    const MIXED: bool = false;
    const FROM_POINT: bool = POINT;

    #[inline(always)]
    fn view(&self) -> Option<&View> {
        POINT.then_some(&self.view)
    }

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (self.first, s.splat(limit));
        for k in 0..3 {
            let [least, greatest] = self.reciprocal[k];
            let near = s.load(slabs::row(&node.bounds[k], self.near[k]));
            let far = s.load(slabs::row(&node.bounds[k], self.near[k] ^ slabs::FAR));
            let (near, far) =
                (s.sub(near, s.splat(self.near_origin[k])), s.sub(far, s.splat(self.far_origin[k])));
            enter = s.max(s.min(s.mul(near, least), s.mul(near, greatest)), enter);
            leave = s.min(s.max(s.mul(far, least), s.mul(far, greatest)), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let View { origin, axis, shear, shear_width } = &self.view;
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
            out[0][k] = slabs::row(&node.bounds[k], self.near[k])[slot % WIDTH];
            out[1][k] = slabs::row(&node.bounds[k], self.near[k] ^ slabs::FAR)[slot % WIDTH];
            if POINT {
                out[0][k] -= self.near_origin[k];
                out[1][k] -= self.far_origin[k];
            }
        }
        out
    }
}

/// A box of the parts of short rays that can hit anything ([`Span::segments`]).
pub(crate) struct SegmentBox<S: Simd> {
    lower: [S::F; 3],
    upper: [S::F; 3],
}

impl<S: Simd> SegmentBox<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, [lower, upper]: [[f32; 3]; 2]) -> Self {
        SegmentBox {
            lower: [s.splat(lower[0]), s.splat(lower[1]), s.splat(lower[2])],
            upper: [s.splat(upper[0]), s.splat(upper[1]), s.splat(upper[2])],
        }
    }
}

impl<S: Simd> Hull<S> for SegmentBox<S> {
    const MIXED: bool = true;
    const FROM_POINT: bool = false;

    #[inline(always)]
    fn view(&self) -> Option<&View> {
        None
    }

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, _limit: f32) -> (u32, S::F) {
        let mut bits = 0xffff;
        for k in 0..3 {
            bits &= s.mask_bits(s.le(s.load(&node.bounds[k][0]), self.upper[k]));
            bits &= s.mask_bits(s.le(self.lower[k], s.load(&node.bounds[k][1])));
        }
        (bits, s.splat(f32::NEG_INFINITY))
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let mut out = s.splat_u(0);
        for k in 0..3 {
            let (above, below) = (s.lt(self.upper[k], rows[k]), s.lt(rows[k], self.lower[k]));
            out = s.or_u(out, s.select_u(above, s.splat_u(1 << (2 * k)), s.splat_u(0)));
            out = s.or_u(out, s.select_u(below, s.splat_u(2 << (2 * k)), s.splat_u(0)));
        }
        out
    }

    #[inline(always)]
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2] {
        let mut out = [[0.0; 3]; 2];
        for k in 0..3 {
            out[0][k] = node.bounds[k][0][slot % WIDTH];
            out[1][k] = node.bounds[k][1][slot % WIDTH];
        }
        out
    }
}
