//! Preparation of rays for the BVH: the per-ray constants of box tests and filter, in f32 for one
//! ray or for sixteen at once.
//!
//! The results satisfy the bounds that [`RaySlabs`] and [`TriangleFilter`] need, but not with the
//! same bits as the constructors of these types, which compute in f64. Where coordinates are too
//! large or too small for f32, these constructors prepare the ray.

mod axes;
mod lanes;
#[cfg(test)]
mod tests;

pub(crate) use self::axes::{Axes, CommonAxis, MixedAxes};
pub(crate) use self::lanes::{PreparedLanes, gather_rays, load_rays, pick_rays, prepare_lanes};
use crate::intersect::boxes::{self, RaySlabs};
use crate::intersect::edge_functions;
use crate::intersect::filter::TriangleFilter;
use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::{LANES, Lanewise, Part, Simd};
use bth_format::layout::NONE;
use bth_format::object::{GREATEST_IN_F32, ObjectBounds};
use glam::{Vec3A, Vec4, Vec4Swizzles};
use std::hint::black_box;
use std::mem::offset_of;
use std::ops::Range;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// f32 prepares rays whose |coordinates| are below this and whose largest |component| of the
/// direction lies between 1 / `LARGEST` and `LARGEST`.
pub(crate) const LARGEST: f32 = GREATEST_IN_F32;
/// Where the sum of the largest |coordinates| of box and origin is not above this, pads could
/// underflow.
pub(crate) const SMALLEST: f32 = boxes::SMALLEST_EXTENT as f32;
/// Factor that turns a result of a few f32 roundings into an upper bound.
const ROUND_UP: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// Returns true if `x` is greater than `lower` and less than `upper`, which are positive numbers.
/// One comparison of bits decides, and tells NaN, infinity and negative numbers from numbers
/// between both.
#[inline(always)]
fn lies_between(x: f32, lower: f32, upper: f32) -> bool {
    let first = lower.to_bits() + 1;
    x.to_bits().wrapping_sub(first) < upper.to_bits() - first
}

/// 0 where `tmin` is `f32::MIN_POSITIVE` or a denormal number, of either sign, whose products would
/// be denormal. The slack of depths covers the difference.
#[inline(always)]
fn without_tiny(tmin: f32) -> f32 {
    if tmin.abs().to_bits() <= f32::MIN_POSITIVE.to_bits() { 0.0 } else { tmin }
}

/// Upper bound of what the pads of boxes are relative to ([`boxes::PAD`]), for origins whose
/// |coordinates| do not exceed `farthest` and that are no farther from any corner of the object's
/// box than `reach`; and whether f32 can prepare such rays. It cannot where `farthest` is NaN.
#[inline(always)]
pub(crate) fn padded_extent(bounds: &ObjectBounds, farthest: f32, reach: f32) -> (f32, bool) {
    let away = farthest + bounds.away;
    let extent = (bounds.padded + if reach < away { reach } else { away }) * ROUND_UP;
    (extent, lies_between(extent, SMALLEST, LARGEST) & (farthest < LARGEST))
}

/// A ray prepared for box tests and for the filter, with the progress of its traversal. The first
/// cache line holds what node steps read, the second what leaves read and write, so that
/// interleaved rays take little of the L1 cache.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct PreparedRay {
    pub(crate) slabs: RaySlabs,
    /// Index of the ray in the batch.
    pub(crate) ray: u32,
    pub(crate) filter: TriangleFilter,
    pub(crate) progress: HitProgress,
}

const _: () = assert!(offset_of!(PreparedRay, filter) == 64 && size_of::<PreparedRay>() == 128);

/// What the traversal of a ray has found so far.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct HitProgress {
    /// Lower bound of the depth of the nearest hit so far.
    pub(crate) nearest: f32,
    /// Leaf of the pending hit, which is certainly the nearest so far but whose t, u and v are not
    /// yet computed; else `NONE`. Most rays find several hits, each nearer than the one before, and
    /// only the last is computed in f64.
    pub(crate) leaf: u32,
    /// Index of the pending hit's triangle in its leaf.
    pub(crate) triangle: u16,
    /// [`Self::UNDECIDED`], [`Self::BY_QUERY`] or [`Self::ACCEPTED`].
    pub(crate) decided: u16,
}

impl HitProgress {
    pub(crate) const NOTHING: HitProgress =
        HitProgress { nearest: f32::INFINITY, leaf: NONE, triangle: 0, decided: HitProgress::UNDECIDED };

    /// No triangle has been decided, and the ray's query is not constructed.
    pub(crate) const UNDECIDED: u16 = 0;
    /// The ray's query is constructed and holds the decided hits.
    pub(crate) const BY_QUERY: u16 = 1;
    /// The ray certainly hits something, which answers an any-hit query.
    pub(crate) const ACCEPTED: u16 = 2;
}

impl PreparedRay {
    pub(crate) fn new(slabs: RaySlabs, filter: TriangleFilter) -> PreparedRay {
        PreparedRay { slabs, ray: 0, filter, progress: HitProgress::NOTHING }
    }

    /// Prepares a single ray, with the same error bounds as [`Prepared::fill`]. None if f32 cannot
    /// prepare it or if its range of t is empty.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(s: S, bounds: &ObjectBounds, ray: &Ray) -> Option<PreparedRay> {
        let rows: [[f32; 4]; 2] = zerocopy::transmute!(*ray);
        PreparedRay::of_rows(s, bounds, rows.map(Vec4::from_array), ray)
    }

    /// Like [`Self::of`], given the floats of the ray as two rows of four.
    #[inline(always)]
    pub(crate) fn of_rows<S: Simd>(
        s: S,
        bounds: &ObjectBounds,
        [start, end]: [Vec4; 2],
        ray: &Ray,
    ) -> Option<PreparedRay> {
        let (tmin, tmax) = (without_tiny(start.w), end.w);
        // The fourth lanes are not tmin, which may be denormal, nor tmax, which as f32::MAX would
        // make the reciprocal denormal: that would take hundreds of cycles.
        let (o, d) = (Vec3A::from_vec4(start.xyzz()), Vec3A::from_vec4(end));
        let size = Vec3A::from_vec4(end.abs().xyzz());
        let [lower, upper] = [bounds.lower, bounds.upper].map(|p| Vec3A::from_vec4(Vec4::from_array(p)));
        let reach = (lower - o).abs().max((upper - o).abs()).max_element() + bounds.origin_reach;
        let greatest = s.greatest_of_three(end.abs().to_array());
        let [greatest_origin, ..] = s.greatest_of_three(start.abs().to_array());
        let (greatest, greatest_lanes) = (greatest[0], Vec3A::from_vec4(Vec4::from_array(greatest)));
        // NaN and infinity among the components make these the largest.
        // The reach is known later than the rest, and box tests wait for the pads: it is read only
        // where the object is far away, by a branch.
        let near = if bounds.away > 0.0 { black_box(reach) } else { f32::INFINITY };
        let (extent, is_prepared) = padded_extent(bounds, greatest_origin, near);
        if !(lies_between(greatest, 1.0 / LARGEST, LARGEST) & is_prepared & (start.w <= tmax)) {
            return None;
        }
        let least = greatest_lanes * boxes::LEAST_COMPONENT as f32;
        let magnitude = greatest_lanes / size.max(least);
        let reciprocal = magnitude.copysign(d);
        let (scaled_origin, pad) = (o * reciprocal, magnitude * (extent * boxes::PAD as f32));
        // Branches here would be mispredicted for rays of varying directions.
        let z = (size.cmpeq(greatest_lanes).bitmask().trailing_zeros() as usize).min(2);
        let [x, y, _] = CommonAxis(z).order();
        let (inverse, forward) = (1.0 / greatest, 1f32.copysign(ray.direction[z]));
        // Depths of tmin and tmax: first those that are widened to bound all hits in range, then
        // those that are narrowed so that hits between them are certainly in range. Of rays that
        // f32 prepares, no hit is so far away that its t is not finite.
        const LEAST: Vec4 = Vec4::splat(-f32::MAX);
        const GREATEST: Vec4 = Vec4::new(f32::MAX, f32::INFINITY, f32::MAX, f32::MAX);
        let depths = Vec4::new(tmin, tmax, tmin, tmax) * greatest;
        let depths = depths.max(LEAST).min(GREATEST);
        // No intermediate result is denormal, which would cost a hundred cycles.
        let least_slack = (greatest + 1.0) * f32::MIN_POSITIVE + bounds.origin_error;
        let slack = depths.abs() * (4.0 / (1 << 24) as f32) + least_slack;
        let [first, last, certain_first, certain_last] =
            (depths + slack * Vec4::new(-1.0, 1.0, 1.0, -1.0)).to_array();
        let [error_slope, error_floor] = edge_functions::error_coefficients(reach);
        // The fourth word is the index of the ray, which is set where there are several.
        let near = end.to_array().map(|d| f32::from_bits((d.to_bits() >> 31) * boxes::FAR));
        let [x_word, y_word, z_word] = [x, y, z].map(|k| f32::from_bits(k as u32));
        let nothing = HitProgress::NOTHING;
        let [nearest, leaf, triangle]: [f32; 3] = zerocopy::transmute!(nothing);
        let (o, d) = (&ray.origin, &ray.direction);
        let plane = Vec4::new(o[x], o[y], d[x], d[y]) * Vec4::new(1.0, 1.0, inverse, inverse);
        // Assembled as rows of four, so that whole vectors are stored.
        let rows: [[f32; 4]; 8] = [
            reciprocal.extend(greatest).to_array(),
            (-(scaled_origin + pad)).extend(first).to_array(),
            (pad - scaled_origin).extend(last).to_array(),
            near,
            [x_word, y_word, z_word, error_floor],
            plane.to_array(),
            [forward, -o[z] * forward, certain_first, certain_last],
            [error_slope, nearest, leaf, triangle],
        ];
        Some(zerocopy::transmute!(rows))
    }

    /// Prepares any ray, in f64 where [`Self::of`] cannot. None if the ray cannot hit anything,
    /// because it has no line ([`Line::new`]) or an empty range of t.
    #[cold]
    #[inline(never)]
    pub(crate) fn in_f64(bounds: &ObjectBounds, ray: &Ray) -> Option<PreparedRay> {
        let line = Line::new(ray)?;
        let slabs = RaySlabs::new(ray, &line, bounds);
        let filter = TriangleFilter::new(ray, &line, &slabs, bounds);
        (ray.tmin <= ray.tmax).then(|| PreparedRay::new(slabs, filter))
    }
}

/// [`Prepared::fill`] with its arguments.
struct PrepareSixteen<'a> {
    prepared: &'a mut Prepared,
    bounds: &'a ObjectBounds,
    rays: &'a [Ray],
    at: &'a [u32; LANES],
    count: usize,
}

impl<S: Simd> Part<S> for PrepareSixteen<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let PrepareSixteen { prepared, bounds, rays, at, count } = self;
        let used = s.mask(((1u64 << count) - 1) as u32);
        let field = gather_rays(s, used, rays, s.load_u(at));
        prepared.clear();
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let field = pick_rays::<S>(p, &field);
            let lanes = prepare_lanes(p, bounds, field, &MixedAxes::of(p, [field[4], field[5], field[6]]));
            prepared.write::<S>(p, &lanes, p.load_u(at), 0..2);
        }
        prepared.ready &= s.mask_bits(used);
    }
}

/// Sixteen prepared rays, aligned to cache lines for the stores of whole vectors.
#[derive(Debug)]
#[repr(C, align(64))]
pub(crate) struct Prepared {
    /// The words of each lane's [`PreparedRay`], as two cache lines.
    rays: [[[f32; LANES]; 2]; LANES],
    /// Bits of the lanes that are prepared; rays of the other lanes need [`PreparedRay::in_f64`].
    ready: u32,
}

impl Prepared {
    pub(crate) const fn new() -> Prepared {
        Prepared { rays: [[[0.0; LANES]; 2]; LANES], ready: 0 }
    }

    /// The prepared ray of a lane, if f32 could prepare it.
    #[inline(always)]
    pub(crate) fn prepared(&self, lane: usize) -> Option<&PreparedRay> {
        let ray = PreparedRay::ref_from_bytes(self.rays[lane % LANES].as_bytes()).ok().expect("of this size");
        (self.ready >> (lane % LANES) & 1 != 0).then_some(ray)
    }

    /// Prepares the first `count` of the rays with the indices `at`; `count` is at most [`LANES`].
    #[inline(always)]
    pub(crate) fn fill<S: Simd>(
        &mut self,
        s: S,
        bounds: &ObjectBounds,
        rays: &[Ray],
        at: &[u32; LANES],
        count: usize,
    ) {
        s.call(PrepareSixteen { prepared: self, bounds, rays, at, count });
    }

    /// Makes all lanes vacant.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.ready = 0;
    }

    /// Stores rays that are prepared in the vacant lanes of a piece; `at` holds their indices in
    /// the batch. Only the cache lines in `lines`, a part of 0..2, are stored.
    #[inline(always)]
    pub(crate) fn write<S: Simd>(
        &mut self,
        p: S::Piece,
        lanes: &PreparedLanes<S::Piece>,
        at: <S::Piece as Lanewise>::U,
        lines: Range<usize>,
    ) {
        let words = lanes.rows(p, at);
        for line in lines {
            let mut columns = [p.splat(0.0); LANES];
            for i in 0..LANES {
                columns[i] = words[line * LANES + i];
            }
            S::store_transposed(p, columns, &mut self.rays, line);
        }
        self.ready |= p.mask_bits(lanes.usable);
    }
}
