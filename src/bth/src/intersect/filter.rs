//! Conservative f32 filter of the triangles of a leaf: it excludes those that the ray certainly
//! misses.
//!
//! It is the projection of [`crate::intersect::line`] in f32, for sixteen triangles at a time.
//! Every triangle that `Line::intersection` could accept remains a candidate, and every triangle
//! that is called sure is accepted by `Line::intersection`. The other candidates are decided in
//! f64, so the result of a query does not depend on the instruction set.
//! [`edge_functions`](crate::intersect::edge_functions) derives the bounds of the errors.

use crate::intersect::boxes::RaySlabs;
use crate::intersect::edge_functions::{self, Corners, FilteredTriangles, Sides, error_coefficients, sides};
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{LANES, Lanewise, Part, Simd, lanes_of_piece};
use bth_format::layout::{IndexedLeaf, RawLeaf, WIDTH};
use bth_format::object::ObjectBounds;
use std::hint::black_box;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

const _: () = assert!(WIDTH == LANES);

/// From this reach on, products of weights and depths could overflow: all triangles are candidates
/// then.
const MAX_REACH: f64 = (1u64 << 40) as f64;
/// Per-ray constants of the filter, in object space. Depths are t times the largest |component| of
/// the direction, as in [`RaySlabs`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct TriangleFilter {
    /// The two axes of the plane of projection, and the axis of the direction's largest
    /// |component|.
    pub(crate) axis: [u32; 3],
    /// Constant part of the bound of a weight's error; infinite where products may overflow.
    pub(crate) error_floor: f32,
    /// The ray's origin along the two axes of the plane.
    pub(crate) origin: [f32; 2],
    /// Change of the plane's coordinates along the ray per unit of depth.
    pub(crate) shear: [f32; 2],
    /// 1 or -1, the sign of the direction along the third axis. The depth of a coordinate z is
    /// `forward * z + start`.
    pub(crate) forward: f32,
    /// Depth of the coordinate 0 along the third axis. It is exact, as is `forward`.
    pub(crate) start: f32,
    /// Smallest depth from which a hit certainly lies in the ray's range.
    pub(crate) first: f32,
    /// Largest depth up to which a hit certainly lies in the ray's range.
    pub(crate) last: f32,
    /// Growth of the bound of a weight's error with the largest |x| or |y| of the projected
    /// corners.
    pub(crate) error_slope: f32,
}

/// Triangles of a leaf that the ray may hit: in the bit sets, bit i is triangle i of the leaf.
#[derive(Clone, Copy)]
pub(crate) struct Candidates<S: Simd> {
    /// Triangles that the line may cross, at whatever depth.
    pub(crate) crossed: u32,
    /// Triangles that are not certainly missed: a subset of `crossed`.
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
    /// The triangles that may be the nearest hit, as bits, and the nearest hit if it is certain.
    /// `maybe` must not be empty.
    #[inline(always)]
    pub(crate) fn nearest_candidates(&self, s: S) -> (u32, Option<Certain>) {
        let &Candidates { crossed, mut maybe, sure, nearest, farthest } = self;
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
        // `maybe` waits for a division that `crossed` does not need. A single ray is answered in
        // f64 next, which begins that much earlier if the processor predicts this branch; the black
        // box keeps it from becoming a selection, which would wait for both.
        let only = if crossed & (crossed - 1) == 0 { crossed } else { black_box(maybe) };
        let triangle = only.trailing_zeros() as usize % WIDTH;
        (maybe, Some(Certain { triangle, near: near[triangle], far: far[triangle] }))
    }
}

/// A corner of [`ObjectBounds`] without the number that fills a vector.
fn corner([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

/// Projected points of a leaf: x, y and depth of each.
pub(crate) type PointRows = [[f32; 4]; WIDTH];

/// The triangles of a leaf, in either of the leaf's record formats. Indices of triangles are taken
/// modulo [`WIDTH`].
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
    /// Like [`Self::project`], for a piece of the triangles, given the projected points.
    fn project_piece<L: Lanewise>(
        &self,
        l: L,
        filter: &TriangleFilter,
        points: Option<&PointRows>,
    ) -> Corners<L>;
}

/// For each lane the point whose index is in `row`, out of sixteen points.
#[inline(always)]
fn lookup_points<S: Simd>(s: S, [x, y, depth]: [S::F; 3], row: &[u8; WIDTH]) -> [S::F; 3] {
    let at = s.load_bytes(row);
    [s.lookup(x, at), s.lookup(y, at), s.lookup(depth, at)]
}

/// The largest |x| or |y| of the three corners.
#[inline(always)]
fn greatest_coordinate<S: Lanewise>(s: S, [a, b, c]: &Corners<S>) -> S::F {
    s.max(s.max(s.max_abs(a[0], a[1]), s.max_abs(b[0], b[1])), s.max_abs(c[0], c[1]))
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
            // A piece without a vertex is skipped.
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
    pub(crate) fn new(ray: &Ray, line: &Line, slabs: &RaySlabs, bounds: &ObjectBounds) -> TriangleFilter {
        let reach = line.reach_of_box(corner(bounds.lower), corner(bounds.upper));
        let reach = reach + f64::from(bounds.origin_reach);
        let [first, last] = slabs.certain_range(ray, bounds.origin_error);
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

    /// The triangles of a leaf that may be hit at a depth between `first` and `limit`, without
    /// those whose bits are set in `left_out`. `bounds` are those for which the ray was prepared.
    #[inline(always)]
    pub(crate) fn candidates<S: Simd, B: TriangleBlock>(
        &self,
        s: S,
        (block, left_out): (&B, u32),
        first: f32,
        limit: f32,
        bounds: &ObjectBounds,
    ) -> Candidates<S> {
        let triangles = valid_triangles(block) & !left_out;
        CandidatesOf { filter: self, block, triangles, first, limit, bounds }.inline_or_call(s)
    }

    /// The sides on which the ray passes the edges of triangles.
    #[inline(always)]
    fn sides<S: Lanewise>(&self, s: S, corners: &Corners<S>) -> Sides<S> {
        let greatest = greatest_coordinate(s, corners);
        let error = s.fma(greatest, s.splat(self.error_slope), s.splat(self.error_floor));
        sides(s, corners, error)
    }

    /// The sides with the errors that the triangles' own distances from the ray's origin bound.
    /// Where the object is much larger than what lies around the ray, such as a statue on a plain,
    /// the bound by the object's box decides nothing.
    #[inline(always)]
    fn closer<S: Lanewise>(
        &self,
        s: S,
        sides: Sides<S>,
        corners: &Corners<S>,
        origin_reach: f32,
    ) -> Sides<S> {
        // Where products may overflow, no bound holds.
        let floor = if self.error_floor < f32::INFINITY { f32::MIN_POSITIVE } else { f32::INFINITY };
        let own = edge_functions::error_of(s, corners, s.splat(origin_reach), s.splat(floor));
        sides.with_error(s, s.min(own, sides.error))
    }

    /// Like [`Sides::bound_depths`]; certain are only hits within the ray's range.
    #[inline(always)]
    fn bound_depths<S: Lanewise>(
        &self,
        s: S,
        sides: Sides<S>,
        corners: &Corners<S>,
        range: [f32; 2],
        corner_error: f32,
    ) -> FilteredTriangles<S> {
        let tested = sides.bound_depths(s, corners, [s.splat(range[0]), s.splat(range[1])], corner_error);
        let in_range =
            s.and(s.le(s.splat(self.first), tested.nearest), s.le(tested.farthest, s.splat(self.last)));
        FilteredTriangles { certain: s.and(tested.certain, in_range), ..tested }
    }
}

/// [`TriangleFilter::candidates`] as a part of kernels.
struct CandidatesOf<'a, B> {
    filter: &'a TriangleFilter,
    block: &'a B,
    /// Bits of the triangles.
    triangles: u32,
    first: f32,
    limit: f32,
    bounds: &'a ObjectBounds,
}

impl<S: Simd, B: TriangleBlock> Part<S> for CandidatesOf<'_, B> {
    type Output = Candidates<S>;
    #[inline(always)]
    fn run(self, s: S) -> Candidates<S> {
        let CandidatesOf { filter, block, triangles: valid, first, limit, bounds } = self;
        if S::PIECES == 1 {
            let corners = block.project(s, filter);
            let mut sides = filter.sides(s, &corners);
            let mut crossed = valid & !s.mask_bits(sides.missed);
            if crossed & !s.mask_bits(sides.certain) != 0 {
                sides = filter.closer(s, sides, &corners, bounds.origin_reach);
                crossed &= !s.mask_bits(sides.missed);
            }
            // In most leaves that a ray enters, all triangles are missed: then depths need not be
            // computed.
            if crossed == 0 {
                return Candidates {
                    crossed,
                    maybe: 0,
                    sure: 0,
                    nearest: sides.error,
                    farthest: sides.error,
                };
            }
            let tested = filter.bound_depths(s, sides, &corners, [first, limit], bounds.corner_error);
            let maybe = valid & !s.mask_bits(tested.excluded);
            let sure = maybe & s.mask_bits(tested.certain);
            let FilteredTriangles { nearest, farthest, .. } = tested;
            return Candidates { crossed, maybe, sure, nearest, farthest };
        }
        let (mut crossed, mut maybe, mut sure) = (0, 0, 0);
        let (mut nearest, mut farthest) = ([0.0; LANES], [0.0; LANES]);
        let points = block.project_points(s, filter);
        for i in 0..S::PIECES {
            let (valid, p) = (valid & lanes_of_piece::<S>(i), s.piece(i));
            if valid == 0 {
                break;
            }
            let corners = block.project_piece(p, filter, points.as_ref());
            let mut sides = filter.sides(p, &corners);
            if valid & !p.mask_bits(p.or(sides.missed, sides.certain)) != 0 {
                sides = filter.closer(p, sides, &corners, bounds.origin_reach);
            }
            if valid & !p.mask_bits(sides.missed) == 0 {
                continue;
            }
            crossed |= valid & !p.mask_bits(sides.missed);
            let tested = filter.bound_depths(p, sides, &corners, [first, limit], bounds.corner_error);
            maybe |= valid & !p.mask_bits(tested.excluded);
            sure |= valid & p.mask_bits(tested.certain);
            p.store(tested.nearest, &mut nearest);
            p.store(tested.farthest, &mut farthest);
        }
        let (nearest, farthest) = (s.load(&nearest), s.load(&farthest));
        Candidates { crossed, maybe, sure: sure & maybe, nearest, farthest }
    }
}

/// The triangles of a leaf, one bit per triangle: at most one per lane, even if the count in an
/// unchecked file is larger.
#[inline(always)]
fn valid_triangles(block: &impl TriangleBlock) -> u32 {
    1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH)
}
