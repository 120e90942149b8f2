//! Edge functions of projected triangles in f32 lanes, with bounds of their errors: which triangles
//! a line certainly misses, and which it certainly hits at which depth.
//!
//! The weight of a corner is the edge function of the opposite edge: twice the area of the triangle
//! that this edge forms with the origin of the plane of projection, through which the line passes.
//!
//! **Error of a weight.** Let u = 2^-24. For the corners of one triangle, let M >= |x| + |y| as
//! projected, and let r be their largest |coordinate| relative to the ray's origin. Differences are
//! off by ur, the shear by a factor 1±2u, its product with the depth by the same factor and by the
//! error of the depth (|shear| <= 1), and the last sum by 2ur: sheared coordinates are off by less
//! than δ = 8ur. A cross product of two points is off by 2δM + 2δ² because of its points and by
//! 3uM² <= δM because of the roundings of the product, together by less than 4δ(M + δ). Products
//! that underflow add at most the smallest normal number. The filter of single rays takes for r the
//! distance (maximum norm) to the farthest corner of the object's box, so that 8δ and 4δ² are
//! constants of the ray, and for M twice the largest |x| or |y|; where that leaves a pair
//! undecided, it takes the bound of packets. Packets take r = M + |depth|, which is tighter and was
//! measured to be faster.
//!
//! **Error of a depth.** A change of the three weights by e each changes the depth by at most
//! 3e·range/(|sum| - 3e), where `range` is the range of the corners' depths, and never moves it out
//! of that range. The roundings of the depth itself stay below 8u of the largest |depth|. An error
//! of a corner moves the depth by at most as much. It adds to the errors of weights, too.

use crate::simd::Lanewise;

/// 8u = 2^-21: bounds the error δ of a sheared coordinate relative to the reach r.
pub(crate) const F32_PROJECTION_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// 8δ/r, a little enlarged to cover the roundings of the bounds that are computed from it.
pub(crate) const ERROR_SLOPE: f32 = 8.01 * F32_PROJECTION_ERROR as f32;
/// Slack of depths relative to the largest |depth|: twice the bound of their roundings.
const DEPTH_SLACK: f32 = 16.0 / (1 << 24) as f32;

/// Projected corners of sixteen triangles: `[corner][x, y, depth]`.
pub(crate) type Corners<S> = [[<S as Lanewise>::F; 3]; 3];

/// Twice the signed area of the triangle (origin, p, q) in the plane of projection.
#[inline(always)]
pub(crate) fn cross<S: Lanewise>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.fnma(p[1], q[0], s.mul(p[0], q[1]))
}

/// |x| + |y| of a projected point.
#[inline(always)]
pub(crate) fn l1_norm<S: Lanewise>(s: S, p: [S::F; 3]) -> S::F {
    s.add(s.abs(p[0]), s.abs(p[1]))
}

/// Result of the filter for sixteen pairs of a line and a triangle.
#[derive(Clone, Copy)]
pub(crate) struct FilteredTriangles<S: Lanewise> {
    /// Pairs that certainly miss, or whose hit certainly lies out of the range of depths.
    pub(crate) excluded: S::M,
    /// Pairs that certainly hit, within the range of depths or outside of it.
    pub(crate) certain: S::M,
    /// Lower bounds of the depths of the hits.
    pub(crate) nearest: S::F,
    /// Upper bounds of the depths of the hits.
    pub(crate) farthest: S::F,
}

/// `error_slope` and `error_floor` of a
/// [`TriangleFilter`](crate::intersect::filter::TriangleFilter), for points whose coordinates
/// relative to the origin do not exceed `reach`.
#[inline(always)]
pub(crate) fn error_coefficients(reach: f32) -> [f32; 2] {
    let slope = reach * ERROR_SLOPE;
    [slope, slope * slope + f32::MIN_POSITIVE]
}

/// Bound of the error of weights, 4δ(M + δ), from the largest |x| + |y| (`l1_norm`) and |depth| of
/// the projected corners. Where the ray's exact origin is another than that in f32,
/// `greatest_depth` is larger by the
/// [`origin_reach`](bth_format::object::ObjectBounds::origin_reach) of the bounds for which the ray
/// was prepared.
#[inline(always)]
pub(crate) fn error<S: Lanewise>(s: S, l1_norm: S::F, greatest_depth: S::F, floor: S::F) -> S::F {
    let reach = s.add(l1_norm, greatest_depth);
    const DELTA: f32 = F32_PROJECTION_ERROR as f32;
    // A little more than 4, to cover the roundings of δ itself.
    s.fma(s.mul(reach, s.splat(4.001 * DELTA)), s.fma(reach, s.splat(DELTA), l1_norm), floor)
}

/// Like [`error`], from the projected corners.
#[inline(always)]
pub(crate) fn error_of<S: Lanewise>(s: S, [a, b, c]: &Corners<S>, origin_reach: S::F, floor: S::F) -> S::F {
    let norm = s.max(s.max(l1_norm(s, *a), l1_norm(s, *b)), l1_norm(s, *c));
    let depth = s.max(s.max_abs(a[2], b[2]), s.abs(c[2]));
    error(s, norm, s.add(depth, origin_reach), floor)
}

/// Sides on which sixteen lines pass the edges of their triangles.
#[derive(Clone, Copy)]
pub(super) struct Sides<S: Lanewise> {
    /// Weights of the three corners: twice the signed areas opposite to them, not normalized.
    weight: [S::F; 3],
    /// Bound of the error of the weights.
    pub(super) error: S::F,
    /// Pairs that certainly miss.
    pub(super) missed: S::M,
    /// Pairs that certainly hit, at whatever depth.
    pub(super) certain: S::M,
}

/// Tests sixteen triangles for hits in a range of depths. `error` bounds the error of the weights,
/// see the head of this file, and `corner_error` is taken from the
/// [bounds](bth_format::object::ObjectBounds::corner_error) of the object.
#[inline(always)]
pub(crate) fn test_triangles<S: Lanewise>(
    s: S,
    corners: Corners<S>,
    error: S::F,
    range: [S::F; 2],
    corner_error: f32,
) -> FilteredTriangles<S> {
    sides(s, &corners, error).bound_depths(s, &corners, range, corner_error)
}

/// The sides on which lines pass the edges of triangles; `error` bounds the error of the weights.
#[inline(always)]
pub(super) fn sides<S: Lanewise>(s: S, &[a, b, c]: &Corners<S>, error: S::F) -> Sides<S> {
    let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
    Sides::of(s, weight, error)
}

impl<S: Lanewise> Sides<S> {
    #[inline(always)]
    fn of(s: S, weight: [S::F; 3], error: S::F) -> Self {
        let minus_error = s.sub(s.splat(0.0), error);
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
        // Comparisons with NaN are false, so a pair with NaN is neither missed nor certain and
        // remains a candidate.
        let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
        let certain = s.or(s.lt(error, least), s.lt(greatest, minus_error));
        Sides { weight, error, missed, certain }
    }

    /// The same sides with another bound of the errors.
    #[inline(always)]
    pub(super) fn with_error(self, s: S, error: S::F) -> Self {
        Sides::of(s, self.weight, error)
    }

    /// Bounds the depths of the hits and compares them with the range from `first` to `limit`.
    #[inline(always)]
    pub(super) fn bound_depths(
        self,
        s: S,
        [a, b, c]: &Corners<S>,
        [first, limit]: [S::F; 2],
        corner_error: f32,
    ) -> FilteredTriangles<S> {
        let Sides { weight, error, missed, certain } = self;
        let least_depth = s.min(s.min(a[2], b[2]), c[2]);
        let greatest_depth = s.max(s.max(a[2], b[2]), c[2]);
        let sum = s.add(s.add(weight[0], weight[1]), weight[2]);
        // The weights are normalized before they are multiplied with depths: products of a small
        // triangle's own weights would underflow.
        let inverse_sum = s.div(s.splat(1.0), sum);
        let barycentric =
            [s.mul(weight[0], inverse_sum), s.mul(weight[1], inverse_sum), s.mul(weight[2], inverse_sum)];
        let range = s.sub(greatest_depth, least_depth);
        // 3e·range/(|sum| - 3e) <= 6e·range/|sum| where |sum| >= 6e. Elsewhere this is at least the
        // range and is clamped to it.
        let shift = s.mul(s.mul(error, s.splat(6.0)), s.mul(range, s.abs(inverse_sum)));
        let shift = s.min(shift, range);
        let depth = s.fma(barycentric[2], c[2], s.fma(barycentric[1], b[2], s.mul(barycentric[0], a[2])));
        let slack =
            s.fma(s.max_abs(least_depth, greatest_depth), s.splat(DEPTH_SLACK), s.splat(corner_error));
        let nearest = s.sub(s.select(certain, s.sub(depth, shift), least_depth), slack);
        let farthest = s.add(s.select(certain, s.add(depth, shift), greatest_depth), slack);
        let out = s.or(s.lt(farthest, first), s.lt(limit, nearest));
        FilteredTriangles { excluded: s.or(out, missed), certain, nearest, farthest }
    }
}
