//! Whether the rays of a run are suitable for a packet, by their spans, and whether packets have been worthwhile so far.

use crate::intersect::boxes::PAD;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::object::ObjectBounds;
use zerocopy::{FromBytes, IntoBytes};

/// Number of floats in a [`Ray`].
const FLOATS: usize = size_of::<Ray>() / size_of::<f32>();
const _: () = assert!(2 * FLOATS == LANES);

/// Greatest difference of a component of the directions of coherent rays, relative to the least |component| along the main axis.
const MAX_DIRECTION_SPREAD: f32 = 0.25;
/// Greatest extent of the box of short rays, relative to the longest of their segments.
const MAX_EXTENT_PER_SEGMENT: f32 = 3.0;
/// Greatest extent of the box of short rays, relative to the size of the object.
const MAX_EXTENT_PER_OBJECT: f32 = 0.3;

/// Least and greatest values of the floats of a run of rays. NaN may be left out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// `[axis][least, greatest]`.
    pub(crate) origin: [[f32; 2]; 3],
    /// `[axis][least, greatest]`.
    pub(crate) direction: [[f32; 2]; 3],
    /// Least tmin and greatest tmax.
    range: [f32; 2],
}

/// The floats of the rays `index` and `index + 1`; of the first one twice if there is no second.
#[inline(always)]
fn load_pair<S: Simd>(s: S, rays: &[Ray], index: usize) -> S::F {
    if let Some(pair) = rays[index..].first_chunk::<2>() {
        return s.load(floats(pair));
    }
    s.load(floats(&[rays[index]; 2]))
}

/// The floats of two rays.
#[inline(always)]
fn floats(rays: &[Ray; 2]) -> &[f32; LANES] {
    <[f32; LANES]>::ref_from_bytes(rays.as_bytes()).expect("rays are made of f32")
}

/// Whether the directions of two rays lie in the same octant: a quick test of the first and the last ray of a run.
#[inline(always)]
pub(crate) fn is_same_octant(a: &Ray, b: &Ray) -> bool {
    let mut differ = 0;
    for k in 0..3 {
        differ |= a.direction[k].to_bits() ^ b.direction[k].to_bits();
    }
    differ >> 31 == 0
}

/// Least and greatest value of a float of [`Ray`], from those of the rays with even and with odd index.
#[inline(always)]
fn interval(least: &[f32; LANES], greatest: &[f32; LANES], float: usize) -> [f32; 2] {
    [least[float].min(least[float + FLOATS]), greatest[float].max(greatest[float + FLOATS])]
}

impl Span {
    #[inline(always)]
    pub(crate) fn of<S: Simd>(s: S, rays: &[Ray]) -> Span {
        let first = load_pair(s, rays, 0);
        // Two independent chains of minima and maxima, to hide their latency.
        let (mut least, mut greatest) = ([first; 2], [first; 2]);
        let (fours, rest) = rays.as_chunks::<4>();
        for four in fours {
            let (pairs, _) = four.as_chunks::<2>();
            for i in 0..2 {
                let pair = s.load(floats(&pairs[i]));
                least[i] = s.min(pair, least[i]);
                greatest[i] = s.max(pair, greatest[i]);
            }
        }
        for i in (0..rest.len()).step_by(2) {
            let pair = load_pair(s, rest, i);
            least[0] = s.min(pair, least[0]);
            greatest[0] = s.max(pair, greatest[0]);
        }
        let (least, greatest) = (s.min(least[0], least[1]), s.max(greatest[0], greatest[1]));
        let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
        s.store(least, &mut low);
        s.store(greatest, &mut high);
        let mut span = Span { origin: [[0.0; 2]; 3], direction: [[0.0; 2]; 3], range: [0.0; 2] };
        for k in 0..3 {
            span.origin[k] = interval(&low, &high, k);
            span.direction[k] = interval(&low, &high, 4 + k);
        }
        span.range = [interval(&low, &high, 3)[0], interval(&low, &high, 7)[1]];
        span
    }

    /// The main axis, along which the least |component| of all directions is greatest, and that |component|.
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

    /// Whether all directions lie in the same octant and are nearly parallel.
    #[inline(always)]
    pub(crate) fn is_coherent(&self) -> bool {
        let mut spread = 0f32;
        let mut is_same_octant = true;
        for [least, greatest] in self.direction {
            is_same_octant &= least > 0.0 || greatest < 0.0;
            spread = spread.max(greatest - least);
        }
        is_same_octant && spread <= MAX_DIRECTION_SPREAD * self.main_axis().1
    }

    /// Whether all rays start at one point, and the greatest |component| of each direction lies along the main axis.
    #[inline(always)]
    pub(crate) fn has_common_origin_and_axis(&self) -> bool {
        let [[x, to_x], [y, to_y], [z, to_z]] = self.origin;
        let (main, main_size) = self.main_axis();
        let mut is_common = x == to_x && y == to_y && z == to_z;
        for k in 0..3 {
            let [least, greatest] = self.direction[k];
            is_common &= k == main || least.abs().max(greatest.abs()) < main_size;
        }
        is_common
    }

    /// Greatest |coordinate| of an origin.
    #[inline(always)]
    pub(crate) fn farthest_origin(&self) -> f32 {
        let mut farthest = 0f32;
        for [least, greatest] in self.origin {
            farthest = farthest.max(least.abs()).max(greatest.abs());
        }
        farthest
    }

    /// The lower and the upper corner of a box that contains all points at which the rays can hit something, if the rays are short
    /// and lie close together.
    ///
    /// An end of a segment, o + t·d, is off by at most 3u(|o| + |t·d|) for its roundings (u = 2^-24), and by
    /// u|t·d| for those of the reported t; the pad is 16u(|o| + the extent of the box).
    #[inline(always)]
    pub(crate) fn segment_bounds<S: Simd>(
        &self,
        s: S,
        bounds: &ObjectBounds,
        rays: &[Ray],
    ) -> Option<[[f32; 3]; 2]> {
        if !(self.range[0] >= f32::MIN && self.range[1] <= f32::MAX) {
            return None;
        }
        // In the lanes of the origins' floats, the indices of the floats of the direction, of tmin and of tmax of the same ray.
        let direction = s.load_u(&[4, 5, 6, 7, 4, 5, 6, 7, 12, 13, 14, 15, 12, 13, 14, 15]);
        let tmin = s.load_u(&[3, 3, 3, 3, 3, 3, 3, 3, 11, 11, 11, 11, 11, 11, 11, 11]);
        let tmax = s.load_u(&[7, 7, 7, 7, 7, 7, 7, 7, 15, 15, 15, 15, 15, 15, 15, 15]);
        let (mut least, mut greatest) = (s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY));
        let mut longest = s.splat(0.0);
        let (pairs, odd) = rays.as_chunks::<2>();
        let last = [odd.first().copied().unwrap_or(rays[0]); 2];
        for pair in pairs.iter().chain([&last]) {
            let pair = s.load(floats(pair));
            let d = s.lookup(pair, direction);
            let start = s.fma(d, s.lookup(pair, tmin), pair);
            let end = s.fma(d, s.lookup(pair, tmax), pair);
            least = s.min(s.min(start, end), least);
            greatest = s.max(s.max(start, end), greatest);
            longest = s.max(s.abs(s.sub(end, start)), longest);
        }
        let (mut low, mut high, mut length_lanes) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        s.store(least, &mut low);
        s.store(greatest, &mut high);
        s.store(longest, &mut length_lanes);
        let (mut extent, mut length, mut corners) = (0f32, 0f32, [[0.0; 3]; 2]);
        for k in 0..3 {
            let [lower, upper] = interval(&low, &high, k);
            extent = extent.max(upper - lower);
            length = length.max(length_lanes[k]).max(length_lanes[k + FLOATS]);
            (corners[0][k], corners[1][k]) = (lower, upper);
        }
        if !(extent <= MAX_EXTENT_PER_SEGMENT * length && extent <= MAX_EXTENT_PER_OBJECT * bounds.size()) {
            return None;
        }
        let pad = PAD as f32 * (self.farthest_origin() + extent) + f32::MIN_POSITIVE;
        for k in 0..3 {
            corners[0][k] -= pad;
            corners[1][k] += pad;
        }
        Some(corners)
    }
}

/// Decides which runs are tried as packets: after a packet that was not worthwhile, some runs are skipped, and twice as many after
/// each further one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guard {
    /// Number of runs that are still to be skipped.
    skip: u32,
    /// Number of runs to be skipped after the next packet that is not worthwhile.
    next_skip: u32,
}

impl Default for Guard {
    fn default() -> Self {
        Guard::new()
    }
}

impl Guard {
    const MAX_SKIP: u32 = 64;

    pub(crate) fn new() -> Guard {
        Guard { skip: 0, next_skip: 4 }
    }

    /// Whether the next run is to be tried; counts that run if it is skipped.
    #[inline(always)]
    pub(crate) fn is_open(&mut self) -> bool {
        let open = self.skip == 0;
        self.skip = self.skip.saturating_sub(1);
        open
    }

    /// Records whether a packet was worthwhile.
    #[inline(always)]
    pub(crate) fn learn(&mut self, worthwhile: bool) {
        if worthwhile {
            self.next_skip = (self.next_skip / 2).max(1);
        } else {
            self.skip = self.next_skip;
            self.next_skip = (self.next_skip * 2).min(Self::MAX_SKIP);
        }
    }
}
