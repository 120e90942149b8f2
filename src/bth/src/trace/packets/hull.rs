//! What all rays of a packet together can meet: tested before the single rays are.

use super::coherence::Span;
use super::group::Group;
use crate::layout::{WIDTH, WideNode};
use crate::simd::Simd;
use crate::trace::prepare::Frame;
use crate::trace::slabs::{self, PAD};

/// A set that contains every point at which rays of a packet can hit something.
pub(crate) trait Hull<S: Simd> {
    /// Whether the rays go into different octants.
    const MIXED: bool;
    /// The children of a node that it may meet before a depth, a bit each, and lower bounds of the depth at
    /// which any of the rays enters them.
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F);
    /// For sixteen points, given as rows of x, y and z, the sides on which they lie outside, a bit each. A
    /// triangle whose corners all have a bit in common is missed by all rays.
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U;
    /// The corners of a child's box, as [`Group::meets`] wants them.
    fn corners(&self, node: &WideNode, slot: usize) -> [[f32; 3]; 2];
}

/// Rays into one octant: interval arithmetic over their origins and directions (Wald, Boulos and Shirley, "Ray Tracing
/// Deformable Scenes Using Dynamic Bounding Volume Hierarchies", TOG 2007, cull boxes in this way).
///
/// **Boxes.** With a point c among the origins, the depth at which ray l meets a plane is (plane - c)·r + a with
/// a = (c - o)·r: an interval of r and one of a bound it from both sides. As all operations round
/// monotonically, only their roundings for each ray need a pad. With u = 2^-24 and E the sum of the greatest coordinate
/// of the object and that of all origins, they come to at most uE|r| each for the reciprocal and plane - c, 6uE|r|
/// for the product and sum (twice rounded, |plane - c| <= E, |a| <= 2E|r|), 6uE|r| for a: with the
/// half [`PAD`] = 8uE|r| of [`crate::trace::slabs`] for clamped components less than 22uE|r|; the pad is 2 · PAD = 32uE|r|.
///
/// **Triangles.** With s = d_x/d_z along one axis z for all, a point's sheared x is
/// (x - c_x) - s₀(z - c_z) + (s₀ - s)(z - c_z) + a with a = (c_x - o_x) - s(c_z - o_z): the middle of the interval of s,
/// its half width, and an interval of a. Coherent rays have |s| <= 1.25, rounded at most twice. Roundings: 6uE for the first two
/// terms, 8uE for s in the third, 20uE for a, 8uE for the sums; the pad is 64uE.
pub(crate) struct Beam<S: Simd> {
    center: [S::F; 3],
    /// Least and greatest reciprocal.
    reciprocal: [[S::F; 2]; 3],
    near_addend: [S::F; 3],
    far_addend: [S::F; 3],
    /// Row of the ends that are met first.
    near: [u32; 3],
    first: S::F,
    axis: [usize; 3],
    shear: [S::F; 2],
    shear_width: [S::F; 2],
    /// What keeps points on the upper side, and on the lower.
    upper: [S::F; 2],
    lower: [S::F; 2],
}

/// The least and the greatest value of a few vectors.
#[derive(Clone, Copy)]
struct Ends<S: Simd> {
    least: S::F,
    greatest: S::F,
}

impl<S: Simd> Ends<S> {
    #[inline(always)]
    fn none(s: S) -> Self {
        Ends { least: s.splat(f32::INFINITY), greatest: s.splat(f32::NEG_INFINITY) }
    }
    #[inline(always)]
    fn add(&mut self, s: S, low: S::F, high: S::F) {
        self.least = s.min(low, self.least);
        self.greatest = s.max(high, self.greatest);
    }
    #[inline(always)]
    fn get(&self, s: S) -> [f32; 2] {
        [s.least(self.least), -s.least(s.sub(s.splat(0.0), self.greatest))]
    }
}

impl<S: Simd> Beam<S> {
    /// Of a coherent run ([`Span::is_coherent`]).
    #[inline(always)]
    pub(crate) fn new(s: S, frame: &Frame, span: &Span, groups: &[Group<S>]) -> Self {
        let zero = s.splat(0.0);
        let extent = frame.extent(span.farthest_origin());
        let pad = s.splat(2.0 * PAD as f32 * extent);
        let (main, _) = span.main_axis();
        let axis = [(main + 1) % 3, (main + 2) % 3, main];
        let mut beam = Beam {
            center: [zero; 3],
            reciprocal: [[zero; 2]; 3],
            near_addend: [zero; 3],
            far_addend: [zero; 3],
            near: [0; 3],
            first: zero,
            axis,
            shear: [zero; 2],
            shear_width: [zero; 2],
            upper: [zero; 2],
            lower: [zero; 2],
        };
        for k in 0..3 {
            let center = s.splat(0.5 * span.origin[k][0] + 0.5 * span.origin[k][1]);
            let (mut reciprocal, mut addend) = (Ends::none(s), Ends::none(s));
            for group in groups {
                let r = group.reciprocal[k];
                let a = s.mul(s.sub(center, group.origin[k]), r);
                let pad = s.mul(pad, s.abs(r));
                reciprocal.add(s, r, r);
                addend.add(s, s.sub(a, pad), s.add(a, pad));
            }
            let (reciprocal, addend) = (reciprocal.get(s), addend.get(s));
            beam.center[k] = center;
            beam.reciprocal[k] = [s.splat(reciprocal[0]), s.splat(reciprocal[1])];
            beam.near_addend[k] = s.splat(addend[0]);
            beam.far_addend[k] = s.splat(addend[1]);
            beam.near[k] = if span.direction[k][0] < 0.0 { slabs::FAR } else { 0 };
        }
        let mut first = Ends::none(s);
        for group in groups {
            first.add(s, group.first, group.first);
        }
        beam.first = s.splat(first.get(s)[0]);
        let pad = 4.0 * PAD as f32 * extent;
        for j in 0..2 {
            let (mut shear, mut addend) = (Ends::none(s), Ends::none(s));
            for group in groups {
                let slope = match group.common {
                    // As good as the quotient, and there already.
                    Some(common) if common.0 == main => s.mul(group.shear[j], group.forward),
                    _ => s.div(group.direction[axis[j]], group.direction[main]),
                };
                let from = s.sub(beam.center[main], group.origin[main]);
                let a = s.fnma(slope, from, s.sub(beam.center[axis[j]], group.origin[axis[j]]));
                shear.add(s, slope, slope);
                addend.add(s, a, a);
            }
            let (shear, addend) = (shear.get(s), addend.get(s));
            let middle = 0.5 * (shear[0] + shear[1]);
            beam.shear[j] = s.splat(middle);
            beam.shear_width[j] = s.splat((shear[1] - middle).max(middle - shear[0]));
            beam.upper[j] = s.splat(pad - addend[0]);
            beam.lower[j] = s.splat(pad + addend[1]);
        }
        beam
    }
}

impl<S: Simd> Hull<S> for Beam<S> {
    const MIXED: bool = false;

    #[inline(always)]
    fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (self.first, s.splat(limit));
        for k in 0..3 {
            let [least, greatest] = self.reciprocal[k];
            let near = s.sub(s.load(slabs::row(&node.bounds[k], self.near[k])), self.center[k]);
            let far = s.sub(s.load(slabs::row(&node.bounds[k], self.near[k] ^ slabs::FAR)), self.center[k]);
            let (a, b) =
                (s.fma(near, least, self.near_addend[k]), s.fma(near, greatest, self.near_addend[k]));
            enter = s.max(s.min(a, b), enter);
            let (a, b) = (s.fma(far, least, self.far_addend[k]), s.fma(far, greatest, self.far_addend[k]));
            leave = s.min(s.max(a, b), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }

    #[inline(always)]
    fn sides(&self, s: S, rows: [S::F; 3]) -> S::U {
        let depth = s.sub(rows[self.axis[2]], self.center[self.axis[2]]);
        let far = s.abs(depth);
        let mut out = s.splat_u(0);
        for j in 0..2 {
            let x = s.sub(rows[self.axis[j]], self.center[self.axis[j]]);
            let x = s.fnma(self.shear[j], depth, x);
            let above = s.lt(s.fma(far, self.shear_width[j], self.upper[j]), x);
            let below = s.lt(s.fma(far, self.shear_width[j], s.add(x, self.lower[j])), s.splat(0.0));
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
