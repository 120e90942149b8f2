//! Preparation of sixteen rays in lanes: the fields of [`PreparedRay`], before they are transposed
//! to one record for each ray.

use super::axes::Axes;
use super::{HitProgress, LARGEST, PreparedRay, ROUND_UP, SMALLEST};
use crate::intersect::boxes;
use crate::intersect::edge_functions;
use crate::rays::Ray;
use crate::simd::{LANES, Lanewise, Simd};
use bth_format::object::ObjectBounds;
use std::mem::offset_of;

/// The eight floats of the rays at the indices `at` whose mask `m` is set, a vector for each float.
#[inline(always)]
pub(crate) fn gather_rays<S: Simd>(s: S, m: S::M, rays: &[Ray], at: S::U) -> [S::F; 8] {
    floats(s, s.rows8(m, Ray::rows(rays), at))
}

/// Like [`gather_rays`], for sixteen consecutive rays.
#[inline(always)]
pub(crate) fn load_rays<S: Simd>(s: S, rays: &[Ray; LANES]) -> [S::F; 8] {
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

/// The floats of the rays of a piece.
#[inline(always)]
pub(crate) fn pick_rays<S: Simd>(p: S::Piece, field: &[S::F; 8]) -> [<S::Piece as Lanewise>::F; 8] {
    let mut out = [p.splat(0.0); 8];
    for k in 0..8 {
        out[k] = S::pick(p, &field[k]);
    }
    out
}

/// The fields of [`PreparedRay`] for sixteen rays or a piece of them, from which
/// [`PreparedLanes::rows`] computes the records.
pub(crate) struct PreparedLanes<S: Lanewise> {
    pub(crate) reciprocal: [S::F; 3],
    pub(crate) near_addend: [S::F; 3],
    pub(crate) far_addend: [S::F; 3],
    /// True if the components of the direction are negative.
    pub(crate) negative: [S::M; 3],
    pub(crate) scale: S::F,
    /// Smallest and largest depth at which a hit may lie in the ray's range.
    pub(crate) depths: [S::F; 2],
    /// Smallest and largest depth at which a hit certainly lies in the ray's range.
    pub(crate) certain: [S::F; 2],
    pub(crate) axis: [S::U; 3],
    pub(crate) origin: [S::F; 2],
    pub(crate) shear: [S::F; 2],
    pub(crate) forward: S::F,
    pub(crate) start: S::F,
    /// Largest |coordinate| of the object's box relative to the ray's origin.
    pub(crate) reach: S::F,
    /// Rays that f32 can prepare and whose range of t is not empty.
    pub(crate) usable: S::M,
}

/// Prepares sixteen rays for an object of these bounds, given the floats of the rays
/// ([`gather_rays`]).
#[inline(always)]
pub(crate) fn prepare_lanes<S: Lanewise>(
    s: S,
    bounds: &ObjectBounds,
    field: [S::F; 8],
    axes: &impl Axes<S>,
) -> PreparedLanes<S> {
    let [ox, oy, oz, tmin, dx, dy, dz, tmax] = field;
    let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
    let size = [s.abs(dx), s.abs(dy), s.abs(dz)];
    let zero = s.splat(0.0);
    let greatest = s.max(s.max(size[0], size[1]), size[2]);

    let mut reach = zero;
    let mut farthest = zero;
    // Sums of |coordinates| detect NaN; a maximum would not, because the greater of NaN and a
    // number may be the number.
    let (mut origin_sum, mut direction_sum) = (zero, zero);
    for k in 0..3 {
        let far =
            s.max(s.abs(s.sub(s.splat(bounds.lower[k]), o[k])), s.abs(s.sub(s.splat(bounds.upper[k]), o[k])));
        reach = s.max(far, reach);
        let coordinate = s.abs(o[k]);
        farthest = s.max(coordinate, farthest);
        origin_sum = s.add(coordinate, origin_sum);
        direction_sum = s.add(size[k], direction_sum);
    }
    reach = s.add(reach, s.splat(bounds.origin_reach));
    // As `padded_extent`.
    let (padded, round_up) = (s.splat(bounds.padded), s.splat(ROUND_UP));
    let extent = s.mul(s.add(padded, s.min(s.add(farthest, s.splat(bounds.away)), reach)), round_up);
    let large = s.splat(LARGEST);
    let finite = s.and(
        s.and(s.lt(s.splat(1.0 / LARGEST), greatest), s.lt(direction_sum, large)),
        s.and(s.and(s.lt(s.splat(SMALLEST), extent), s.lt(extent, large)), s.lt(origin_sum, large)),
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

    let ([ox, oy, oz], [dx, dy, dz]) = (axes.permute(s, o), axes.permute(s, d));
    let inverse = s.div(s.splat(1.0), greatest);
    let forward = s.select(s.lt(dz, zero), s.splat(-1.0), s.splat(1.0));

    // Bounds of the errors by rounding and underflow of the depths of tmin and tmax.
    let least =
        s.fma(s.add(greatest, s.splat(1.0)), s.splat(f32::MIN_POSITIVE), s.splat(bounds.origin_error));
    let ulps = s.splat(4.0 / (1 << 24) as f32);
    let slack = |depth: S::F| s.fma(s.abs(depth), ulps, least);
    // The smallest normal number and denormal ones become 0, because their products would be
    // denormal: that moves them by less than the slack.
    let start = s.select(s.le(s.abs(tmin), s.splat(f32::MIN_POSITIVE)), zero, tmin);
    let first = s.max(s.mul(start, greatest), s.splat(-f32::MAX));
    let limit = s.mul(tmax, greatest);
    let last = s.min(s.mul(s.min(tmax, s.splat(f32::MAX)), greatest), s.splat(f32::MAX));
    PreparedLanes {
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

/// Index of a field of [`PreparedRay`] among its words.
macro_rules! row {
    ($($field:tt)*) => { offset_of!(PreparedRay, $($field)*) / size_of::<f32>() };
}

impl<S: Lanewise> PreparedLanes<S> {
    /// The words of sixteen [`PreparedRay`]s, a vector for each word; `at` holds the indices of the
    /// rays in the batch.
    #[inline(always)]
    pub(super) fn rows(&self, s: S, at: S::U) -> [S::F; 2 * LANES] {
        let mut rows = [s.splat(0.0); 2 * LANES];
        for k in 0..3 {
            rows[row!(slabs.reciprocal) + k] = self.reciprocal[k];
            rows[row!(slabs.near_addend) + k] = self.near_addend[k];
            rows[row!(slabs.far_addend) + k] = self.far_addend[k];
            let near = s.select_u(self.negative[k], s.splat_u(boxes::FAR), s.splat_u(0));
            rows[row!(slabs.near) + k] = s.floats(near);
            rows[row!(filter.axis) + k] = s.floats(self.axis[k]);
        }
        rows[row!(slabs.scale)] = self.scale;
        [rows[row!(slabs.first)], rows[row!(slabs.last)]] = self.depths;
        rows[row!(ray)] = s.floats(at);
        for k in 0..2 {
            rows[row!(filter.origin) + k] = self.origin[k];
            rows[row!(filter.shear) + k] = self.shear[k];
        }
        rows[row!(filter.forward)] = self.forward;
        rows[row!(filter.start)] = self.start;
        [rows[row!(filter.first)], rows[row!(filter.last)]] = self.certain;
        let slope = s.mul(self.reach, s.splat(edge_functions::ERROR_SLOPE));
        rows[row!(filter.error_slope)] = slope;
        rows[row!(filter.error_floor)] = s.fma(slope, slope, s.splat(f32::MIN_POSITIVE));
        let nothing: [u32; 3] = zerocopy::transmute!(HitProgress::NOTHING);
        for (k, word) in nothing.into_iter().enumerate() {
            rows[row!(progress) + k] = s.floats(s.splat_u(word));
        }
        rows
    }
}
