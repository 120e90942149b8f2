//! Coherence of rays: the ranges of their origins and directions. A [`shaft`] bounds coherent rays.

pub(crate) mod shaft;

use crate::intersect::boxes::PAD;
use crate::intersect::prepare;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::object::ObjectBounds;
use zerocopy::{FromBytes, IntoBytes};

/// Floats of a [`Ray`].
const FLOATS: usize = size_of::<Ray>() / size_of::<f32>();
const _: () = assert!(2 * FLOATS == LANES);

/// Largest difference of the directions of coherent rays, relative to the smallest of their
/// components along the main axis.
const SPREAD: f32 = 0.25;
/// Largest extent of the box of short rays, relative to the longest of them.
const LOOSENESS: f32 = 3.0;
/// Largest extent of that box, relative to the size of the object.
const SHORT: f32 = 0.3;

/// Smallest and largest values of the components of rays. Rays with a NaN may be missing from them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// For each axis the smallest and the largest coordinate of the origins.
    pub(crate) origin: [[f32; 2]; 3],
    /// For each axis the smallest and the largest component of the directions.
    pub(crate) direction: [[f32; 2]; 3],
    /// Smallest tmin and largest tmax.
    pub(crate) range: [f32; 2],
}

/// The floats of the two rays from `at` on; the last ray is repeated if it has no successor.
#[inline(always)]
fn pair<S: Simd>(s: S, rays: &[Ray], at: usize) -> S::F {
    if let Some(both) = rays[at..].first_chunk::<2>() {
        return s.load(floats(both));
    }
    s.load(floats(&[rays[at]; 2]))
}

/// The floats of two rays.
#[inline(always)]
fn floats(rays: &[Ray; 2]) -> &[f32; LANES] {
    <[f32; LANES]>::ref_from_bytes(rays.as_bytes()).ok().expect("rays are made of f32")
}

/// Returns true if the directions of two rays lie in the same octant. It is tested for the first
/// and the last ray before [`Span::of`], which takes longer.
#[inline(always)]
pub(crate) fn is_same_octant(a: &Ray, b: &Ray) -> bool {
    let mut differ = 0;
    for k in 0..3 {
        differ |= a.direction[k].to_bits() ^ b.direction[k].to_bits();
    }
    differ >> 31 == 0
}

/// The smallest and the largest value of a component, given its values in two rays in one vector.
#[inline(always)]
fn both(least: &[f32; LANES], greatest: &[f32; LANES], at: usize) -> [f32; 2] {
    [least[at].min(least[at + FLOATS]), greatest[at].max(greatest[at + FLOATS])]
}

impl Span {
    /// The ranges of the components of rays. There must be at least one ray.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(s: S, rays: &[Ray]) -> Span {
        let first = pair(s, rays, 0);
        // Two accumulators each, so that consecutive operations are independent.
        let (mut least, mut greatest) = ([first; 2], [first; 2]);
        let (fours, rest) = rays.as_chunks::<4>();
        for four in fours {
            let (pairs, _) = four.as_chunks::<2>();
            for i in 0..2 {
                let two = s.load(floats(&pairs[i]));
                least[i] = s.min(two, least[i]);
                greatest[i] = s.max(two, greatest[i]);
            }
        }
        for at in (0..rest.len()).step_by(2) {
            let two = pair(s, rest, at);
            least[0] = s.min(two, least[0]);
            greatest[0] = s.max(two, greatest[0]);
        }
        let (least, greatest) = (s.min(least[0], least[1]), s.max(greatest[0], greatest[1]));
        let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
        s.store(least, &mut low);
        s.store(greatest, &mut high);
        let mut span = Span { origin: [[0.0; 2]; 3], direction: [[0.0; 2]; 3], range: [0.0; 2] };
        for k in 0..3 {
            span.origin[k] = both(&low, &high, k);
            span.direction[k] = both(&low, &high, 4 + k);
        }
        span.range = [both(&low, &high, 3)[0], both(&low, &high, 7)[1]];
        span
    }

    /// The axis along which the smallest |component| of the directions is the largest, and that
    /// |component|.
    #[inline(always)]
    pub(crate) fn main_axis(&self) -> (usize, f32) {
        let mut main = (0, 0.0);
        for k in 0..3 {
            let [least, greatest] = self.direction[k];
            let size = least.abs().min(greatest.abs());
            if size > main.1 {
                main = (k, size);
            }
        }
        main
    }

    /// Returns true if the directions lie in the same octant and differ little.
    #[inline(always)]
    pub(crate) fn is_coherent(&self) -> bool {
        let mut spread = 0f32;
        let mut same = true;
        for [least, greatest] in self.direction {
            same &= least > 0.0 || greatest < 0.0;
            spread = spread.max(greatest - least);
        }
        same && spread <= SPREAD * self.main_axis().1
    }

    /// Returns true if the rays have the same origin, and the largest |component| of each direction
    /// lies along the main axis.
    #[inline(always)]
    pub(crate) fn is_from_point(&self) -> bool {
        let [[x, to_x], [y, to_y], [z, to_z]] = self.origin;
        let (main, least) = self.main_axis();
        let mut same = x == to_x && y == to_y && z == to_z;
        for k in 0..3 {
            let [from, to] = self.direction[k];
            same &= k == main || from.abs().max(to.abs()) < least;
        }
        same
    }

    /// Largest |coordinate| of an origin.
    #[inline(always)]
    pub(crate) fn farthest_origin(&self) -> f32 {
        let mut farthest = 0f32;
        for [least, greatest] in self.origin {
            farthest = farthest.max(least.abs()).max(greatest.abs());
        }
        farthest
    }

    /// [`prepare::padded_extent`] of the rays.
    #[inline(always)]
    pub(crate) fn padded_extent(&self, bounds: &ObjectBounds) -> (f32, bool) {
        let farthest = self.farthest_origin();
        if bounds.away == 0.0 {
            // The farthest corner would take longer to find than it saves.
            return prepare::padded_extent(bounds, farthest, farthest);
        }
        let reach = (0..3).fold(0f32, |reach, k| {
            let [least, greatest] = self.origin[k];
            reach.max(bounds.upper[k] - least).max(greatest - bounds.lower[k])
        });
        prepare::padded_extent(bounds, farthest, reach)
    }

    /// A box of all points at which the rays can hit something, as lower and upper corner, if they
    /// are short and close together.
    ///
    /// An end of a segment, o + t·d, is off by at most 3u(|o| + |t·d|) for its roundings (u =
    /// 2^-24), and by u|t·d| because the reported t is rounded; the pad is 16u(|o| + the extent of
    /// the box).
    #[inline(always)]
    pub(crate) fn segments<S: Simd>(
        &self,
        s: S,
        bounds: &ObjectBounds,
        rays: &[Ray],
    ) -> Option<[[f32; 3]; 2]> {
        if !(self.range[0] >= f32::MIN && self.range[1] <= f32::MAX) {
            return None;
        }
        let direction = s.load_u(&[4, 5, 6, 7, 4, 5, 6, 7, 12, 13, 14, 15, 12, 13, 14, 15]);
        let start = s.load_u(&[3, 3, 3, 3, 3, 3, 3, 3, 11, 11, 11, 11, 11, 11, 11, 11]);
        let end = s.load_u(&[7, 7, 7, 7, 7, 7, 7, 7, 15, 15, 15, 15, 15, 15, 15, 15]);
        let (mut least, mut greatest) = (s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
        let mut longest = s.splat(0.0);
        let (pairs, odd) = rays.as_chunks::<2>();
        let last = [odd.first().copied().unwrap_or(rays[0]); 2];
        for pair in pairs.iter().chain([&last]) {
            let two = s.load(floats(pair));
            let d = s.lookup(two, direction);
            let p = s.fma(d, s.lookup(two, start), two);
            let q = s.fma(d, s.lookup(two, end), two);
            least = s.min(s.min(p, q), least);
            greatest = s.max(s.max(p, q), greatest);
            longest = s.max(s.abs(s.sub(q, p)), longest);
        }
        let (mut low, mut high, mut long) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        s.store(least, &mut low);
        s.store(greatest, &mut high);
        s.store(longest, &mut long);
        let (mut extent, mut length, mut segments) = (0f32, 0f32, [[0.0; 3]; 2]);
        for k in 0..3 {
            let [lower, upper] = both(&low, &high, k);
            extent = extent.max(upper - lower);
            length = length.max(long[k]).max(long[k + FLOATS]);
            (segments[0][k], segments[1][k]) = (lower, upper);
        }
        if !(extent <= LOOSENESS * length && extent <= SHORT * bounds.size()) {
            return None;
        }
        let pad = PAD as f32 * (self.farthest_origin() + extent) + f32::MIN_POSITIVE;
        for k in 0..3 {
            segments[0][k] -= pad;
            segments[1][k] += pad;
        }
        Some(segments)
    }
}
