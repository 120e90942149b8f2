//! Rays made ready to walk, in wait for lanes that are free.

use super::tet_lanes::{Extent, Lanes, cross, float, three, word};
use crate::layout::{HullFace, NONE, TetFace};
use crate::simd::{LANES, Simd};

/// Origins beyond this (2^59) and directions out of 2^±40 are left to f64: products of theirs could overflow f32 or
/// underflow. Depths are then t times between 2^-40 and 2^40.
const GREATEST_ORIGIN: f32 = (1u64 << 59) as f32;
const GREATEST_DIRECTION: f32 = (1u64 << 40) as f32;
const LEAST_DIRECTION: f32 = 1.0 / (1u64 << 40) as f32;
/// Depths and bounds of t are compared with this much to spare, relative to them, and that absolutely: all
/// roundings together are smaller, and so is the least f32 times the least direction.
const SPARE: f32 = 1.0 / (1 << 20) as f32;
const LEAST_SPARE: f32 = 1.0 / (1u128 << 100) as f32;
/// Products of three lengths from within this reach (2^40) do not overflow; and what underflows of them is less than
/// 2^-120.
const GREATEST_REACH: f32 = GREATEST_DIRECTION;
const LEAST_VOLUME: f32 = 1.0 / (1u128 << 120) as f32;

/// Most rays that wait.
const CAPACITY: usize = 4 * LANES;

/// Rows of rays that wait, one a field of [`Lanes`]; lanes are taken from the front and packed to the back.
pub(super) struct Queue {
    words: [[u32; CAPACITY + LANES]; word::COUNT],
    floats: [[f32; CAPACITY + LANES]; float::COUNT],
    first: usize,
    end: usize,
}

/// Sixteen elements of a row.
#[inline(always)]
fn sixteen<T>(row: &[T; CAPACITY + LANES], at: usize) -> &[T; LANES] {
    row[at..].first_chunk().expect("rows have sixteen elements to spare")
}

#[inline(always)]
fn sixteen_mut<T>(row: &mut [T; CAPACITY + LANES], at: usize) -> &mut [T; LANES] {
    row[at..].first_chunk_mut().expect("rows have sixteen elements to spare")
}

impl Queue {
    pub(super) fn new() -> Self {
        Queue {
            words: [[0; CAPACITY + LANES]; word::COUNT],
            floats: [[0.0; CAPACITY + LANES]; float::COUNT],
            first: 0,
            end: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.end - self.first
    }

    /// Starts over; nothing may wait.
    pub(super) fn rewind(&mut self) {
        debug_assert_eq!(self.len(), 0);
        (self.first, self.end) = (0, 0);
    }

    /// Whether sixteen more have room.
    pub(super) fn has_room(&self) -> bool {
        self.end + LANES <= CAPACITY
    }

    /// Adds the lanes whose bit is set.
    #[inline(always)]
    pub(super) fn push<S: Simd>(&mut self, s: S, bits: u32, lanes: &Lanes<S>) {
        macro_rules! push {
            ($values:ident $compress:ident $($i:literal)*) => { $(
                s.$compress(bits, lanes.$values[$i], sixteen_mut(&mut self.$values[$i], self.end));
            )* };
        }
        push!(words compress 0 1 2 3 4 5 6 7 8 9 10);
        push!(floats compress_f 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        self.end += bits.count_ones() as usize;
    }

    /// Fills as many of the lanes as there are rays; returns which.
    #[inline(always)]
    pub(super) fn pop<S: Simd>(&mut self, s: S, idle: u32, lanes: &mut Lanes<S>) -> u32 {
        let mut taken = idle;
        while taken.count_ones() as usize > self.len() {
            taken &= taken - 1;
        }
        let m = s.mask(taken);
        // Written out, so that the lanes can stay in registers.
        macro_rules! pop {
            ($values:ident $expand:ident $($i:literal)*) => { $(
                lanes.$values[$i] = s.$expand(lanes.$values[$i], m, sixteen(&self.$values[$i], self.first));
            )* };
        }
        pop!(words expand_u 0 1 2 3 4 5 6 7 8 9 10);
        pop!(floats expand 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        self.first += taken.count_ones() as usize;
        taken
    }
}

/// Rays as words of f32: origin, tmin, direction, tmax.
const RAY_WORDS: u32 = 3;
/// log2 of the words of a [`TetFace`].
const FACE_WORDS: u32 = 3;

/// An element of rows.
#[inline(always)]
fn column<S: Simd>(s: S, m: S::M, rows: &[f32], row: S::U, k: u32) -> S::F {
    s.gather(m, rows, s.add_u(row, s.splat_u(k)))
}

#[inline(always)]
fn column_u<S: Simd>(s: S, m: S::M, rows: &[u32], row: S::U, k: u32) -> S::U {
    s.gather_u(m, rows, s.add_u(row, s.splat_u(k)))
}

/// The component of a vector along an axis.
#[inline(always)]
fn pick<S: Simd>(s: S, axis: S::U, v: [S::F; 3]) -> S::F {
    let rest = s.select(s.eq_u(axis, s.splat_u(1)), v[1], v[2]);
    s.select(s.eq_u(axis, s.splat_u(0)), v[0], rest)
}

#[inline(always)]
fn spare<S: Simd>(s: S, depth: S::F) -> S::F {
    s.fma(s.abs(depth), s.splat(SPARE), s.splat(LEAST_SPARE))
}

/// Rays set up for projection, and their faces projected.
pub(super) struct Ready<S: Simd> {
    pub(super) lanes: Lanes<S>,
    /// tmin as a depth, less a little.
    tmin_low: S::F,
    /// The lanes whose rays f32 can take.
    pub(super) able: S::M,
}

impl<S: Simd> Ready<S> {
    /// Prepares the rays `slot` of the batch, without any place yet.
    #[inline(always)]
    fn of_rays(s: S, m: S::M, rays: &[f32], slot: S::U) -> Self {
        let row = s.shl_u::<RAY_WORDS>(slot);
        let o = three!(|k| column(s, m, rays, row, k));
        let tmin = column(s, m, rays, row, 3);
        let d = three!(|k| column(s, m, rays, row, 4 + k));
        let tmax = column(s, m, rays, row, 7);
        let size = three!(|k| s.abs(d[k]));
        let greatest = s.max(size[0], s.max(size[1], size[2]));
        // Comparisons with NaN are false.
        let mut able = s.and(m, s.le(tmin, tmax));
        able = s.and(able, s.le(s.splat(LEAST_DIRECTION), greatest));
        for k in 0..3 {
            able = s.and(able, s.le(s.abs(o[k]), s.splat(GREATEST_ORIGIN)));
            able = s.and(able, s.le(size[k], s.splat(GREATEST_DIRECTION)));
        }
        // The axis of the depth; the two that follow it in turn, swapped where the ray goes down.
        let along0 = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
        let along1 = s.and_not(s.lt(size[2], size[1]), along0);
        let axis = s.select_u(along0, s.splat_u(0), s.select_u(along1, s.splat_u(1), s.splat_u(2)));
        let next = s.select_u(along0, s.splat_u(1), s.select_u(along1, s.splat_u(2), s.splat_u(0)));
        let last = s.xor_u(s.xor_u(axis, next), s.splat_u(3));
        let depth = pick(s, axis, d);
        let down = s.lt(depth, s.splat(0.0));
        let per_t = s.abs(depth);
        let axes = [s.select_u(down, last, next), s.select_u(down, next, last), axis];
        let mut lanes = Lanes::idle(s);
        for (k, axis) in axes.into_iter().enumerate() {
            lanes.words[word::AXIS + k] = axis;
            lanes.floats[float::ORIGIN + k] = pick(s, axis, o);
        }
        lanes.floats[float::SHEAR] = s.div(pick(s, axes[0], d), per_t);
        lanes.floats[float::SHEAR + 1] = s.div(pick(s, axes[1], d), per_t);
        lanes.words[word::SIGN] = s.select_u(down, s.splat_u(1 << 31), s.splat_u(0));
        lanes.words[word::SLOT] = slot;
        let (low, high) = (s.mul(tmin, per_t), s.mul(tmax, per_t));
        lanes.floats[float::LIMIT] = s.add(high, spare(s, high));
        Ready { lanes, tmin_low: s.sub(low, spare(s, low)), able }
    }

    /// Projects the faces.
    #[inline(always)]
    fn set_face(&mut self, s: S, m: S::M, vertices: &[[f32; 4]], face: [S::U; 3]) {
        let lanes = &mut self.lanes;
        let mut extent = Extent::least(s);
        for (i, vertex) in face.into_iter().enumerate() {
            let corner = lanes.project(s, lanes.gather(s, m, vertices, vertex));
            extent = extent.with(s, &corner).0;
            lanes.words[word::FACE + i] = vertex;
            lanes.floats[float::X + i] = corner.x;
            lanes.floats[float::Y + i] = corner.y;
            lanes.floats[float::DEPTH + i] = corner.depth;
        }
        lanes.floats[float::REACH] = extent.reach;
        lanes.floats[float::SIZE] = extent.size;
    }

    /// Prepares the rays `slot` of the batch, to the projection of their faces.
    #[inline(always)]
    pub(super) fn new(
        s: S,
        m: S::M,
        rays: &[f32],
        vertices: &[[f32; 4]],
        slot: S::U,
        face: [S::U; 3],
    ) -> Self {
        let mut ready = Self::of_rays(s, m, rays, slot);
        ready.set_face(s, m, vertices, face);
        ready
    }

    /// Prepares rays to walk from where their lines enter a hull. Returns also which certainly do, and which
    /// certainly miss it.
    #[inline(always)]
    pub(super) fn from_hull(
        s: S,
        m: S::M,
        rays: &[f32],
        vertices: &[[f32; 4]],
        hull: &[HullFace],
        slot: S::U,
    ) -> (Self, S::M, S::M) {
        let mut ready = Self::of_rays(s, m, rays, slot);
        let (mut entered, mut in_doubt) = (s.mask(0), s.mask(0));
        let [mut tet, mut apex] = [s.splat_u(0); 2];
        let mut entry = [s.splat_u(0); 3];
        for face in hull {
            let vertex = three!(|i| s.splat_u(face.vertex[i]));
            ready.set_face(s, m, vertices, vertex);
            let lanes = &ready.lanes;
            let extent = Extent { reach: lanes.floats[float::REACH], size: lanes.floats[float::SIZE] };
            let bound = extent.bound(s, extent.size);
            let mut inwards = m;
            for i in 0..3 {
                let value = cross(s, &lanes.corner(i), &lanes.corner((i + 1) % 3));
                inwards = s.and(inwards, s.lt(bound, value));
                in_doubt = s.or(in_doubt, s.and_not(m, s.lt(bound, s.abs(value))));
            }
            entered = s.or(entered, inwards);
            tet = s.select_u(inwards, s.splat_u(face.tet), tet);
            apex = s.select_u(inwards, s.splat_u(face.opposite), apex);
            entry = three!(|i| s.select_u(inwards, vertex[i], entry[i]));
        }
        let certain = s.and_not(ready.able, in_doubt);
        let entered = s.and(certain, entered);
        ready.set_face(s, entered, vertices, entry);
        ready.lanes.words[word::TET] = tet;
        ready.lanes.words[word::APEX] = apex;
        ready.lanes.words[word::BEHIND] = s.splat_u(NONE);
        (ready, entered, s.and_not(certain, entered))
    }

    /// Prepares rays that start about constrained faces to walk from these, and returns which can: those whose lines
    /// certainly cross the face, certainly before the ray begins. All that a line meets afterwards in the leaf
    /// comes in order, so wherever the origin is in between, nothing is left out.
    #[inline(always)]
    pub(super) fn from_faces(
        s: S,
        m: S::M,
        rays: &[f32],
        vertices: &[[f32; 4]],
        faces: &[u32],
        slot: S::U,
        face: S::U,
    ) -> (Self, S::M) {
        let row = s.shl_u::<FACE_WORDS>(face);
        const VERTEX: u32 = std::mem::offset_of!(TetFace, vertex) as u32 / 4;
        const TET: u32 = std::mem::offset_of!(TetFace, tet) as u32 / 4;
        const OPPOSITE: u32 = std::mem::offset_of!(TetFace, opposite) as u32 / 4;
        let vertex = three!(|k| column_u(s, m, faces, row, VERTEX + k));
        let mut ready = Ready::new(s, m, rays, vertices, slot, vertex);
        let lanes = &mut ready.lanes;
        let corner = three!(|i| lanes.corner(i));
        let extent = Extent { reach: lanes.floats[float::REACH], size: lanes.floats[float::SIZE] };
        let bound = extent.bound(s, extent.size);
        let minus = s.sub(s.splat(0.0), bound);
        let (mut up, mut down) = (ready.able, ready.able);
        let (mut area, mut volume) = (s.splat(0.0), s.splat(0.0));
        for i in 0..3 {
            let value = cross(s, &corner[i], &corner[(i + 1) % 3]);
            (up, down) = (s.and(up, s.lt(bound, value)), s.and(down, s.lt(value, minus)));
            let weight = s.abs(value);
            area = s.add(area, weight);
            volume = s.fma(weight, corner[(i + 2) % 3].depth, volume);
        }
        // volume / area is the depth of the crossing; both are off by their bounds and roundings.
        let low = ready.tmin_low;
        let mut farthest = s.abs(low);
        for p in &corner {
            farthest = s.max(s.abs(p.depth), farthest);
        }
        let doubt = s.fma(area, s.splat(SPARE), s.mul(bound, s.splat(6.0)));
        let behind = s.lt(s.fma(doubt, farthest, s.add(volume, s.splat(LEAST_VOLUME))), s.mul(low, area));
        let near = s.le(lanes.floats[float::REACH], s.splat(GREATEST_REACH));
        let able = s.and(s.or(up, down), s.and(behind, near));
        // The face turns around for those that go against its normal.
        let side = s.select_u(up, row, s.add_u(row, s.splat_u(1)));
        lanes.words[word::TET] = column_u(s, m, faces, side, TET);
        lanes.words[word::APEX] = column_u(s, m, faces, side, OPPOSITE);
        lanes.words[word::BEHIND] = s.or_u(face, s.splat_u(crate::layout::FACE_BIT));
        let [_, v1, v2] = vertex;
        lanes.words[word::FACE + 1] = s.select_u(up, v1, v2);
        lanes.words[word::FACE + 2] = s.select_u(up, v2, v1);
        for k in [float::X, float::Y, float::DEPTH] {
            let (p1, p2) = (lanes.floats[k + 1], lanes.floats[k + 2]);
            lanes.floats[k + 1] = s.select(up, p1, p2);
            lanes.floats[k + 2] = s.select(up, p2, p1);
        }
        (ready, able)
    }
}
