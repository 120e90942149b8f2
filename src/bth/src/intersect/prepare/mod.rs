//! Sixteen rays prepared for the BVH at once, in f32 lanes.
//!
//! To the bounds that [`RaySlabs`] and [`TriangleFilter`] demand, though not to the same bits as their own constructors, which
//! compute in f64. Rays that f32 can't prepare so are left to those.

mod axes;
mod lanes;
#[cfg(test)]
mod tests;

pub(crate) use self::axes::{Axes, Common, Mixed};
pub(crate) use self::lanes::{Lanes, fields, fields_of, lanes};
use crate::intersect::boxes::{self, RaySlabs};
use crate::intersect::filter::{self, TriangleFilter};
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::{NONE, Object};
use bth_format::object::ObjectBounds;
use glam::{Vec3A, Vec4};
use std::mem::offset_of;
use std::ops::Range;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Directions of this size or its inverse, and coordinates up to it, are prepared in f32.
const LARGEST: f32 = (1u64 << 40) as f32;
/// Where all coordinates are smaller, pads underflow.
const SMALLEST: f32 = boxes::SMALLEST_EXTENT as f32;
/// What lower bounds of a few f32 roundings are multiplied by, to bound from above.
const UP: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// The lesser; `b` where either is NaN.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Upper bound of |coordinate of the box| + |coordinate of an origin|, for origins whose coordinates do not exceed
/// `greatest_origin`.
#[inline(always)]
pub(crate) fn extent(bounds: &ObjectBounds, greatest_origin: f32) -> f32 {
    (bounds.greatest + greatest_origin) * UP
}

/// A ray prepared for boxes and for triangles, and what its walk notes: a cache line for steps through nodes and one for leaves,
/// so that rays on their way take as little of the innermost cache as can be.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct PreparedRay {
    pub(crate) slabs: RaySlabs,
    /// Its place in the batch.
    pub(crate) ray: u32,
    pub(crate) sight: TriangleFilter,
    pub(crate) noted: HitProgress,
}

/// The first line of an [`PreparedRay`].
#[derive(FromBytes)]
#[repr(C)]
struct FirstLine {
    slabs: RaySlabs,
    _ray: u32,
}

const _: () = assert!(offset_of!(PreparedRay, sight) == 64 && size_of::<PreparedRay>() == 128);

/// What the walk of a ray has come upon.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct HitProgress {
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

impl HitProgress {
    pub(crate) const NOTHING: HitProgress =
        HitProgress { nearest: f32::INFINITY, leaf: NONE, triangle: 0, decided: HitProgress::UNDECIDED };

    /// Nothing: the ray's query has not been made.
    pub(crate) const UNDECIDED: u16 = 0;
    /// What the ray's query says.
    pub(crate) const BY_QUERY: u16 = 1;
    /// That something is certainly hit, which is all that was asked.
    pub(crate) const ACCEPTED: u16 = 2;
}

impl PreparedRay {
    pub(crate) fn new(slabs: RaySlabs, sight: TriangleFilter) -> PreparedRay {
        PreparedRay { slabs, ray: 0, sight, noted: HitProgress::NOTHING }
    }

    /// A single ray, to the same bounds as [`Prepared::fill`]; none where f32 can't prepare it.
    #[inline(always)]
    pub(crate) fn of(bounds: &ObjectBounds, ray: &Ray) -> Option<PreparedRay> {
        let [start, end]: [[f32; 4]; 2] = zerocopy::transmute!(*ray);
        let ([.., tmin], [dx, dy, dz, tmax]) = (start, end);
        let (o, d) = (Vec3A::from_vec4(Vec4::from_array(start)), Vec3A::from_vec4(Vec4::from_array(end)));
        let (size, start) = (d.abs(), o.abs());
        let [lower, upper] = [bounds.lower, bounds.upper].map(|p| Vec3A::from_vec4(Vec4::from_array(p)));
        let far = (lower - o).abs().max((upper - o).abs());
        let (greatest, reach) = (size.max_element(), far.max_element());
        let extent = extent(bounds, start.max_element());
        // Each by itself, because the greater of NaN and a number may be the number.
        let finite = size.cmplt(Vec3A::splat(LARGEST)) & start.cmplt(Vec3A::splat(LARGEST));
        let in_range = (greatest > 1.0 / LARGEST) & (SMALLEST < extent) & (extent < LARGEST);
        if !(finite.all() & in_range & (tmin <= tmax)) {
            return None;
        }
        let least = Vec3A::splat(greatest * boxes::LEAST_COMPONENT as f32);
        let magnitude = Vec3A::splat(greatest) / size.max(least);
        let reciprocal = magnitude.copysign(d);
        let (middle, pad) = (o * reciprocal, magnitude * (extent * boxes::PAD as f32));
        // Without branches, which rays of all directions would mislead.
        let z = (size.cmpeq(Vec3A::splat(greatest)).bitmask().trailing_zeros() as usize).min(2);
        let [x, y, _] = Common(z).order();
        let (inverse, forward) = (1.0 / greatest, 1f32.copysign(ray.direction[z]));
        // Depths of tmin and tmax, twice: bounds of all that matters, and of what is certain to be in range.
        const LEAST: Vec4 = Vec4::splat(-f32::MAX);
        const GREATEST: Vec4 = Vec4::new(f32::MAX, f32::INFINITY, f32::MAX, f32::MAX);
        let depths = Vec4::new(tmin, tmax, tmin, lesser(tmax, f32::MAX)) * greatest;
        let depths = depths.max(LEAST).min(GREATEST);
        // Not a denormal number on the way: those cost a hundred cycles.
        let slack = depths.abs() * (4.0 / (1 << 24) as f32) + (greatest + 1.0) * f32::MIN_POSITIVE;
        let [first, last, certain_first, certain_last] =
            (depths + slack * Vec4::new(-1.0, 1.0, 1.0, -1.0)).to_array();
        let [error_slope, error_floor] = filter::errors(reach);
        let row = |d: f32| f32::from_bits((d.to_bits() >> 31) * boxes::FAR);
        // Whole rows are stored.
        let slabs: [[f32; 4]; 4] = [
            reciprocal.extend(greatest).to_array(),
            (-(middle + pad)).extend(first).to_array(),
            (pad - middle).extend(last).to_array(),
            [row(dx), row(dy), row(dz), 0.0],
        ];
        let FirstLine { slabs, .. } = zerocopy::transmute!(slabs);
        let sight = TriangleFilter {
            axis: [x as u32, y as u32, z as u32],
            error_floor,
            origin: [ray.origin[x], ray.origin[y]],
            shear: [ray.direction[x] * inverse, ray.direction[y] * inverse],
            forward,
            start: -ray.origin[z] * forward,
            first: certain_first,
            last: certain_last,
            error_slope,
        };
        Some(PreparedRay::new(slabs, sight))
    }

    /// As [`Self::of`], for rays that f32 can't prepare too; none if the ray hits nothing whatever there is: see [`Line::new`], or an
    /// empty range of t.
    #[cold]
    #[inline(never)]
    pub(crate) fn in_f64(object: &Object, ray: &Ray) -> Option<PreparedRay> {
        let line = Line::new(ray)?;
        let slabs = RaySlabs::new(ray, &line, object);
        let sight = TriangleFilter::new(ray, &line, &slabs, object);
        (ray.tmin <= ray.tmax).then(|| PreparedRay::new(slabs, sight))
    }
}

/// Sixteen rays, prepared; on cache lines, because whole vectors are stored.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Prepared {
    aim: [[[f32; LANES]; 2]; LANES],
    /// Lanes that are prepared; the others need the constructors.
    ready: u32,
}

impl Prepared {
    pub(crate) const fn new() -> Prepared {
        Prepared { aim: [[[0.0; LANES]; 2]; LANES], ready: 0 }
    }

    /// What a lane holds, if it could be prepared.
    #[inline(always)]
    pub(crate) fn aim(&self, lane: usize) -> Option<&PreparedRay> {
        let aim = PreparedRay::ref_from_bytes(self.aim[lane % LANES].as_bytes()).expect("of this size");
        (self.ready >> (lane % LANES) & 1 != 0).then_some(aim)
    }

    /// Prepares the rays at these places, as many as `count`.
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        s: S,
        bounds: &ObjectBounds,
        rays: &[Ray],
        at: &[u32; LANES],
        count: usize,
    ) {
        let wanted = s.mask(((1u64 << count) - 1) as u32);
        let field = fields(s, wanted, rays, s.load_u(at));
        let lanes = lanes(s, bounds, field, &Mixed::of(s, [field[4], field[5], field[6]]));
        self.write(s, &lanes, s.load_u(at), 0..2);
        self.ready &= s.mask_bits(wanted);
    }

    /// Takes in rays that are prepared in lanes, and their places in the batch: these cache lines of their [`PreparedRay`]s.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(&mut self, s: S, lanes: &Lanes<S>, at: S::U, lines: Range<usize>) {
        let aim = lanes.rows(s, at);
        for half in lines {
            let mut rows = [s.splat(0.0); LANES];
            for i in 0..LANES {
                rows[i] = aim[half * LANES + i];
            }
            let rows = s.transpose(rows);
            for lane in 0..LANES {
                s.store(rows[lane], &mut self.aim[lane][half]);
            }
        }
        self.ready = s.mask_bits(lanes.usable);
    }
}
