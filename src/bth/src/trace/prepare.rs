//! Sixteen rays prepared for the BVH at once, in f32 lanes.
//!
//! To the bounds that [`Slabs`] and [`Sight`] demand, though not to the same bits as their own constructors, which
//! compute in f64. Rays that f32 can't prepare so are left to those.

use super::sight::{self, Sight};
use super::slabs::{self, Slabs};
use crate::layout::{NONE, Object};
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use std::mem::offset_of;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Directions of this size or its inverse, and coordinates up to it, are prepared in f32.
const LARGEST: f32 = (1u64 << 40) as f32;
/// Where all coordinates are smaller, pads underflow.
const SMALLEST: f32 = slabs::SMALLEST_EXTENT as f32;
/// What lower bounds of a few f32 roundings are multiplied by, to bound from above.
const UP: f32 = 1.0 + 1.0 / (1 << 20) as f32;
/// What is the same for all rays through an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    lower: [f32; 3],
    upper: [f32; 3],
    farthest: f32,
}

/// The greater; `b` where either is NaN. One instruction, which `f32::max` is not.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Frame {
    pub(crate) fn new(object: &Object) -> Frame {
        let corners = object.lower.iter().chain(&object.upper);
        let farthest = corners.fold(0.0, |m: f32, x| greater(x.abs(), m));
        Frame { lower: object.lower, upper: object.upper, farthest }
    }

    /// The frame of boxes whose coordinates do not exceed this.
    pub(crate) fn around(farthest: f32) -> Frame {
        Frame { lower: [-farthest; 3], upper: [farthest; 3], farthest }
    }

    /// The greatest coordinate in play for origins whose coordinates do not exceed this, seen from any of them.
    #[inline(always)]
    pub(crate) fn extent(&self, farthest_origin: f32) -> f32 {
        (self.farthest + farthest_origin) * UP
    }

    /// The longest side of the object's box.
    #[inline(always)]
    pub(crate) fn size(&self) -> f32 {
        (0..3).fold(0.0, |m: f32, k| m.max(self.upper[k] - self.lower[k]))
    }
}

/// A ray prepared for boxes, and for triangles: a cache line each, so that a step of a ray among many on their way needs no
/// more of the innermost cache than one of them.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct Aim {
    pub(crate) slabs: Slabs,
    /// Its place in the batch.
    pub(crate) ray: u32,
    pub(crate) sight: Sight,
    pub(crate) noted: Noted,
}

const _: () = assert!(offset_of!(Aim, sight) == 64 && size_of::<Aim>() == 128);

/// What the walk of a ray has come upon.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct Noted {
    /// Lower bound of the depth of the nearest hit so far.
    pub(crate) nearest: f32,
    /// Leaf of the nearest hit so far, if it is certain but where it is has still to be computed; else `NONE`. Most rays come
    /// upon several hits, each nearer than the last, and only the last is worth f64.
    pub(crate) leaf: u32,
    /// Triangle of that leaf.
    pub(crate) triangle: u16,
    /// What has been decided so far.
    pub(crate) decided: u16,
}

impl Noted {
    pub(crate) const NOTHING: Noted =
        Noted { nearest: f32::INFINITY, leaf: NONE, triangle: 0, decided: Noted::NEVER_ASKED };

    /// Nothing: the ray's query has not been made.
    pub(crate) const NEVER_ASKED: u16 = 0;
    /// What the ray's query says.
    pub(crate) const ASKED: u16 = 1;
    /// That something is certainly hit, which is all that was asked.
    pub(crate) const ACCEPTED: u16 = 2;
}

impl Aim {
    pub(crate) fn new(slabs: Slabs, sight: Sight) -> Aim {
        Aim { slabs, ray: 0, sight, noted: Noted::NOTHING }
    }
}

impl Aim {
    /// A single ray, to the same bounds as [`Prepared::fill`]; false where f32 can't prepare it. Written in place: copies of
    /// what was just written word by word stall.
    #[inline(always)]
    pub(crate) fn set(&mut self, frame: &Frame, ray: &Ray) -> bool {
        let (o, d) = (&ray.origin, &ray.direction);
        let size = [d[0].abs(), d[1].abs(), d[2].abs()];
        // Without branches, which rays of all directions would mislead.
        let is_x = (size[0] > size[1]) & (size[0] > size[2]);
        let z = if is_x { 0 } else { 2 - usize::from(size[1] > size[2]) };
        let greatest = greater(greater(size[0], size[1]), size[2]);
        let (mut reach, mut farthest) = (0f32, 0f32);
        for k in 0..3 {
            let (low, high) = ((frame.lower[k] - o[k]).abs(), (frame.upper[k] - o[k]).abs());
            reach = greater(greater(low, high), reach);
            farthest = greater(o[k].abs(), farthest);
        }
        let extent = frame.extent(farthest);
        // Sums, because the greater of NaN and a number may be the number.
        let finite = reach + (o[0] + o[1] + o[2]).abs() + (size[0] + size[1] + size[2]);
        if !(greatest > 1.0 / LARGEST
            && finite < LARGEST
            && SMALLEST < extent
            && extent < LARGEST
            && ray.tmin <= ray.tmax)
        {
            return false;
        }
        let pad = extent * slabs::PAD as f32;
        let least = greatest * slabs::LEAST_COMPONENT as f32;
        let Aim { slabs, sight, .. } = self;
        for k in 0..3 {
            let magnitude = greatest / greater(size[k], least);
            let reciprocal = magnitude.copysign(d[k]);
            let (middle, pad) = (o[k] * reciprocal, pad * magnitude);
            slabs.reciprocal[k] = reciprocal;
            slabs.near_addend[k] = -(middle + pad);
            slabs.far_addend[k] = pad - middle;
            slabs.near[k] = (d[k].to_bits() >> 31) * slabs::FAR;
        }
        let backward = d[z] < 0.0;
        const PLANE: [[[usize; 2]; 3]; 2] = [[[1, 2], [2, 0], [0, 1]], [[2, 1], [0, 2], [1, 0]]];
        let [x, y] = PLANE[usize::from(backward)][z];
        let inverse = 1.0 / greatest;
        let forward = if backward { -1.0 } else { 1.0 };
        // Not a denormal number on the way: those cost a hundred cycles.
        let least = (greatest + 1.0) * f32::MIN_POSITIVE;
        let slack = |t: f32| t.abs() * (4.0 / (1 << 24) as f32) + least;
        let first = (ray.tmin * greatest).max(-f32::MAX);
        let limit = ray.tmax * greatest;
        let last = (ray.tmax.min(f32::MAX) * greatest).min(f32::MAX);
        slabs.scale = greatest;
        slabs.first = first - slack(first);
        slabs.last = limit + slack(limit);
        sight.axis = [x as u32, y as u32, z as u32];
        [sight.error_slope, sight.error_floor] = sight::errors(reach);
        sight.origin = [o[x], o[y]];
        sight.shear = [d[x] * inverse, d[y] * inverse];
        sight.forward = forward;
        sight.start = -o[z] * forward;
        sight.first = first + slack(first);
        sight.last = last - slack(last);
        true
    }
}

/// Sixteen rays, prepared.
#[derive(Debug)]
pub(crate) struct Prepared {
    aim: [[[f32; LANES]; 2]; LANES],
    /// Lanes that are prepared; the others need the constructors.
    ready: u32,
}

/// The lane of the axis along the ray, of the one after and of the one before.
#[inline(always)]
fn choose<S: Simd>(s: S, is_x: S::M, is_y: S::M, [x, y, z]: [S::F; 3]) -> S::F {
    s.select(is_x, x, s.select(is_y, y, z))
}

impl Prepared {
    pub(crate) fn new() -> Prepared {
        Prepared { aim: [[[0.0; LANES]; 2]; LANES], ready: 0 }
    }

    /// What a lane holds, if it could be prepared.
    #[inline(always)]
    pub(crate) fn aim(&self, lane: usize) -> Option<&Aim> {
        let aim = Aim::ref_from_bytes(self.aim[lane % LANES].as_bytes()).expect("of this size");
        (self.ready >> (lane % LANES) & 1 != 0).then_some(aim)
    }

    /// Prepares the rays at these places, as many as `count`.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        s: S,
        frame: &Frame,
        rays: &[Ray],
        at: &[u32; LANES],
        count: usize,
    ) {
        let wanted = s.mask(((1u64 << count) - 1) as u32);
        let field = fields(s, wanted, rays, s.load_u(at));
        let (mut aim, usable) = rows(s, frame, field);
        aim[offset_of!(Aim, ray) / 4] = s.floats(s.load_u(at));
        let nothing: [u32; 3] = zerocopy::transmute!(Noted::NOTHING);
        for (k, word) in nothing.into_iter().enumerate() {
            aim[offset_of!(Aim, noted) / 4 + k] = s.floats(s.splat_u(word));
        }
        for half in 0..2 {
            let mut rows = [s.splat(0.0); LANES];
            for i in 0..LANES {
                rows[i] = aim[half * LANES + i];
            }
            let rows = s.transpose(rows);
            for lane in 0..LANES {
                s.store(rows[lane], &mut self.aim[lane][half]);
            }
        }
        self.ready = s.mask_bits(s.and(wanted, usable));
    }
}

/// The floats of rays, a row of lanes for each.
#[inline(always)]
pub(crate) fn fields<S: Simd>(s: S, m: S::M, rays: &[Ray], at: S::U) -> [S::F; 8] {
    let words = s.rows8(m, Ray::rows(rays), at);
    let mut out = [s.splat(0.0); 8];
    for k in 0..8 {
        out[k] = s.floats(words[k]);
    }
    out
}

/// The floats of the [`Aim`]s of sixteen rays, a row of lanes for each, and the lanes that they are good for; from the rays'
/// own floats.
#[inline(always)]
pub(crate) fn rows<S: Simd>(s: S, frame: &Frame, field: [S::F; 8]) -> ([S::F; 2 * LANES], S::M) {
    let [ox, oy, oz, tmin, dx, dy, dz, tmax] = field;
    let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
    let size = [s.abs(dx), s.abs(dy), s.abs(dz)];
    let zero = s.splat(0.0);
    let is_x = s.and(s.lt(size[1], size[0]), s.lt(size[2], size[0]));
    let is_y = s.and_not(s.lt(size[2], size[1]), is_x);
    let greatest = s.max(s.max(size[0], size[1]), size[2]);

    let mut reach = zero;
    let mut farthest = zero;
    let mut finite = s.and(s.lt(s.splat(1.0 / LARGEST), greatest), s.lt(greatest, s.splat(LARGEST)));
    for k in 0..3 {
        let far =
            s.max(s.abs(s.sub(s.splat(frame.lower[k]), o[k])), s.abs(s.sub(s.splat(frame.upper[k]), o[k])));
        reach = s.max(far, reach);
        farthest = s.max(s.abs(o[k]), farthest);
        // Also false for NaN, which `max` may drop.
        finite = s.and(finite, s.and(s.lt(far, s.splat(LARGEST)), s.lt(size[k], s.splat(LARGEST))));
    }
    let extent = s.mul(s.add(s.splat(frame.farthest), farthest), s.splat(UP));
    finite = s.and(finite, s.and(s.lt(s.splat(SMALLEST), extent), s.lt(extent, s.splat(LARGEST))));
    let pad = s.mul(extent, s.splat(slabs::PAD as f32));
    let least = s.mul(greatest, s.splat(slabs::LEAST_COMPONENT as f32));
    let mut aim = [zero; 2 * LANES];
    for k in 0..3 {
        let magnitude = s.div(greatest, s.max(size[k], least));
        let sign = s.and_u(s.bits(d[k]), s.splat_u(1 << 31));
        let reciprocal = s.floats(s.or_u(s.bits(magnitude), sign));
        let (middle, pad) = (s.mul(o[k], reciprocal), s.mul(pad, magnitude));
        let negative = s.lt_u(s.splat_u(i32::MAX as u32), sign);
        aim[k] = reciprocal;
        aim[4 + k] = s.sub(zero, s.add(middle, pad));
        aim[8 + k] = s.sub(pad, middle);
        aim[12 + k] = s.floats(s.select_u(negative, s.splat_u(slabs::FAR), s.splat_u(0)));
    }

    // The axes of the plane: in cyclic order for a ray that goes up along the third, else the other way round.
    let depth = choose(s, is_x, is_y, d);
    let backward = s.lt(depth, zero);
    let (next, last) = ([d[1], d[2], d[0]], [d[2], d[0], d[1]]);
    let (next, last) = (choose(s, is_x, is_y, next), choose(s, is_x, is_y, last));
    let inverse = s.div(s.splat(1.0), greatest);
    let shear = [s.select(backward, last, next), s.select(backward, next, last)];
    let (next, last) = ([o[1], o[2], o[0]], [o[2], o[0], o[1]]);
    let (next, last) = (choose(s, is_x, is_y, next), choose(s, is_x, is_y, last));
    let origin = [s.select(backward, last, next), s.select(backward, next, last)];
    let z = s.select_u(is_x, s.splat_u(0), s.select_u(is_y, s.splat_u(1), s.splat_u(2)));
    let next = s.select_u(is_x, s.splat_u(1), s.select_u(is_y, s.splat_u(2), s.splat_u(0)));
    let last = s.select_u(is_x, s.splat_u(2), s.select_u(is_y, s.splat_u(0), s.splat_u(1)));
    let forward = s.select(backward, s.splat(-1.0), s.splat(1.0));
    aim[16] = s.floats(s.select_u(backward, last, next));
    aim[17] = s.floats(s.select_u(backward, next, last));
    aim[18] = s.floats(z);
    aim[28] = s.mul(reach, s.splat(sight::ERROR_SLOPE));
    aim[19] = s.fma(aim[28], aim[28], s.splat(f32::MIN_POSITIVE));
    aim[20] = origin[0];
    aim[21] = origin[1];
    aim[22] = s.mul(shear[0], inverse);
    aim[23] = s.mul(shear[1], inverse);
    aim[24] = forward;
    aim[25] = s.fnma(choose(s, is_x, is_y, o), forward, zero);

    // What rounding and underflow can take from t, as depth.
    let least = s.mul(s.add(greatest, s.splat(1.0)), s.splat(f32::MIN_POSITIVE));
    let ulps = s.splat(4.0 / (1 << 24) as f32);
    let first = s.max(s.mul(tmin, greatest), s.splat(-f32::MAX));
    let slack = s.fma(s.abs(first), ulps, least);
    aim[3] = greatest;
    aim[7] = s.sub(first, slack);
    aim[26] = s.add(first, slack);
    let last = s.mul(tmax, greatest);
    aim[11] = s.add(last, s.fma(s.abs(last), ulps, least));
    let last = s.min(s.mul(s.min(tmax, s.splat(f32::MAX)), greatest), s.splat(f32::MAX));
    aim[27] = s.sub(last, s.fma(s.abs(last), ulps, least));
    (aim, s.and(finite, s.le(tmin, tmax)))
}
