//! Conservative f32 filter of the triangles of a leaf: it excludes those that the ray certainly misses.
//!
//! It is the projection of [`crate::intersect::line`] in f32, for sixteen triangles at a time. Every triangle that
//! `Line::intersection` could accept remains a candidate, and every triangle that is called sure is accepted by `Line::intersection`.
//! The other candidates are decided in f64, so the result of a query does not depend on the instruction set.
//!
//! **Error of a weight.** Let u = 2^-24. For the corners of one triangle, let M >= |x| + |y| as projected, and let r be their
//! greatest |coordinate| relative to the ray's origin. Differences are off by ur, the shear by a factor 1±2u, its product with
//! the depth by the same factor and by the error of the depth (|shear| <= 1), and the last sum by 2ur: sheared coordinates are
//! off by less than δ = 8ur. A cross product of two points is off by 2δM + 2δ² because of its points and by 3uM² <= δM because
//! of its own roundings, together by less than 4δ(M + δ). Products that underflow add at most the least normal number. The
//! filter takes for r the distance (maximum norm) to the farthest corner of the object's box, so that 8δ and 4δ² are constants
//! of the ray, and for M twice the greatest |x| or |y|. Packets take r = M + |depth|, which is tighter and was measured to be
//! faster.
//!
//! **Error of a depth.** A change of the three weights by e each changes the depth by at most 3e·range/(|sum| - 3e), where
//! `range` is the range of the corners' depths, and never moves it out of that range. The roundings of the depth itself stay
//! below 8u of the greatest |depth|.

use crate::intersect::boxes::RaySlabs;
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{LANES, Lanewise, Part, Simd, lanes_of_piece};
use bth_format::layout::{IndexedLeaf, Object, RawLeaf, WIDTH};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

const _: () = assert!(WIDTH == LANES);

/// 8u = 2^-21: bounds the error δ of a sheared coordinate relative to the reach r.
pub(crate) const F32_PROJECTION_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// 8δ/r, a little enlarged to cover the roundings of the bounds that are computed from it.
pub(crate) const ERROR_SLOPE: f32 = 8.01 * F32_PROJECTION_ERROR as f32;
/// From this reach on, products of weights and depths could overflow: all triangles are candidates then.
const MAX_REACH: f64 = (1u64 << 40) as f64;
/// Slack of depths relative to the greatest |depth|: twice the bound of their roundings.
const DEPTH_SLACK: f32 = 16.0 / (1 << 24) as f32;

/// Per-ray constants of the filter, in object space. Depths are t times the greatest |component| of the direction, as in
/// [`RaySlabs`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct TriangleFilter {
    /// The two axes of the plane of projection, and the axis of the direction's greatest |component|.
    pub(crate) axis: [u32; 3],
    /// Constant part of the bound of a weight's error; infinite where products may overflow.
    pub(crate) error_floor: f32,
    /// The ray's origin along the two axes of the plane.
    pub(crate) origin: [f32; 2],
    /// Change of the plane's coordinates along the ray per unit of depth.
    pub(crate) shear: [f32; 2],
    /// 1 or -1, the sign of the direction along the third axis. The depth of a coordinate z is `forward * z + start`.
    pub(crate) forward: f32,
    /// Depth of the coordinate 0 along the third axis. It is exact, as is `forward`.
    pub(crate) start: f32,
    /// Least depth from which a hit certainly lies in the ray's range.
    pub(crate) first: f32,
    /// Greatest depth up to which a hit certainly lies in the ray's range.
    pub(crate) last: f32,
    /// Growth of the bound of a weight's error with the greatest |x| or |y| of the projected corners.
    pub(crate) error_slope: f32,
}

/// Triangles of a leaf that the ray may hit: in the bit sets, bit i stands for triangle i of the leaf.
#[derive(Clone, Copy)]
pub(crate) struct Candidates<S: Simd> {
    /// Triangles that are not certainly missed.
    pub(crate) maybe: u32,
    /// Subset of `maybe`: triangles that are certainly hit within the ray's range.
    pub(crate) sure: u32,
    /// Lower bounds of the depths of the hits.
    pub(crate) nearest: S::F,
    /// Upper bounds of the depths of the hits.
    pub(crate) farthest: S::F,
}

/// A triangle of a leaf that is certainly hit, and certainly nearer than the others of its leaf.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Certain {
    /// Index in the leaf.
    pub(crate) triangle: usize,
    /// Lower bound of the depth of the hit.
    pub(crate) near: f32,
    /// Upper bound of the depth of the hit.
    pub(crate) far: f32,
}

impl<S: Simd> Candidates<S> {
    /// The triangles that may be the nearest hit, as bits, and the nearest hit if it is certain. `maybe` must not be empty.
    #[inline(always)]
    pub(crate) fn nearest_candidates(&self, s: S) -> (u32, Option<Certain>) {
        let &Candidates { mut maybe, sure, nearest, farthest } = self;
        if maybe & (maybe - 1) != 0 && sure != 0 {
            let least = s.least(s.select(s.mask(sure), farthest, s.splat(f32::MAX)));
            maybe &= s.mask_bits(s.le(nearest, s.splat(least)));
        }
        if maybe & (maybe - 1) != 0 || maybe & sure == 0 {
            return (maybe, None);
        }
        let (mut near, mut far) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(nearest, &mut near);
        s.store(farthest, &mut far);
        let triangle = maybe.trailing_zeros() as usize % WIDTH;
        (maybe, Some(Certain { triangle, near: near[triangle], far: far[triangle] }))
    }
}

/// Projected corners of sixteen triangles: `[corner][x, y, depth]`.
pub(crate) type Corners<S> = [[<S as Lanewise>::F; 3]; 3];

/// Projected points of a leaf: x, y and depth of each.
pub(crate) type PointRows = [[f32; 4]; WIDTH];

/// The triangles of a leaf, in either of the leaf's record formats. Indices of triangles are taken modulo [`WIDTH`].
pub(crate) trait TriangleBlock {
    /// Index of the leaf's first triangle in the object's leaf order.
    fn first(&self) -> u32;
    /// Number of triangles; above [`WIDTH`] only in a file that was not checked.
    fn triangles(&self) -> u32;
    /// Corners of a triangle: `[corner][axis]`, object space.
    #[inline(always)]
    fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        // Loops, because `map` over the rows would copy them first.
        let mut out = [[0.0; 3]; 3];
        for c in 0..3 {
            for k in 0..3 {
                out[c][k] = self.coordinate(triangle, c, k);
            }
        }
        out
    }
    /// One coordinate of a corner.
    fn coordinate(&self, triangle: usize, corner: usize, axis: usize) -> f32;
    /// Projects the corners of all triangles.
    fn project<S: Simd>(&self, s: S, filter: &TriangleFilter) -> Corners<S>;
    /// Projects the points of the leaf, if its triangles refer to them by index.
    fn project_points<S: Simd>(&self, s: S, filter: &TriangleFilter) -> Option<PointRows>;
    /// As [`Self::project`], for a piece of the triangles, given the projected points.
    fn project_piece<L: Lanewise>(
        &self,
        l: L,
        filter: &TriangleFilter,
        points: Option<&PointRows>,
    ) -> Corners<L>;
}

/// For each lane the point whose index stands in `row`, out of sixteen points.
#[inline(always)]
fn lookup_points<S: Simd>(s: S, [x, y, depth]: [S::F; 3], row: &[u8; WIDTH]) -> [S::F; 3] {
    let at = s.load_bytes(row);
    [s.lookup(x, at), s.lookup(y, at), s.lookup(depth, at)]
}

/// Twice the signed area of the triangle (origin, p, q) in the plane of projection.
#[inline(always)]
pub(crate) fn cross<S: Lanewise>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.fnma(p[1], q[0], s.mul(p[0], q[1]))
}

/// The greatest |x| or |y| of the three corners.
#[inline(always)]
fn greatest_coordinate<S: Lanewise>(s: S, [a, b, c]: &Corners<S>) -> S::F {
    s.max(s.max(s.max_abs(a[0], a[1]), s.max_abs(b[0], b[1])), s.max_abs(c[0], c[1]))
}

/// |x| + |y| of a projected point.
#[inline(always)]
pub(crate) fn l1_norm<S: Lanewise>(s: S, p: [S::F; 3]) -> S::F {
    s.add(s.abs(p[0]), s.abs(p[1]))
}

impl TriangleBlock for IndexedLeaf {
    #[inline(always)]
    fn first(&self) -> u32 {
        self.first
    }
    #[inline(always)]
    fn triangles(&self) -> u32 {
        self.triangles
    }
    #[inline(always)]
    fn coordinate(&self, triangle: usize, corner: usize, axis: usize) -> f32 {
        self.vertex[axis][usize::from(self.corner[corner][triangle % WIDTH]) % WIDTH]
    }
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, filter: &TriangleFilter) -> Corners<S> {
        if S::PIECES > 1 {
            let mut rows = [[0.0; 4]; WIDTH];
            s.store_rows(filter.project(s, &self.vertex), &mut rows);
            return self.project_piece(s, filter, Some(&rows));
        }
        let points = filter.project(s, &self.vertex);
        [
            lookup_points(s, points, &self.corner[0]),
            lookup_points(s, points, &self.corner[1]),
            lookup_points(s, points, &self.corner[2]),
        ]
    }
    #[inline(always)]
    fn project_points<S: Simd>(&self, s: S, filter: &TriangleFilter) -> Option<PointRows> {
        let mut rows = [[0.0; 4]; WIDTH];
        for i in 0..S::PIECES {
            // A piece without a vertex is left out.
            if lanes_of_piece::<S>(i).trailing_zeros() >= self.vertices {
                break;
            }
            let piece = s.piece(i);
            piece.store_rows(filter.project(piece, &self.vertex), &mut rows);
        }
        Some(rows)
    }
    #[inline(always)]
    fn project_piece<L: Lanewise>(&self, l: L, _: &TriangleFilter, points: Option<&PointRows>) -> Corners<L> {
        let points = points.expect("the points of this leaf were projected");
        [
            l.lookup_rows(points, &self.corner[0]),
            l.lookup_rows(points, &self.corner[1]),
            l.lookup_rows(points, &self.corner[2]),
        ]
    }
}

impl TriangleBlock for RawLeaf {
    #[inline(always)]
    fn first(&self) -> u32 {
        self.first
    }
    #[inline(always)]
    fn triangles(&self) -> u32 {
        self.triangles
    }
    #[inline(always)]
    fn coordinate(&self, triangle: usize, corner: usize, axis: usize) -> f32 {
        self.corner[corner][axis][triangle % WIDTH]
    }
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, filter: &TriangleFilter) -> Corners<S> {
        [
            filter.project(s, &self.corner[0]),
            filter.project(s, &self.corner[1]),
            filter.project(s, &self.corner[2]),
        ]
    }
    #[inline(always)]
    fn project_points<S: Simd>(&self, _: S, _: &TriangleFilter) -> Option<PointRows> {
        None
    }
    #[inline(always)]
    fn project_piece<L: Lanewise>(&self, l: L, filter: &TriangleFilter, _: Option<&PointRows>) -> Corners<L> {
        [
            filter.project(l, &self.corner[0]),
            filter.project(l, &self.corner[1]),
            filter.project(l, &self.corner[2]),
        ]
    }
}

impl TriangleFilter {
    /// Computes the constants in f64, for any ray that has a line.
    pub(crate) fn new(ray: &Ray, line: &Line, slabs: &RaySlabs, object: &Object) -> TriangleFilter {
        let reach = line.reach_of_box(object.lower, object.upper);
        let [first, last] = slabs.certain_range(ray);
        let forward = 1f32.copysign(line.direction[line.axis[2]] as f32);
        let [error_slope, error_floor] =
            if reach < MAX_REACH { error_coefficients(reach as f32) } else { [0.0, f32::INFINITY] };
        TriangleFilter {
            axis: line.axis.map(|k| k as u32),
            error_floor,
            origin: [ray.origin[line.axis[0]], ray.origin[line.axis[1]]],
            shear: line.shear.map(|s| s as f32 * forward),
            forward,
            start: -forward * ray.origin[line.axis[2]],
            first,
            last,
            error_slope,
        }
    }

    /// Projects sixteen points, given as rows of x, y and z, to x, y and depth.
    #[inline(always)]
    fn project<S: Lanewise>(&self, s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
        let depth = s.fma(s.load(&rows[self.axis[2] as usize]), s.splat(self.forward), s.splat(self.start));
        let x = s.sub(s.load(&rows[self.axis[0] as usize]), s.splat(self.origin[0]));
        let y = s.sub(s.load(&rows[self.axis[1] as usize]), s.splat(self.origin[1]));
        [s.fnma(s.splat(self.shear[0]), depth, x), s.fnma(s.splat(self.shear[1]), depth, y), depth]
    }

    /// The triangles of a leaf that may be hit at a depth between `first` and `limit`.
    #[inline(always)]
    pub(crate) fn candidates<S: Simd, B: TriangleBlock>(
        &self,
        s: S,
        block: &B,
        first: f32,
        limit: f32,
    ) -> Candidates<S> {
        CandidatesOf { filter: self, block, first, limit }.inline_or_call(s)
    }

    #[inline(always)]
    fn candidates_inlined<S: Simd, B: TriangleBlock>(
        &self,
        s: S,
        block: &B,
        first: f32,
        limit: f32,
    ) -> Candidates<S> {
        let corners = block.project(s, self);
        let sides = self.sides(s, &corners);
        let (valid, error) = (valid_triangles(block), sides.error);
        // In most leaves that a ray enters, all triangles are missed: then depths need not be computed.
        if valid & !s.mask_bits(sides.missed) == 0 {
            return Candidates { maybe: 0, sure: 0, nearest: error, farthest: error };
        }
        let tested = self.bound_depths(s, sides, &corners, (first, limit));
        let maybe = valid & !s.mask_bits(tested.excluded);
        let sure = maybe & s.mask_bits(tested.certain);
        Candidates { maybe, sure, nearest: tested.nearest, farthest: tested.farthest }
    }

    /// The sides on which the ray passes the edges of triangles.
    #[inline(always)]
    fn sides<S: Lanewise>(&self, s: S, corners: &Corners<S>) -> Sides<S> {
        let greatest = greatest_coordinate(s, corners);
        let error = s.fma(greatest, s.splat(self.error_slope), s.splat(self.error_floor));
        sides(s, corners, error)
    }

    /// As [`Sides::bound_depths`]; certain are only hits within the ray's range.
    #[inline(always)]
    fn bound_depths<S: Lanewise>(
        &self,
        s: S,
        sides: Sides<S>,
        corners: &Corners<S>,
        (first, limit): (f32, f32),
    ) -> FilteredTriangles<S> {
        let tested = sides.bound_depths(s, corners, s.splat(first), s.splat(limit));
        let in_range =
            s.and(s.le(s.splat(self.first), tested.nearest), s.le(tested.farthest, s.splat(self.last)));
        FilteredTriangles { certain: s.and(tested.certain, in_range), ..tested }
    }
}

/// [`TriangleFilter::candidates`] as a part of kernels.
struct CandidatesOf<'a, B> {
    filter: &'a TriangleFilter,
    block: &'a B,
    first: f32,
    limit: f32,
}

impl<S: Simd, B: TriangleBlock> Part<S> for CandidatesOf<'_, B> {
    type Output = Candidates<S>;
    #[inline(always)]
    fn run(self, s: S) -> Candidates<S> {
        let CandidatesOf { filter, block, first, limit } = self;
        if S::PIECES == 1 {
            return filter.candidates_inlined(s, block, first, limit);
        }
        let valid = valid_triangles(block);
        let (mut maybe, mut sure, mut nearest, mut farthest) = (0, 0, [0.0; LANES], [0.0; LANES]);
        let points = block.project_points(s, filter);
        for i in 0..S::PIECES {
            let (valid, p) = (valid & lanes_of_piece::<S>(i), s.piece(i));
            if valid == 0 {
                break;
            }
            let corners = block.project_piece(p, filter, points.as_ref());
            let sides = filter.sides(p, &corners);
            if valid & !p.mask_bits(sides.missed) == 0 {
                continue;
            }
            let tested = filter.bound_depths(p, sides, &corners, (first, limit));
            maybe |= valid & !p.mask_bits(tested.excluded);
            sure |= valid & p.mask_bits(tested.certain);
            p.store(tested.nearest, &mut nearest);
            p.store(tested.farthest, &mut farthest);
        }
        Candidates { maybe, sure: sure & maybe, nearest: s.load(&nearest), farthest: s.load(&farthest) }
    }
}

/// The triangles of a leaf, a bit each: at most as many as lanes, even if an unchecked file has a greater count.
#[inline(always)]
fn valid_triangles(block: &impl TriangleBlock) -> u32 {
    1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH)
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

/// `error_slope` and `error_floor` of a [`TriangleFilter`], for points whose coordinates relative to the origin do not
/// exceed `reach`.
#[inline(always)]
pub(crate) fn error_coefficients(reach: f32) -> [f32; 2] {
    let slope = reach * ERROR_SLOPE;
    [slope, slope * slope + f32::MIN_POSITIVE]
}

/// Bound of the error of weights, 4δ(M + δ), from the greatest |x| + |y| (`l1_norm`) and |depth| of the projected corners.
#[inline(always)]
pub(crate) fn error<S: Lanewise>(s: S, l1_norm: S::F, greatest_depth: S::F, floor: S::F) -> S::F {
    let reach = s.add(l1_norm, greatest_depth);
    const DELTA: f32 = F32_PROJECTION_ERROR as f32;
    // A little more than 4, to cover the roundings of δ itself.
    s.fma(s.mul(reach, s.splat(4.001 * DELTA)), s.fma(reach, s.splat(DELTA), l1_norm), floor)
}

/// Sides on which sixteen lines pass the edges of their triangles.
#[derive(Clone, Copy)]
struct Sides<S: Lanewise> {
    /// Weights of the three corners: twice the signed areas opposite to them, not normalized.
    weight: [S::F; 3],
    /// Bound of the error of the weights.
    error: S::F,
    /// Pairs that certainly miss.
    missed: S::M,
    /// Pairs that certainly hit.
    certain: S::M,
}

/// Tests sixteen triangles for hits at depths from `first` to `limit`. `error` bounds the error of the weights, see the
/// head of this file.
#[inline(always)]
pub(crate) fn test_triangles<S: Lanewise>(
    s: S,
    corners: Corners<S>,
    error: S::F,
    first: S::F,
    limit: S::F,
) -> FilteredTriangles<S> {
    sides(s, &corners, error).bound_depths(s, &corners, first, limit)
}

#[inline(always)]
fn sides<S: Lanewise>(s: S, &[a, b, c]: &Corners<S>, error: S::F) -> Sides<S> {
    let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
    let minus_error = s.sub(s.splat(0.0), error);
    let least = s.min(s.min(weight[0], weight[1]), weight[2]);
    let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
    // Comparisons with NaN are false, so a pair with NaN is neither missed nor certain and remains a candidate.
    let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
    let certain = s.or(s.lt(error, least), s.lt(greatest, minus_error));
    Sides { weight, error, missed, certain }
}

impl<S: Lanewise> Sides<S> {
    /// Bounds the depths of the hits and compares them with the range from `first` to `limit`.
    #[inline(always)]
    fn bound_depths(self, s: S, [a, b, c]: &Corners<S>, first: S::F, limit: S::F) -> FilteredTriangles<S> {
        let Sides { weight, error, missed, certain } = self;
        let least_depth = s.min(s.min(a[2], b[2]), c[2]);
        let greatest_depth = s.max(s.max(a[2], b[2]), c[2]);
        let sum = s.add(s.add(weight[0], weight[1]), weight[2]);
        // The weights are normalized before they are multiplied with depths: products of a small triangle's own weights would
        // underflow.
        let inverse_sum = s.div(s.splat(1.0), sum);
        let barycentric =
            [s.mul(weight[0], inverse_sum), s.mul(weight[1], inverse_sum), s.mul(weight[2], inverse_sum)];
        let range = s.sub(greatest_depth, least_depth);
        // 3e·range/(|sum| - 3e) <= 6e·range/|sum| where |sum| >= 6e. Elsewhere this is at least the range and is clamped to it.
        let shift = s.mul(s.mul(error, s.splat(6.0)), s.mul(range, s.abs(inverse_sum)));
        let shift = s.min(shift, range);
        let depth = s.fma(barycentric[2], c[2], s.fma(barycentric[1], b[2], s.mul(barycentric[0], a[2])));
        let slack =
            s.fma(s.max_abs(least_depth, greatest_depth), s.splat(DEPTH_SLACK), s.splat(f32::MIN_POSITIVE));
        let nearest = s.sub(s.select(certain, s.sub(depth, shift), least_depth), slack);
        let farthest = s.add(s.select(certain, s.add(depth, shift), greatest_depth), slack);
        let out = s.or(s.lt(farthest, first), s.lt(limit, nearest));
        FilteredTriangles { excluded: s.or(out, missed), certain, nearest, farthest }
    }
}
