//! A ray as f32 lanes see triangles: conservative, to leave out those that certainly do not matter.
//!
//! The same projection as [`crate::intersect::line`], in f32 and for sixteen triangles at a time. Every
//! triangle that `Line::crossing` could accept remains a candidate, and what is called sure is accepted by it
//! without doubt; the rest is for f64 to decide. So the lanes of an instruction set never show in an answer.
//!
//! **Error of a weight.** u = 2^-24, and for the corners of one triangle M >= |x| + |y| as projected, r their greatest
//! coordinate seen from the ray's origin. Differences are off by ur, the shear by a factor 1±2u, its product by as much and
//! by what the depth is off (|shear| <= 1), the last sum by 2ur: sheared coordinates are off by less than
//! δ = 8ur. A cross product of two is off by 2δM + 2δ² from its points and 3uM² <= δM from its own roundings,
//! together below 4δ(M + δ). Products below the least normal number add at most that. For r serves the corner of the
//! object's box that is farthest from the origin, so that 8δ and 4δ² are numbers of the ray; for M twice the greatest |x| or |y|.
//! (Packets take M + |depth| for r: closer, and faster by measurement.)
//!
//! **Error of a depth.** Moving three weights by e each moves the depth by at most 3e·range/(|sum| - 3e), range
//! being that of the corners' depths, and never out of it; the depth's own roundings stay below 8u of the
//! greatest |depth|.

use crate::intersect::boxes::RaySlabs;
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::{IndexedLeaf, Object, RawLeaf, WIDTH};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

const _: () = assert!(WIDTH == LANES);

/// 8 roundings of f32: bounds the error of a sheared coordinate relative to the ray's reach.
pub(crate) const PROJECTION_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// A little more than eight times that, for the roundings of what is made of it.
pub(crate) const ERROR_SLOPE: f32 = 8.01 * PROJECTION_ERROR as f32;
/// Farther coordinates could overflow the products of weights and depths: all triangles are candidates then.
const FARTHEST: f64 = (1u64 << 40) as f64;
/// Slack of depths, relative to the greatest: their roundings, with some to spare.
const DEPTH_SLACK: f32 = 16.0 / (1 << 24) as f32;

/// A ray prepared for the triangles of leaves. The depth of points, and t, are measured as in [`RaySlabs`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct TriangleFilter {
    /// The two axes of the projection and the one along the ray.
    pub(crate) axis: [u32; 3],
    /// Bound of the error of a weight of points at the line; infinite where products may overflow.
    pub(crate) error_floor: f32,
    /// Along the axes of the plane.
    pub(crate) origin: [f32; 2],
    pub(crate) shear: [f32; 2],
    /// Depth of a coordinate along the third axis: this times it,
    pub(crate) forward: f32,
    /// plus this; both exact.
    pub(crate) start: f32,
    /// Hits certainly lie in the ray's range from this depth
    pub(crate) first: f32,
    /// to this.
    pub(crate) last: f32,
    /// What the bound grows by with the greatest |x| or |y| of the points.
    pub(crate) error_slope: f32,
}

/// Triangles of a leaf that the ray may hit, a bit each.
#[derive(Clone, Copy)]
pub(crate) struct Candidates<S: Simd> {
    /// Those that are not certainly missed.
    pub(crate) maybe: u32,
    /// Of these, those that are certainly hit, within the ray's range.
    pub(crate) sure: u32,
    /// Between which depths they are hit, if they are.
    pub(crate) nearest: S::F,
    pub(crate) farthest: S::F,
}

/// A triangle of a leaf that is certainly hit, and no other nearer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Certain {
    /// Place in the leaf.
    pub(crate) triangle: usize,
    /// Between which depths.
    pub(crate) near: f32,
    pub(crate) far: f32,
}

impl<S: Simd> Candidates<S> {
    /// Those that may be the nearest, a bit each, and that one if it is certain.
    #[inline(always)]
    pub(crate) fn nearest_of_all(&self, s: S) -> (u32, Option<Certain>) {
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

/// Projected corners, sixteen triangles: `[corner][x, y, depth]`.
pub(crate) type Corners<S> = [[<S as Simd>::F; 3]; 3];

/// The triangles of a leaf.
pub(crate) trait TriangleBlock {
    fn first(&self) -> u32;
    fn triangles(&self) -> u32;
    /// The number of the triangle is taken modulo [`WIDTH`] here and below.
    #[inline(always)]
    fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        // Not by maps over rows, which are copied for that.
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
    fn project<S: Simd>(&self, s: S, sight: &TriangleFilter) -> Corners<S>;
}

/// The points at these places.
#[inline(always)]
fn pick<S: Simd>(s: S, [x, y, depth]: [S::F; 3], row: &[u8; WIDTH]) -> [S::F; 3] {
    let at = s.load_bytes(row);
    [s.lookup(x, at), s.lookup(y, at), s.lookup(depth, at)]
}

/// Twice the signed area of the triangle of the line and two points.
#[inline(always)]
pub(crate) fn cross<S: Simd>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.fnma(p[1], q[0], s.mul(p[0], q[1]))
}

/// The greatest |x| or |y|.
#[inline(always)]
fn greatest_coordinate<S: Simd>(s: S, [a, b, c]: &Corners<S>) -> S::F {
    s.max(s.max(s.max_abs(a[0], a[1]), s.max_abs(b[0], b[1])), s.max_abs(c[0], c[1]))
}

/// |x| + |y|.
#[inline(always)]
pub(crate) fn size<S: Simd>(s: S, p: [S::F; 3]) -> S::F {
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
    fn project<S: Simd>(&self, s: S, sight: &TriangleFilter) -> Corners<S> {
        let points = sight.project(s, &self.vertex);
        [pick(s, points, &self.corner[0]), pick(s, points, &self.corner[1]), pick(s, points, &self.corner[2])]
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
    fn project<S: Simd>(&self, s: S, sight: &TriangleFilter) -> Corners<S> {
        [
            sight.project(s, &self.corner[0]),
            sight.project(s, &self.corner[1]),
            sight.project(s, &self.corner[2]),
        ]
    }
}

impl TriangleFilter {
    pub(crate) fn new(ray: &Ray, line: &Line, slabs: &RaySlabs, object: &Object) -> TriangleFilter {
        let reach = line.reach_of_box(object.lower, object.upper);
        let [first, last] = slabs.certain_range(ray);
        let forward = 1f32.copysign(line.direction[line.axis[2]] as f32);
        let [error_slope, error_floor] =
            if reach < FARTHEST { errors(reach as f32) } else { [0.0, f32::INFINITY] };
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

    /// Projects points given as rows of x, y and z.
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
        let depth = s.fma(s.load(&rows[self.axis[2] as usize]), s.splat(self.forward), s.splat(self.start));
        let x = s.sub(s.load(&rows[self.axis[0] as usize]), s.splat(self.origin[0]));
        let y = s.sub(s.load(&rows[self.axis[1] as usize]), s.splat(self.origin[1]));
        [s.fnma(s.splat(self.shear[0]), depth, x), s.fnma(s.splat(self.shear[1]), depth, y), depth]
    }

    /// The triangles of a leaf that may be hit between the start of the ray's range and a depth.
    #[inline(always)]
    pub(crate) fn candidates<S: Simd, B: TriangleBlock>(
        &self,
        s: S,
        block: &B,
        first: f32,
        limit: f32,
    ) -> Candidates<S> {
        let corners = block.project(s, self);
        let greatest = greatest_coordinate(s, &corners);
        let error = s.fma(greatest, s.splat(self.error_slope), s.splat(self.error_floor));
        let sides = sides(s, &corners, error);
        // Of no more than there are lanes, whatever an unchecked file says.
        let valid = 1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH);
        // Most leaves that a ray enters have no triangle that it could meet: then depths do not matter.
        if valid & !s.mask_bits(sides.missed) == 0 {
            return Candidates { maybe: 0, sure: 0, nearest: error, farthest: error };
        }
        let weighed = sides.weigh(s, &corners, s.splat(first), s.splat(limit));
        let maybe = valid & !s.mask_bits(weighed.out);
        let in_range =
            s.and(s.le(s.splat(self.first), weighed.nearest), s.le(weighed.farthest, s.splat(self.last)));
        let sure = maybe & s.mask_bits(s.and(weighed.certain, in_range));
        Candidates { maybe, sure, nearest: weighed.nearest, farthest: weighed.farthest }
    }
}

/// What f32 makes of sixteen pairs of a line and a triangle.
#[derive(Clone, Copy)]
pub(crate) struct FilteredTriangles<S: Simd> {
    /// Certainly missed, or out of range.
    pub(crate) out: S::M,
    /// Certainly hit, in range or not.
    pub(crate) certain: S::M,
    /// ObjectBounds of the depth of a hit.
    pub(crate) nearest: S::F,
    pub(crate) farthest: S::F,
}

/// What [`TriangleFilter`] says of errors, for points up to this far from the origin.
#[inline(always)]
pub(crate) fn errors(reach: f32) -> [f32; 2] {
    let slope = reach * ERROR_SLOPE;
    [slope, slope * slope + f32::MIN_POSITIVE]
}

/// Bound of the error of weights, from the greatest size and depth of projected corners.
#[inline(always)]
pub(crate) fn error<S: Simd>(s: S, size: S::F, greatest_depth: S::F, floor: S::F) -> S::F {
    let reach = s.add(size, greatest_depth);
    const DELTA: f32 = PROJECTION_ERROR as f32;
    // A little more than 4δ(M + δ), for the roundings of δ itself.
    s.fma(s.mul(reach, s.splat(4.001 * DELTA)), s.fma(reach, s.splat(DELTA), size), floor)
}

/// On which sides of triangles lines pass.
#[derive(Clone, Copy)]
struct Sides<S: Simd> {
    weight: [S::F; 3],
    /// Bound of their error.
    error: S::F,
    missed: S::M,
    certain: S::M,
}

/// Weighs triangles for hits between two depths, given a bound of the error of weights; see the top of this file.
#[inline(always)]
pub(crate) fn weigh<S: Simd>(
    s: S,
    corners: Corners<S>,
    error: S::F,
    first: S::F,
    limit: S::F,
) -> FilteredTriangles<S> {
    sides(s, &corners, error).weigh(s, &corners, first, limit)
}

#[inline(always)]
fn sides<S: Simd>(s: S, &[a, b, c]: &Corners<S>, error: S::F) -> Sides<S> {
    let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
    let minus_error = s.sub(s.splat(0.0), error);
    let least = s.min(s.min(weight[0], weight[1]), weight[2]);
    let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
    // By what is certain, so that NaN stays a candidate.
    let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
    let certain = s.or(s.lt(error, least), s.lt(greatest, minus_error));
    Sides { weight, error, missed, certain }
}

impl<S: Simd> Sides<S> {
    /// Where the lines hit, between two depths.
    #[inline(always)]
    fn weigh(self, s: S, [a, b, c]: &Corners<S>, first: S::F, limit: S::F) -> FilteredTriangles<S> {
        let Sides { weight, error, missed, certain } = self;
        let shallow = s.min(s.min(a[2], b[2]), c[2]);
        let deep = s.max(s.max(a[2], b[2]), c[2]);
        let sum = s.add(s.add(weight[0], weight[1]), weight[2]);
        // Shares, and not the sum of products by the sum of weights: those of a small triangle would underflow.
        let inverse = s.div(s.splat(1.0), sum);
        let share = [s.mul(weight[0], inverse), s.mul(weight[1], inverse), s.mul(weight[2], inverse)];
        let range = s.sub(deep, shallow);
        // Where |sum| <= 6e this exceeds the range, and is cut to it.
        let shift = s.mul(s.mul(error, s.splat(6.0)), s.mul(range, s.abs(inverse)));
        let shift = s.min(shift, range);
        let depth = s.fma(share[2], c[2], s.fma(share[1], b[2], s.mul(share[0], a[2])));
        let slack = s.fma(s.max_abs(shallow, deep), s.splat(DEPTH_SLACK), s.splat(f32::MIN_POSITIVE));
        let nearest = s.sub(s.select(certain, s.sub(depth, shift), shallow), slack);
        let farthest = s.add(s.select(certain, s.add(depth, shift), deep), slack);
        let out = s.or(s.lt(farthest, first), s.lt(limit, nearest));
        FilteredTriangles { out: s.or(out, missed), certain, nearest, farthest }
    }
}
