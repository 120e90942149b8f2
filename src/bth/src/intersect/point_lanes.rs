//! Conservative f32 bounds of the distance of a point to sixteen boxes or sixteen triangles at a
//! time. They only *exclude* boxes and triangles; distances are decided by
//! [`super::point_triangle`].
//!
//! Coordinates are scaled by a power of two so that the largest is about 2 to the power
//! [`TARGET_EXPONENT`], and are relative to the point after the same fused step: squares then
//! neither overflow nor, for lengths that matter, underflow.
//!
//! **Triangles.** Let A, B and C be the corners relative to the point. For any vector q, no point
//! of the triangle is nearer than min(q·A, q·B, q·C) / |q|, because the triangle lies beyond the
//! plane that is perpendicular to q at that distance. The bound is tight where q leads to the
//! closest point, so q is computed by the usual case analysis (Ericson, "Real-Time Collision
//! Detection", 5.1.5) in f32: an inaccurate q, for example of a needle, makes the bound loose, not
//! wrong. Since q leads to a point of the triangle, |q| is an upper bound.

use super::boxes::{FAR, planes};
use super::vector::dot_lanes;
use crate::simd::{LANES, Lanewise, Part, Simd};
use bth_format::layout::{IndexedLeaf, RawLeaf, WIDTH, WideNode};

const _: () = assert!(WIDTH == LANES);

/// The largest |coordinate| is scaled to between 2^27 and 2^28. Differences are then below 2^29,
/// their scalar products below 2^60, and sums of products of two of these below 2^123.
const TARGET_EXPONENT: i32 = 28;
/// Slack of a limit of squared distances, relative to the limit. It covers the roundings of the
/// bounds of boxes, 8 · 2^-24, and the four lowest bits of the keys of the stack, which hold lane
/// numbers, 2^-19.
const LIMIT_SLACK: f64 = 1.0 / (1 << 17) as f64;
/// Absolute slack of a limit, for squares that underflow: far more than 2^-149, and negligible
/// compared with the square of 2^28.
const LIMIT_FLOOR: f64 = 1.0 / (1u128 << 120) as f64;
/// 2^-19: bounds the error of q·A relative to |q| and the reach (see [`TriangleLanes::reach`]):
/// differences are off by 2^-24, products and sums by less than 2^-21.
const PROJECTION_SLACK: f32 = 1.0 / (1 << 19) as f32;
/// Where |q|² or (q·A)² is below this, a term of the bound might have underflowed: the triangle is
/// then not excluded.
const LEAST_SQUARE: f32 = 1.0 / (1u128 << 100) as f32;

/// A point for bounds of distances, and the scale of its space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LanePoint {
    /// The scaled point.
    point: [f32; 3],
    /// The power of two by which coordinates are scaled.
    scale: f32,
}

impl LanePoint {
    /// For a finite point, and boxes and triangles whose |coordinates| do not exceed `farthest`.
    #[inline(always)]
    pub(crate) fn new(point: [f32; 3], farthest: f32) -> LanePoint {
        let greatest = point[0].abs().max(point[1].abs()).max(point[2].abs()).max(farthest);
        let exponent = (greatest.to_bits() >> 23) as i32 - 126;
        let scale = f32::from_bits(((TARGET_EXPONENT - exponent).min(127) + 127) as u32 * (1 << 23));
        LanePoint { point: [point[0] * scale, point[1] * scale, point[2] * scale], scale }
    }

    /// Upper bound in scaled space of a squared distance.
    #[inline(always)]
    pub(crate) fn limit(&self, squared: f64) -> f32 {
        let scale = f64::from(self.scale);
        let limit = squared * (scale * scale);
        // Not infinite: the keys of empty slots may be.
        ((limit + limit * LIMIT_SLACK + LIMIT_FLOOR) as f32).min(f32::MAX)
    }

    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, s: S) -> PointLanes<S> {
        let [x, y, z] = self.point;
        PointLanes {
            point: [s.splat(x), s.splat(y), s.splat(z)],
            scale: s.splat(self.scale),
            origin: self.point,
        }
    }
}

/// [`LanePoint`] broadcast to lanes.
#[derive(Clone, Copy)]
pub(crate) struct PointLanes<S: Simd> {
    point: [S::F; 3],
    scale: S::F,
    origin: [f32; 3],
}

/// [`PointLanes::children`] as a part of kernels.
struct NearChildren<'a, S: Simd> {
    point: &'a PointLanes<S>,
    node: &'a WideNode,
    limit: f32,
}

impl<S: Simd> Part<S> for NearChildren<'_, S> {
    type Output = (u32, S::F);
    #[inline(always)]
    fn run(self, s: S) -> (u32, S::F) {
        let NearChildren { point, node, limit } = self;
        let mut squared = s.splat(0.0);
        for k in 0..3 {
            let below = s.fma(planes(s, node, k, 0), point.scale, s.splat(-point.origin[k]));
            let above = s.fnma(planes(s, node, k, FAR), point.scale, point.point[k]);
            let outside = s.max(s.max(below, above), s.splat(0.0));
            squared = s.fma(outside, outside, squared);
        }
        (s.mask_bits(s.le(squared, s.splat(limit))), squared)
    }
}

impl<S: Simd> PointLanes<S> {
    /// The children of a node that may contain a point whose squared distance, scaled, is at most
    /// `limit`, as bits, and lower bounds of the scaled squared distances. Empty slots may be among
    /// them.
    #[inline(always)]
    pub(crate) fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        NearChildren { point: self, node, limit }.inline_or_call(s)
    }

    /// Scaled coordinates relative to the point.
    #[inline(always)]
    fn relative(&self, s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
        let mut out = [s.splat(0.0); 3];
        for k in 0..3 {
            out[k] = s.fma(s.load(&rows[k]), self.scale, s.splat(-self.origin[k]));
        }
        out
    }
}

/// The triangles of a leaf for bounds of distances.
pub(crate) trait CornerLanes {
    /// The corners relative to a point, scaled: `[corner][axis]`.
    fn relative<S: Simd>(&self, s: S, point: &PointLanes<S>) -> [[S::F; 3]; 3];
    /// Returns true if all triangles certainly have a squared distance above `limit`, by the bound
    /// for one q for all of them. Most leaves whose boxes are near enough are excluded so, in a
    /// tenth of the time that [`TriangleLanes`] takes.
    fn is_beyond<S: Simd>(&self, s: S, point: &PointLanes<S>, limit: f32) -> bool;
}

/// The bounds for a q that leads to one of the points, given all points of a leaf.
#[inline(always)]
fn common_bounds<S: Simd>(s: S, points: &[[S::F; 3]]) -> TriangleLanes<S> {
    let zero = s.splat(0.0);
    let (mut q, mut square) = ([zero; 3], zero);
    for k in 0..3 {
        q[k] = if S::PIECES == 1 {
            s.lookup(points[0][k], s.splat_u(0))
        } else {
            // A lookup in several registers takes longer than a store and a load.
            let mut lanes = [0.0; LANES];
            s.store(points[0][k], &mut lanes);
            s.splat(lanes[0])
        };
        square = s.fma(q[k], q[k], square);
    }
    let (mut support, mut reach) = (square, zero);
    for point in points {
        support = s.min(support, dot_lanes(s, q, *point));
        reach = s.max(reach, s.add(s.add(s.abs(point[0]), s.abs(point[1])), s.abs(point[2])));
    }
    TriangleLanes { square, support, reach }
}

impl CornerLanes for IndexedLeaf {
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, point: &PointLanes<S>) -> [[S::F; 3]; 3] {
        let vertex = point.relative(s, &self.vertex);
        let mut corners = [vertex; 3];
        if S::PIECES > 1 {
            let mut rows = [[0.0; 4]; WIDTH];
            s.store_rows(vertex, &mut rows);
            for c in 0..3 {
                corners[c] = s.lookup_rows(&rows, &self.corner[c]);
            }
            return corners;
        }
        for c in 0..3 {
            let at = s.load_bytes(&self.corner[c]);
            for k in 0..3 {
                corners[c][k] = s.lookup(vertex[k], at);
            }
        }
        corners
    }
    #[inline(always)]
    fn is_beyond<S: Simd>(&self, s: S, point: &PointLanes<S>, limit: f32) -> bool {
        let vertex = point.relative(s, &self.vertex);
        common_bounds(s, &[vertex]).candidates(s, u32::MAX >> LANES, limit) == 0
    }
}

impl CornerLanes for RawLeaf {
    #[inline(always)]
    fn relative<S: Simd>(&self, s: S, point: &PointLanes<S>) -> [[S::F; 3]; 3] {
        [
            point.relative(s, &self.corner[0]),
            point.relative(s, &self.corner[1]),
            point.relative(s, &self.corner[2]),
        ]
    }
    #[inline(always)]
    fn is_beyond<S: Simd>(&self, s: S, point: &PointLanes<S>, limit: f32) -> bool {
        common_bounds(s, &self.relative(s, point)).candidates(s, u32::MAX >> LANES, limit) == 0
    }
}

/// Bounds of the distances of sixteen triangles, scaled.
pub(crate) struct TriangleLanes<S: Lanewise> {
    /// The vector q of the module's documentation, squared.
    square: S::F,
    /// min(q·A, q·B, q·C).
    support: S::F,
    /// Bound of the length of A, B and C.
    reach: S::F,
}

impl<L: Lanewise> TriangleLanes<L> {
    /// [`TriangleLanes::new`] for the triangles of a piece.
    #[inline(always)]
    fn of_piece(s: L, corners: &[[L::F; 3]; 3]) -> Self {
        let [a, b, c] = *corners;
        let zero = s.splat(0.0);
        let (mut ab, mut ac, mut reach) = ([zero; 3], [zero; 3], zero);
        for k in 0..3 {
            ab[k] = s.sub(b[k], a[k]);
            ac[k] = s.sub(c[k], a[k]);
            reach = s.add(reach, s.max_abs(s.max_abs(a[k], b[k]), c[k]));
        }
        let q = closest(s, corners, ab, ac);
        let support = s.min(s.min(dot_lanes(s, q, a), dot_lanes(s, q, b)), dot_lanes(s, q, c));
        TriangleLanes { square: dot_lanes(s, q, q), support, reach }
    }
}

impl<S: Simd> TriangleLanes<S> {
    /// Computes the bounds of triangles, given their corners relative to the point.
    #[inline(always)]
    pub(crate) fn new(s: S, corners: &[[S::F; 3]; 3]) -> Self {
        let zero = s.splat(0.0);
        let mut all = TriangleLanes { square: zero, support: zero, reach: zero };
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let corners = corners.each_ref().map(|corner| corner.each_ref().map(|row| S::pick(p, row)));
            let bounds = TriangleLanes::of_piece(p, &corners);
            S::put(p, &mut all.square, bounds.square);
            S::put(p, &mut all.support, bounds.support);
            S::put(p, &mut all.reach, bounds.reach);
        }
        all
    }

    /// Upper bound of the smallest squared distance of the triangles of `lanes`, at most
    /// `f32::MAX`. The point to which q leads is off by less than 2^-20 of the reach, ε; for any η,
    /// (|q| + ε)² <= (1 + η) |q|² + (1 + 1/η) ε². Here η is 2^-10.
    #[inline(always)]
    pub(crate) fn least_upper_bound(&self, s: S, lanes: u32) -> f32 {
        const SQUARE: f32 = 1.0 + 1.0 / (1 << 9) as f32;
        const REACH: f32 = 1.0 / (1 << 29) as f32;
        let error = s.mul(s.mul(self.reach, self.reach), s.splat(REACH));
        let bound = s.fma(self.square, s.splat(SQUARE), error);
        // The second operand replaces NaN.
        let bound = s.min(bound, s.splat(f32::MAX));
        s.least(s.select(s.mask(lanes), bound, s.splat(f32::MAX)))
    }

    /// The triangles of `lanes` that may have a squared distance of at most `limit`, as bits.
    #[inline(always)]
    pub(crate) fn candidates(&self, s: S, lanes: u32, limit: f32) -> u32 {
        // The square root is correctly rounded on all machines.
        let distance = limit.sqrt() * (1.0 + PROJECTION_SLACK);
        let bound = s.fma(self.reach, s.splat(PROJECTION_SLACK), s.splat(distance));
        let support = s.mul(self.support, self.support);
        let beyond = s.lt(s.mul(s.mul(bound, bound), self.square), support);
        let beyond = s.and(beyond, s.lt(s.splat(0.0), self.support));
        let beyond = s.and(beyond, s.lt(s.splat(LEAST_SQUARE), s.min(support, self.square)));
        lanes & !s.mask_bits(beyond)
    }
}

/// For each triangle a vector from the point to a point of the triangle, which is near the closest
/// one unless rounding prevails.
#[inline(always)]
fn closest<S: Lanewise>(s: S, corners: &[[S::F; 3]; 3], ab: [S::F; 3], ac: [S::F; 3]) -> [S::F; 3] {
    let [a, b, c] = *corners;
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    // Scalar products of the edges with the vectors from the corners to the point, with the sign
    // changed.
    let (d1, d2) = (dot_lanes(s, ab, a), dot_lanes(s, ac, a));
    let (d3, d4) = (dot_lanes(s, ab, b), dot_lanes(s, ac, b));
    let (d5, d6) = (dot_lanes(s, ab, c), dot_lanes(s, ac, c));
    let va = s.fnma(d5, d4, s.mul(d3, d6));
    let vb = s.fnma(d1, d6, s.mul(d5, d2));
    let vc = s.fnma(d3, d2, s.mul(d1, d4));
    // Numerators of the weights of b and c, and their denominator: at first as for the face.
    let (mut v, mut w, mut whole) = (vb, vc, s.add(s.add(va, vb), vc));
    // The edge bc, whose weights are (d4 - d3) and (d5 - d6) with the signs of Ericson's.
    let (from_b, from_c) = (s.sub(d3, d4), s.sub(d6, d5));
    let on = s.and(s.le(va, zero), s.and(s.lt(zero, from_b), s.lt(zero, from_c)));
    v = s.select(on, from_c, v);
    w = s.select(on, from_b, w);
    whole = s.select(on, s.add(from_b, from_c), whole);
    // The edges ac and ab.
    let on = s.and(s.le(vb, zero), s.and(s.lt(d2, zero), s.lt(zero, d6)));
    v = s.select(on, zero, v);
    w = s.select(on, d2, w);
    whole = s.select(on, s.sub(d2, d6), whole);
    let on = s.and(s.le(vc, zero), s.and(s.lt(d1, zero), s.lt(zero, d3)));
    v = s.select(on, d1, v);
    w = s.select(on, zero, w);
    whole = s.select(on, s.sub(d1, d3), whole);
    // The corners.
    let at_a = s.and(s.le(zero, d1), s.le(zero, d2));
    let at_b = s.and(s.le(d3, zero), s.le(d3, d4));
    let at_c = s.and(s.le(d6, zero), s.le(d6, d5));
    let inverse = s.div(one, whole);
    (v, w) = (s.mul(v, inverse), s.mul(w, inverse));
    v = s.select(at_b, one, s.select(s.or(at_a, at_c), zero, v));
    w = s.select(at_c, one, s.select(s.or(at_a, at_b), zero, w));
    // Limited to the triangle; the second operands replace NaN.
    v = s.min(s.max(v, zero), one);
    w = s.min(s.max(w, zero), s.sub(one, v));
    let mut q = a;
    for k in 0..3 {
        q[k] = s.fma(w, ac[k], s.fma(v, ab[k], a[k]));
    }
    q
}
