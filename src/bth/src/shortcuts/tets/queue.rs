//! Preparation of rays for tet walks in lanes, and the queue of prepared rays from which lanes are
//! filled.

use super::lanes::{Extent, Lanes, cross, float, three, word};
use crate::intersect::prepare;
use crate::rays::Ray;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::HullFace;

/// Greatest |coordinate| of an origin, 2^59. Rays beyond this limit or those below are walked in
/// f64, because products could overflow or underflow in f32.
const GREATEST_ORIGIN: f32 = (1u64 << 59) as f32;
/// Greatest |component| of a direction, 2^40. A depth is t times a factor between 2^-40 and 2^40.
const GREATEST_DIRECTION: f32 = (1u64 << 40) as f32;
/// Smallest allowed value of a direction's largest |component|, 2^-40.
const LEAST_DIRECTION: f32 = 1.0 / (1u64 << 40) as f32;
/// Slack of comparisons of depths with bounds of t, relative to the depth. It exceeds the sum of
/// all rounding errors.
const LANE_DEPTH_SLACK: f32 = 1.0 / (1 << 20) as f32;
/// Absolute part of the slack, for depths near 0. It exceeds the smallest positive f32 times the
/// largest direction.
const LEAST_DEPTH_SLACK: f32 = 1.0 / (1u128 << 100) as f32;

/// Greatest number of queued rays.
const QUEUE_CAPACITY: usize = 4 * LANES;

/// Queue of prepared rays, which holds a row for each element of [`Lanes`].
pub(super) struct PreparedQueue {
    words: [[u32; QUEUE_CAPACITY + LANES]; word::COUNT],
    floats: [[f32; QUEUE_CAPACITY + LANES]; float::COUNT],
    /// Index of the next ray to pop.
    first: usize,
    /// Index at which the next ray is pushed.
    end: usize,
}

/// The sixteen elements of a row from index `start` on.
#[inline(always)]
fn sixteen<T>(row: &[T; QUEUE_CAPACITY + LANES], start: usize) -> &[T; LANES] {
    row[start..].first_chunk().expect("rows have sixteen elements to spare")
}

/// The sixteen elements of a row from index `start` on.
#[inline(always)]
fn sixteen_mut<T>(row: &mut [T; QUEUE_CAPACITY + LANES], start: usize) -> &mut [T; LANES] {
    row[start..].first_chunk_mut().expect("rows have sixteen elements to spare")
}

impl PreparedQueue {
    pub(super) fn new() -> Self {
        PreparedQueue {
            words: [[0; QUEUE_CAPACITY + LANES]; word::COUNT],
            floats: [[0.0; QUEUE_CAPACITY + LANES]; float::COUNT],
            first: 0,
            end: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.end - self.first
    }

    /// Makes the whole capacity available again; the queue must be empty.
    pub(super) fn rewind(&mut self) {
        debug_assert_eq!(self.len(), 0);
        (self.first, self.end) = (0, 0);
    }

    /// Returns true if sixteen more rays can be pushed.
    pub(super) fn has_space(&self) -> bool {
        self.end + LANES <= QUEUE_CAPACITY
    }

    /// Appends the rays of the lanes whose bit is set.
    #[inline(always)]
    pub(super) fn push<S: Simd>(&mut self, s: S, bits: u32, lanes: &Lanes<S>) {
        s.call(Push { queue: self, bits, lanes });
    }

    /// Moves rays from the queue to lanes whose bit is set in `idle`, until no such lane or no ray
    /// is left. Returns the bits of the lanes that were filled.
    #[inline(always)]
    pub(super) fn pop<S: Simd>(&mut self, s: S, idle: u32, lanes: &mut Lanes<S>) -> u32 {
        let mut taken = idle;
        while taken.count_ones() as usize > self.len() {
            taken &= taken - 1;
        }
        let m = s.mask(taken);
        // The indices are literals, so that the lanes can stay in registers.
        macro_rules! pop {
            ($values:ident $expand:ident $($i:literal)*) => { $(
                lanes.$values[$i] = s.$expand(lanes.$values[$i], m, sixteen(&self.$values[$i], self.first));
            )* };
        }
        pop!(words expand_u 0 1 2 3 4 5 6 7);
        pop!(floats expand 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        self.first += taken.count_ones() as usize;
        taken
    }
}

/// [`PreparedQueue::push`] as a function that kernels share. There are three calls.
struct Push<'a, S: Simd> {
    queue: &'a mut PreparedQueue,
    bits: u32,
    lanes: &'a Lanes<S>,
}

impl<S: Simd> Part<S> for Push<'_, S> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let Push { queue, bits, lanes } = self;
        macro_rules! push {
            ($values:ident $compress:ident $($i:literal)*) => { $(
                s.$compress(bits, lanes.$values[$i], sixteen_mut(&mut queue.$values[$i], queue.end));
            )* };
        }
        push!(words compress 0 1 2 3 4 5 6 7);
        push!(floats compress_f 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        queue.end += bits.count_ones() as usize;
    }
}

/// [`PreparedWalks::of_rays`] as a part of kernels: the mask, the rays and the indices of sixteen.
struct OfRays<'a, S: Simd>(S::M, &'a [Ray], S::U);

impl<S: Simd> Part<S> for OfRays<'_, S> {
    type Output = PreparedWalks<S>;
    #[inline(always)]
    fn run(self, s: S) -> PreparedWalks<S> {
        PreparedWalks::prepare(s, self.0, self.1, self.2)
    }
}

/// [`PreparedWalks::set_face`] as a function that kernels share. There are four calls.
struct SetFace<'a, S: Simd> {
    lanes: &'a mut Lanes<S>,
    m: S::M,
    vertices: &'a [[f32; 4]],
    face: [S::U; 3],
}

impl<S: Simd> Part<S> for SetFace<'_, S> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let SetFace { lanes, m, vertices, face } = self;
        let mut extent = Extent::least(s);
        for (i, vertex) in face.into_iter().enumerate() {
            let corner = lanes.project(s, lanes.gather_positions(s, m, vertices, vertex));
            extent = extent.with(s, &corner).0;
            lanes.words[word::FACE + i] = vertex;
            lanes.floats[float::X + i] = corner.x;
            lanes.floats[float::Y + i] = corner.y;
            lanes.floats[float::DEPTH + i] = corner.depth;
        }
        lanes.floats[float::REACH] = extent.reach;
        lanes.floats[float::SIZE] = extent.size;
    }
}

/// Slack of comparisons of `depth` with bounds of t.
#[inline(always)]
fn slack<S: Simd>(s: S, depth: S::F) -> S::F {
    s.fma(s.abs(depth), s.splat(LANE_DEPTH_SLACK), s.splat(LEAST_DEPTH_SLACK))
}

/// Sixteen rays with the constants of their projections, and the projected faces through which
/// their walks begin.
pub(super) struct PreparedWalks<S: Simd> {
    pub(super) lanes: Lanes<S>,
    /// The lanes whose rays are within the limits of f32 and have tmin <= tmax.
    pub(super) representable: S::M,
}

impl<S: Simd> PreparedWalks<S> {
    /// Computes the constants of projection of the rays with indices `ray` in `rays`.
    #[inline(always)]
    pub(super) fn of_rays(s: S, m: S::M, rays: &[Ray], ray: S::U) -> Self {
        s.call(OfRays(m, rays, ray))
    }

    /// Implements [`Self::of_rays`].
    #[inline(always)]
    fn prepare(s: S, m: S::M, rays: &[Ray], ray: S::U) -> Self {
        let [ox, oy, oz, tmin, dx, dy, dz, tmax] = prepare::gather_rays(s, m, rays, ray);
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let size = three!(|k| s.abs(d[k]));
        let greatest = s.max(size[0], s.max(size[1], size[2]));
        // Comparisons with NaN are false, so rays with NaN are excluded.
        let mut representable = s.and(m, s.le(tmin, tmax));
        representable = s.and(representable, s.le(s.splat(LEAST_DIRECTION), greatest));
        for k in 0..3 {
            representable = s.and(representable, s.le(s.abs(o[k]), s.splat(GREATEST_ORIGIN)));
            representable = s.and(representable, s.le(size[k], s.splat(GREATEST_DIRECTION)));
        }
        // The axis of the depth is the axis of the direction's largest |component|.
        let is_x = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
        let is_y = s.and_not(s.lt(size[2], size[1]), is_x);
        let axis = s.select_u(is_x, s.splat_u(0), s.select_u(is_y, s.splat_u(1), s.splat_u(2)));
        let mut lanes = Lanes::idle(s);
        lanes.words[word::AXIS] = axis;
        let depth = lanes.permute(s, d)[2];
        let negative = s.lt(depth, s.splat(0.0));
        let per_t = s.abs(depth);
        lanes.words[word::SIGN] = s.select_u(negative, s.splat_u(1 << 31), s.splat_u(0));
        let (origin, direction) = (lanes.permute(s, o), lanes.permute(s, d));
        lanes.floats[float::ORIGIN..float::ORIGIN + 3].copy_from_slice(&origin);
        lanes.floats[float::SHEAR] = s.div(direction[0], per_t);
        lanes.floats[float::SHEAR + 1] = s.div(direction[1], per_t);
        lanes.words[word::RAY] = ray;
        let depth = s.mul(tmax, per_t);
        lanes.floats[float::LIMIT] = s.add(depth, slack(s, depth));
        PreparedWalks { lanes, representable }
    }

    /// Projects faces with these vertices and sets them as the entered faces.
    #[inline(always)]
    fn set_face(&mut self, s: S, m: S::M, vertices: &[[f32; 4]], face: [S::U; 3]) {
        s.call(SetFace { lanes: &mut self.lanes, m, vertices, face });
    }

    /// Prepares the rays with indices `ray` in `rays`, whose walks begin at the faces with the
    /// vertices `face`.
    #[inline(always)]
    pub(super) fn new(
        s: S,
        m: S::M,
        rays: &[Ray],
        vertices: &[[f32; 4]],
        ray: S::U,
        face: [S::U; 3],
    ) -> Self {
        let mut prepared = Self::of_rays(s, m, rays, ray);
        prepared.set_face(s, m, vertices, face);
        prepared
    }

    /// Prepares the rays with indices `ray` at the faces of `hull` through which their lines enter
    /// a leaf. Also returns the lanes whose line certainly enters, and those whose line certainly
    /// misses the hull.
    #[inline(always)]
    pub(super) fn from_hull(
        s: S,
        m: S::M,
        rays: &[Ray],
        vertices: &[[f32; 4]],
        hull: &[HullFace],
        ray: S::U,
    ) -> (Self, S::M, S::M) {
        let mut prepared = Self::of_rays(s, m, rays, ray);
        let (mut entered, mut uncertain) = (s.mask(0), s.mask(0));
        let [mut tet, mut apex] = [s.splat_u(0); 2];
        let mut entry = [s.splat_u(0); 3];
        for face in hull {
            let vertex = three!(|i| s.splat_u(face.vertex[i]));
            prepared.set_face(s, m, vertices, vertex);
            let lanes = &prepared.lanes;
            let extent = Extent { reach: lanes.floats[float::REACH], size: lanes.floats[float::SIZE] };
            let bound = extent.bound(s, extent.size);
            let mut inwards = m;
            for i in 0..3 {
                let value = cross(s, &lanes.corner(i), &lanes.corner((i + 1) % 3));
                inwards = s.and(inwards, s.lt(bound, value));
                uncertain = s.or(uncertain, s.and_not(m, s.lt(bound, s.abs(value))));
            }
            entered = s.or(entered, inwards);
            tet = s.select_u(inwards, s.splat_u(face.tet), tet);
            apex = s.select_u(inwards, s.splat_u(face.opposite), apex);
            entry = three!(|i| s.select_u(inwards, vertex[i], entry[i]));
        }
        let certain = s.and_not(prepared.representable, uncertain);
        let entered = s.and(certain, entered);
        prepared.set_face(s, entered, vertices, entry);
        prepared.lanes.words[word::TET] = tet;
        prepared.lanes.words[word::APEX] = apex;
        (prepared, entered, s.and_not(certain, entered))
    }
}
