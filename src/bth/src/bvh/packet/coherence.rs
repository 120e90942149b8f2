//! Which rays go together: what a run of rays spans, and how well packets have done so far.

use crate::intersect::boxes::PAD;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::object::ObjectBounds;
use zerocopy::{FromBytes, IntoBytes};

/// Floats of a [`Ray`].
const FLOATS: usize = size_of::<Ray>() / size_of::<f32>();
const _: () = assert!(2 * FLOATS == LANES);

/// Directions of a coherent run differ by at most this, relative to their greatest component.
const SPREAD: f32 = 0.25;
/// The box of a run of segments is at most as many times as wide as the longest of them,
const LOOSENESS: f32 = 3.0;
/// and at most this part of the object.
const SHORT: f32 = 0.3;

/// Least and greatest values of the floats of rays. Those of rays with a NaN may be missing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub(crate) origin: [[f32; 2]; 3],
    pub(crate) direction: [[f32; 2]; 3],
    /// Least tmin, greatest tmax.
    range: [f32; 2],
}

/// Two rays in sixteen lanes.
#[inline(always)]
fn pair<S: Simd>(s: S, rays: &[Ray], at: usize) -> S::F {
    if let Some(both) = rays[at..].first_chunk::<2>() {
        return s.load(floats(both));
    }
    s.load(floats(&[rays[at]; 2]))
}

/// Their floats.
#[inline(always)]
fn floats(rays: &[Ray; 2]) -> &[f32; LANES] {
    <[f32; LANES]>::ref_from_bytes(rays.as_bytes()).expect("rays are made of f32")
}

/// Whether two rays go into the same octant: asked first, of the first and the last of a run.
#[inline(always)]
pub(crate) fn is_same_octant(a: &Ray, b: &Ray) -> bool {
    let mut differ = 0;
    for k in 0..3 {
        differ |= a.direction[k].to_bits() ^ b.direction[k].to_bits();
    }
    differ >> 31 == 0
}

/// The lesser, or the greater, of what two rays have at a place.
#[inline(always)]
fn both(least: &[f32; LANES], greatest: &[f32; LANES], at: usize) -> [f32; 2] {
    [least[at].min(least[at + FLOATS]), greatest[at].max(greatest[at + FLOATS])]
}

impl Span {
    #[inline(always)]
    pub(crate) fn of<S: Simd>(s: S, rays: &[Ray]) -> Span {
        let first = pair(s, rays, 0);
        // Two of each, so that no operation waits for the one before.
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

    /// The axis along which all directions go farthest, and how far the least of them goes.
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

    /// Whether the rays go into the same octant, and nearly the same way.
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

    /// Whether the rays start at one point, and all go farthest along the main axis.
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

    /// Greatest coordinate of an origin.
    #[inline(always)]
    pub(crate) fn farthest_origin(&self) -> f32 {
        let mut farthest = 0f32;
        for [least, greatest] in self.origin {
            farthest = farthest.max(least.abs()).max(greatest.abs());
        }
        farthest
    }

    /// A box of all points at which the rays can hit something, if they are short and close together.
    ///
    /// An end of a segment, o + t·d, is off by at most 3u(|o| + |t·d|) for its roundings (u = 2^-24), and by
    /// u|t·d| for those of the reported t; the pad is 16u(|o| + the extent of the box).
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

/// Whether packets are worth another try: after one that was not, some runs are left out, and twice as many
/// each time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Guard {
    /// Runs still to be left out.
    skip: u32,
    /// How many are left out next time.
    back: u32,
}

impl Default for Guard {
    fn default() -> Self {
        Guard::new()
    }
}

impl Guard {
    const MOST: u32 = 64;

    pub(crate) fn new() -> Guard {
        Guard { skip: 0, back: 4 }
    }

    /// Asks for the next run.
    #[inline(always)]
    pub(crate) fn is_open(&mut self) -> bool {
        let open = self.skip == 0;
        self.skip = self.skip.saturating_sub(1);
        open
    }

    /// Learns how a packet did.
    #[inline(always)]
    pub(crate) fn learn(&mut self, worthwhile: bool) {
        if worthwhile {
            self.back = (self.back / 2).max(1);
        } else {
            self.skip = self.back;
            self.back = (self.back * 2).min(Self::MOST);
        }
    }
}
