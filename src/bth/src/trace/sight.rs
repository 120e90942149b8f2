//! A ray as f32 lanes see triangles: conservative, to leave out those that certainly do not matter.
//!
//! The same projection as [`super::line`], in f32 and for sixteen triangles at a time. Every
//! triangle that `Line::crossing` could accept remains a candidate, and what is called sure is accepted by it
//! without doubt; the rest is for f64 to decide. So the lanes of an instruction set never show in an answer.
//!
//! **Error of a weight.** u = 2^-24, R at least the greatest |coordinate| of any vertex seen from the ray's
//! origin. Differences are off by uR, the shear by a factor 1±u, its product and the last sum by uR each at most
//! (|shear| <= 1): sheared coordinates are off by less than δ = 8uR. With M >= |x| + |y| of both points,
//! M <= 4R: a cross product is off by 2δM + 2δ² from its points and 3uM² <= 1.5δM from its own roundings,
//! together below 4δ(M + δ). Products below the least normal number add at most that.
//!
//!
//! With r >= |x| + |y| + |z| of the corners of one triangle in the place of R, the same holds for its own weights:
//! a second, much smaller bound, 32ur(M + 8ur), that only likely triangles are worth.
//!
//! **Error of a depth.** Moving three weights by e each moves the depth by at most 3e·range/(|sum| - 3e), range
//! being that of the corners' depths, and never out of it; the depth's own roundings stay below 8u of the
//! greatest |depth|.

use super::line::Line;
use super::slabs::Slabs;
use crate::layout::{IndexedLeaf, Object, RawLeaf, WIDTH};
use crate::rays::Ray;
use crate::simd::{LANES, Simd};

const _: () = assert!(WIDTH == LANES);

/// 8 roundings of f32: bounds the error of a sheared coordinate relative to the ray's reach.
pub(crate) const PROJECTION_ERROR: f64 = 8.0 / (1 << 24) as f64;
/// Farther coordinates could overflow the products of weights: all triangles are candidates then.
const FARTHEST: f64 = (1u64 << 60) as f64;
/// Slack of depths as t, relative to the greatest: the roundings of the depth and of t, with some to spare.
const DEPTH_SLACK: f32 = 16.0 / (1 << 24) as f32;

/// A ray prepared for the triangles of leaves. t is in the scaled units of [`Slabs`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// The two axes of the projection and the one along the ray.
    pub(crate) axis: [u32; 3],
    /// Along these axes.
    pub(crate) origin: [f32; 3],
    pub(crate) shear: [f32; 2],
    pub(crate) depth_to_t: f32,
    /// 4δ, and 4δ² with what underflow adds.
    pub(crate) error: [f32; 2],
    /// What underflow adds to an error, infinite where products may overflow.
    pub(crate) floor: f32,
    /// Hits certainly lie in the ray's range from here
    pub(crate) first: f32,
    /// to here.
    pub(crate) last: f32,
}

/// Triangles of a leaf that the ray may hit, a bit each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidates {
    /// Those that are not certainly missed.
    pub(crate) maybe: u32,
    /// Of these, those that are certainly hit, within the ray's range.
    pub(crate) sure: u32,
}

/// Projected corners, sixteen triangles: `[corner][x, y, depth]`.
type Corners<S> = [[<S as Simd>::F; 3]; 3];

/// The triangles of a leaf.
pub(crate) trait Block {
    fn first(&self) -> u32;
    fn triangles(&self) -> u32;
    fn corners(&self, triangle: usize) -> [[f32; 3]; 3];
    /// The corners along these axes.
    fn corners_along(&self, axis: [u32; 3], triangle: usize) -> [[f64; 3]; 3];
    fn project<S: Simd>(&self, s: S, sight: &Sight) -> Corners<S>;
}

/// The points at these places.
#[inline(always)]
fn pick<S: Simd>(s: S, [x, y, depth]: [S::F; 3], row: &[u8; WIDTH]) -> [S::F; 3] {
    let at = s.load_bytes(row);
    [s.lookup(x, at), s.lookup(y, at), s.lookup(depth, at)]
}

/// Twice the signed area of the triangle of the line and two points.
#[inline(always)]
fn cross<S: Simd>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.fnma(p[1], q[0], s.mul(p[0], q[1]))
}

/// |x| + |y|.
#[inline(always)]
fn size<S: Simd>(s: S, p: [S::F; 3]) -> S::F {
    s.add(s.abs(p[0]), s.abs(p[1]))
}

impl Block for IndexedLeaf {
    #[inline(always)]
    fn first(&self) -> u32 {
        self.first
    }
    #[inline(always)]
    fn triangles(&self) -> u32 {
        self.triangles
    }
    #[inline(always)]
    fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        self.corner.map(|row| self.vertex.map(|axis| axis[usize::from(row[triangle]) % WIDTH]))
    }
    #[inline(always)]
    fn corners_along(&self, axis: [u32; 3], triangle: usize) -> [[f64; 3]; 3] {
        let mut out = [[0.0; 3]; 3];
        for k in 0..3 {
            let row = &self.vertex[axis[k] as usize];
            for c in 0..3 {
                out[c][k] = row[usize::from(self.corner[c][triangle % WIDTH]) % WIDTH].into();
            }
        }
        out
    }
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, sight: &Sight) -> Corners<S> {
        let points = sight.project(s, &self.vertex);
        [pick(s, points, &self.corner[0]), pick(s, points, &self.corner[1]), pick(s, points, &self.corner[2])]
    }
}

impl Block for RawLeaf {
    #[inline(always)]
    fn first(&self) -> u32 {
        self.first
    }
    #[inline(always)]
    fn triangles(&self) -> u32 {
        self.triangles
    }
    #[inline(always)]
    fn corners(&self, triangle: usize) -> [[f32; 3]; 3] {
        self.corner.map(|axes| axes.map(|row| row[triangle]))
    }
    #[inline(always)]
    fn corners_along(&self, axis: [u32; 3], triangle: usize) -> [[f64; 3]; 3] {
        let mut out = [[0.0; 3]; 3];
        for k in 0..3 {
            for c in 0..3 {
                out[c][k] = self.corner[c][axis[k] as usize][triangle % WIDTH].into();
            }
        }
        out
    }
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, sight: &Sight) -> Corners<S> {
        [
            sight.project(s, &self.corner[0]),
            sight.project(s, &self.corner[1]),
            sight.project(s, &self.corner[2]),
        ]
    }
}

impl Sight {
    /// Of no ray.
    pub(crate) const VACANT: Sight = Sight {
        axis: [0, 1, 2],
        origin: [0.0; 3],
        shear: [0.0; 2],
        depth_to_t: 1.0,
        error: [0.0; 2],
        floor: 0.0,
        first: 0.0,
        last: 0.0,
    };

    pub(crate) fn new(ray: &Ray, line: &Line, slabs: &Slabs, object: &Object) -> Sight {
        let reach = line.reach_of_box(object.lower, object.upper);
        let floor = if reach < FARTHEST { f32::MIN_POSITIVE } else { f32::INFINITY };
        let delta = (PROJECTION_ERROR * reach) as f32;
        let [first, last] = slabs.certain_range(ray);
        Sight {
            axis: line.axis.map(|k| k as u32),
            origin: line.axis.map(|k| ray.origin[k]),
            shear: line.shear.map(|s| s as f32),
            depth_to_t: slabs.depth_to_t(line),
            error: [(4.0 * delta).next_up(), (4.001 * delta * delta).next_up() + floor],
            floor,
            first,
            last,
        }
    }

    /// Projects points given as rows of x, y and z.
    #[inline(always)]
    fn project<S: Simd>(&self, s: S, rows: &[[f32; WIDTH]; 3]) -> [S::F; 3] {
        let x = s.sub(s.load(&rows[self.axis[0] as usize]), s.splat(self.origin[0]));
        let y = s.sub(s.load(&rows[self.axis[1] as usize]), s.splat(self.origin[1]));
        let depth = s.sub(s.load(&rows[self.axis[2] as usize]), s.splat(self.origin[2]));
        [s.fnma(s.splat(self.shear[0]), depth, x), s.fnma(s.splat(self.shear[1]), depth, y), depth]
    }

    /// The triangles of a leaf that may be hit from `tmin` to `limit`.
    #[inline(always)]
    pub(crate) fn candidates<S: Simd, B: Block>(&self, s: S, block: &B, tmin: f32, limit: f32) -> Candidates {
        let [a, b, c] = block.project(s, self);
        let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
        let greatest_size = s.max(s.max(size(s, a), size(s, b)), size(s, c));
        let error = s.fma(greatest_size, s.splat(self.error[0]), s.splat(self.error[1]));
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
        let minus_error = s.sub(s.splat(0.0), error);
        // By what is certain, so that NaN stays a candidate.
        let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
        let valid = (1 << block.triangles().min(WIDTH as u32)) - 1;
        let maybe = valid & !s.mask_bits(missed);
        if maybe == 0 {
            return Candidates { maybe: 0, sure: 0 };
        }
        let absolute = [s.abs(a[2]), s.abs(b[2]), s.abs(c[2])];
        let greatest_depth = s.max(s.max(absolute[0], absolute[1]), absolute[2]);
        let reach = s.add(greatest_size, greatest_depth);
        let delta = s.mul(reach, s.splat(PROJECTION_ERROR as f32));
        // A little more than 4δ(M + δ), for the roundings of δ itself.
        let error = s.fma(s.mul(delta, s.splat(4.001)), s.add(greatest_size, delta), s.splat(self.floor));
        let minus_error = s.sub(s.splat(0.0), error);
        let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
        let certain = s.or(s.lt(error, least), s.lt(greatest, minus_error));
        let shallow = s.min(s.min(a[2], b[2]), c[2]);
        let deep = s.max(s.max(a[2], b[2]), c[2]);
        let range = s.sub(deep, shallow);
        let sum = s.add(s.add(weight[0], weight[1]), weight[2]);
        let moment = s.fma(weight[2], c[2], s.fma(weight[1], b[2], s.mul(weight[0], a[2])));
        let inverse = s.div(s.splat(1.0), sum);
        let depth = s.mul(moment, inverse);
        // Where |sum| <= 6e this exceeds the range, and is cut to it.
        let shift = s.mul(s.mul(error, s.splat(6.0)), s.abs(inverse));
        let shift = s.min(s.mul(shift, range), range);
        // NaN gives way to the corners.
        let near = s.max(s.select(certain, s.sub(depth, shift), shallow), shallow);
        let far = s.min(s.select(certain, s.add(depth, shift), deep), deep);
        let scale = s.splat(self.depth_to_t);
        let (t, u) = (s.mul(near, scale), s.mul(far, scale));
        let slack = s.fma(greatest_depth, s.splat(DEPTH_SLACK), s.splat(f32::MIN_POSITIVE));
        let nearest = s.sub(s.min(t, u), slack);
        let farthest = s.add(s.max(t, u), slack);
        let out = s.or(s.lt(farthest, s.splat(tmin)), s.lt(s.splat(limit), nearest));
        let maybe = maybe & !s.mask_bits(s.or(out, missed));
        let in_range = s.and(s.le(s.splat(self.first), nearest), s.le(farthest, s.splat(self.last)));
        Candidates { maybe, sure: maybe & s.mask_bits(s.and(certain, in_range)) }
    }
}
