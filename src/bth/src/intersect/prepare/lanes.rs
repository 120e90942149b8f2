//! Sixteen rays prepared in lanes: what [`PreparedRay`]s say of them, before they are turned into those.

use super::axes::Axes;
use super::{HitProgress, LARGEST, PreparedRay, SMALLEST, UP};
use crate::intersect::boxes;
use crate::intersect::filter;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::object::ObjectBounds;
use std::mem::offset_of;

/// The floats of rays, a row of lanes for each.
#[inline(always)]
pub(crate) fn fields<S: Simd>(s: S, m: S::M, rays: &[Ray], at: S::U) -> [S::F; 8] {
    floats(s, s.rows8(m, Ray::rows(rays), at))
}

/// The same of sixteen rays that lie one behind the other.
#[inline(always)]
pub(crate) fn fields_of<S: Simd>(s: S, rays: &[Ray; LANES]) -> [S::F; 8] {
    floats(s, s.columns8(Ray::rows(rays).first_chunk().expect("sixteen rows")))
}

#[inline(always)]
fn floats<S: Simd>(s: S, words: [S::U; 8]) -> [S::F; 8] {
    let mut out = [s.splat(0.0); 8];
    for k in 0..8 {
        out[k] = s.floats(words[k]);
    }
    out
}

/// What [`PreparedRay`]s say of sixteen rays, a row of lanes for each.
pub(crate) struct Lanes<S: Simd> {
    pub(crate) reciprocal: [S::F; 3],
    pub(crate) near_addend: [S::F; 3],
    pub(crate) far_addend: [S::F; 3],
    pub(crate) negative: [S::M; 3],
    pub(crate) scale: S::F,
    /// ObjectBounds of the depths that matter,
    pub(crate) depths: [S::F; 2],
    /// and of those that certainly do.
    pub(crate) certain: [S::F; 2],
    pub(crate) axis: [S::U; 3],
    pub(crate) origin: [S::F; 2],
    pub(crate) shear: [S::F; 2],
    pub(crate) forward: S::F,
    pub(crate) start: S::F,
    pub(crate) reach: S::F,
    /// Rays that this is good for.
    pub(crate) usable: S::M,
}

/// Prepares sixteen rays, given their own floats.
#[inline(always)]
pub(crate) fn lanes<S: Simd>(s: S, bounds: &ObjectBounds, field: [S::F; 8], axes: &impl Axes<S>) -> Lanes<S> {
    let [ox, oy, oz, tmin, dx, dy, dz, tmax] = field;
    let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
    let size = [s.abs(dx), s.abs(dy), s.abs(dz)];
    let zero = s.splat(0.0);
    let greatest = s.max(s.max(size[0], size[1]), size[2]);

    let mut reach = zero;
    let mut farthest = zero;
    // Sums, because the greater of NaN and a number may be the number.
    let (mut from, mut along) = (zero, zero);
    for k in 0..3 {
        let far =
            s.max(s.abs(s.sub(s.splat(bounds.lower[k]), o[k])), s.abs(s.sub(s.splat(bounds.upper[k]), o[k])));
        reach = s.max(far, reach);
        let coordinate = s.abs(o[k]);
        farthest = s.max(coordinate, farthest);
        from = s.add(coordinate, from);
        along = s.add(size[k], along);
    }
    let extent = s.mul(s.add(s.splat(bounds.greatest), farthest), s.splat(UP));
    let large = s.splat(LARGEST);
    let finite = s.and(
        s.and(s.lt(s.splat(1.0 / LARGEST), greatest), s.lt(along, large)),
        s.and(s.and(s.lt(s.splat(SMALLEST), extent), s.lt(extent, large)), s.lt(from, large)),
    );
    let pad = s.mul(extent, s.splat(boxes::PAD as f32));
    let least = s.mul(greatest, s.splat(boxes::LEAST_COMPONENT as f32));
    let (mut reciprocal, mut near_addend, mut far_addend) = ([zero; 3], [zero; 3], [zero; 3]);
    let mut negative = [s.mask(0); 3];
    for k in 0..3 {
        let magnitude = s.div(greatest, s.max(size[k], least));
        let sign = s.and_u(s.bits(d[k]), s.splat_u(1 << 31));
        reciprocal[k] = s.floats(s.or_u(s.bits(magnitude), sign));
        let pad = s.mul(pad, magnitude);
        near_addend[k] = s.fnma(o[k], reciprocal[k], s.sub(zero, pad));
        far_addend[k] = s.fnma(o[k], reciprocal[k], pad);
        negative[k] = s.lt_u(s.splat_u(i32::MAX as u32), sign);
    }

    let ([ox, oy, oz], [dx, dy, dz]) = (axes.turn(s, o), axes.turn(s, d));
    let inverse = s.div(s.splat(1.0), greatest);
    let forward = s.select(s.lt(dz, zero), s.splat(-1.0), s.splat(1.0));

    // What rounding and underflow can take from t, as depth.
    let least = s.mul(s.add(greatest, s.splat(1.0)), s.splat(f32::MIN_POSITIVE));
    let ulps = s.splat(4.0 / (1 << 24) as f32);
    let slack = |depth: S::F| s.fma(s.abs(depth), ulps, least);
    let first = s.max(s.mul(tmin, greatest), s.splat(-f32::MAX));
    let limit = s.mul(tmax, greatest);
    let last = s.min(s.mul(s.min(tmax, s.splat(f32::MAX)), greatest), s.splat(f32::MAX));
    Lanes {
        reciprocal,
        near_addend,
        far_addend,
        negative,
        scale: greatest,
        depths: [s.sub(first, slack(first)), s.add(limit, slack(limit))],
        certain: [s.add(first, slack(first)), s.sub(last, slack(last))],
        axis: axes.axes(s),
        origin: [ox, oy],
        shear: [s.mul(dx, inverse), s.mul(dy, inverse)],
        forward,
        start: s.fnma(oz, forward, zero),
        reach,
        usable: s.and(finite, s.le(tmin, tmax)),
    }
}

/// Place of a field of [`PreparedRay`] among its floats.
macro_rules! row {
    ($($field:tt)*) => { offset_of!(PreparedRay, $($field)*) / size_of::<f32>() };
}

impl<S: Simd> Lanes<S> {
    /// The floats of [`PreparedRay`]s of the rays at these places.
    #[inline(always)]
    pub(super) fn rows(&self, s: S, at: S::U) -> [S::F; 2 * LANES] {
        let mut rows = [s.splat(0.0); 2 * LANES];
        for k in 0..3 {
            rows[row!(slabs.reciprocal) + k] = self.reciprocal[k];
            rows[row!(slabs.near_addend) + k] = self.near_addend[k];
            rows[row!(slabs.far_addend) + k] = self.far_addend[k];
            let near = s.select_u(self.negative[k], s.splat_u(boxes::FAR), s.splat_u(0));
            rows[row!(slabs.near) + k] = s.floats(near);
            rows[row!(sight.axis) + k] = s.floats(self.axis[k]);
        }
        rows[row!(slabs.scale)] = self.scale;
        [rows[row!(slabs.first)], rows[row!(slabs.last)]] = self.depths;
        rows[row!(ray)] = s.floats(at);
        for k in 0..2 {
            rows[row!(sight.origin) + k] = self.origin[k];
            rows[row!(sight.shear) + k] = self.shear[k];
        }
        rows[row!(sight.forward)] = self.forward;
        rows[row!(sight.start)] = self.start;
        [rows[row!(sight.first)], rows[row!(sight.last)]] = self.certain;
        let slope = s.mul(self.reach, s.splat(filter::ERROR_SLOPE));
        rows[row!(sight.error_slope)] = slope;
        rows[row!(sight.error_floor)] = s.fma(slope, slope, s.splat(f32::MIN_POSITIVE));
        let nothing: [u32; 3] = zerocopy::transmute!(HitProgress::NOTHING);
        for (k, word) in nothing.into_iter().enumerate() {
            rows[row!(noted) + k] = s.floats(s.splat_u(word));
        }
        rows
    }
}
