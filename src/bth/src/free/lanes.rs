//! The decision about sixteen rays at a time, in f32.

use super::crossings::{Crossings, SLACK};
use super::starts::{Hints, Row, Starts};
use crate::intersect::prepare::{load_rays, pick_rays};
use crate::rays::{RAYS_PER_CACHE_LINE, Ray};
use crate::simd::{Kernel, LANES, Lanewise, Simd};
use bth_format::layout::{FREE_BINS, FREE_SECTOR_OF, FREE_SIDE, FreeBins, FreeLevels, NONE};
use bth_format::object::ObjectView;
use std::ops::Range;

/// Bit of the last word of bins.
const BACK: u32 = (FreeBins::BACK >> 96) as u32;
/// 2^i for lane i.
static POWERS: [u32; LANES] = {
    let mut powers = [1; LANES];
    let mut i = 1;
    while i < LANES {
        powers[i] = 2 * powers[i - 1];
        i += 1;
    }
    powers
};

/// For each row its first bin. Lanes without a row lead to bins that are never free.
static FIRST_BIN: [u32; LANES] = {
    let mut first = [FREE_BINS as u32; LANES];
    let mut row = 0;
    while row < FREE_SIDE {
        first[row] = (FREE_SIDE * row) as u32;
        row += 1;
    }
    first
};
/// For each column and each row the bits of the levels in the sectors that hold it. Lanes without a column have none.
static OF_SECTORS: [[u32; LANES]; 2] = {
    let mut bits = [[0; LANES]; 2];
    let mut column = 0;
    while column < FREE_SIDE {
        if let Some(sector) = FREE_SECTOR_OF[column] {
            bits[0][column] = 0x1111_1111 << sector;
            bits[1][column] = 0x000f_000f << (4 * sector);
        }
        column += 1;
    }
    bits
};

/// Decides the rays of a range.
pub(super) struct FreeKernel<'a, 'r, R> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) rows: &'a [R],
    pub(super) rays: &'a [Ray],
    /// For each ray the triangle on which it starts, or `NONE`.
    pub(super) from: &'a [u32],
    pub(super) range: Range<usize>,
    /// Receives the indices of the rays that may meet something.
    pub(super) rest: &'r mut Vec<u32>,
    /// Receives copies of the rays, at the same indices, whose ranges begin later where nothing is hit before.
    pub(super) later: &'r mut [Ray],
}

impl<R: Row> Kernel for FreeKernel<'_, '_, R> {
    /// Number of rays that may meet something, but only later than at `tmin`.
    type Output = usize;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> usize {
        let FreeKernel { object, rows, rays, from, range, rest, later } = self;
        let levels = object.free_levels.first().copied().unwrap_or_default();
        // What is stored lane by lane and loaded at once waits until the stores are done, so sixteen rays are fetched before the sixteen
        // before them are decided.
        let mut starts = [Starts::NONE; 2];
        let mut index = [0; LANES];
        let mut count_later = 0;
        // Sixteen indices are stored at once, of which those that are left count.
        let mut end = rest.len();
        rest.resize(end + range.len() + LANES, 0);
        let (blocks, _) = from[range.clone()].as_chunks::<LANES>();
        let mut ahead = [hints(s, blocks, 0), hints(s, blocks, 1)];
        ahead[0].prefetch_rows(s, object, rows);
        ahead[1].prefetch_rows(s, object, rows);
        ahead[0].prefetch_leaves(s, object);
        for i in 0..=blocks.len() {
            let next = hints(s, blocks, i + 2);
            next.prefetch_rows(s, object, rows);
            ahead[1].prefetch_leaves(s, object);
            for line in 0..LANES / RAYS_PER_CACHE_LINE {
                let ray = range.start + (i + 1) * LANES + line * RAYS_PER_CACHE_LINE;
                s.prefetch(rays.as_ptr().wrapping_add(ray));
            }
            starts[i % 2].fetch(s, object, rows, &ahead[0]);
            ahead = [ahead[1], next];
            let Some(before) = i.checked_sub(1) else { continue };
            let first = range.start + before * LANES;
            let Some(chunk) = rays[first..].first_chunk() else { break };
            let fields = load_rays(s, chunk);
            let (free, begin) = decide::<S, R>(s, &mut starts[before % 2], &fields, &levels);
            // A ray whose range ends before it begins has ended, too.
            let ended = free | s.mask_bits(s.lt(fields[7], begin));
            for lane in 0..LANES {
                index[lane] = (first + lane) as u32;
            }
            let mut left = [0; LANES];
            let count = s.compress(!ended & 0xffff, s.load_u(&index), &mut left);
            if let Some(to) = rest[end..].first_chunk_mut() {
                *to = left;
            }
            end += count;
            if let Some(to) = later.get_mut(first..).and_then(<[Ray]>::first_chunk_mut::<LANES>) {
                let mut begins = [0.0; LANES];
                s.store(begin, &mut begins);
                *to = *chunk;
                for lane in 0..LANES {
                    to[lane].tmin = begins[lane];
                }
            }
            let is_later = s.mask_bits(s.lt(fields[3], begin)) & !ended;
            count_later += is_later.count_ones() as usize;
        }
        rest.truncate(end);
        rest.extend((range.start + blocks.len() * LANES) as u32..range.end as u32);
        count_later
    }
}

/// The hints of a group of sixteen rays; beyond the last one, none.
#[inline(always)]
fn hints<S: Simd>(s: S, groups: &[[u32; LANES]], i: usize) -> Hints<'_> {
    Hints::new(s, groups.get(i).unwrap_or(&[NONE; LANES]))
}

/// Bits of the rays in free directions, and where the ranges of the others begin, given the floats of the rays.
#[inline(always)]
fn decide<S: Simd, R: Row>(
    s: S,
    starts: &mut Starts,
    fields: &[S::F; 8],
    levels: &FreeLevels,
) -> (u32, S::F) {
    starts.expand::<S, R>(s);
    let (mut to_front, mut to_back, mut start) = (0, 0, s.splat(0.0));
    let mut columns = [[0; LANES]; 2];
    for i in 0..S::PIECES {
        let p = s.piece(i);
        let crossings = Crossings::new(p, &starts.corners, pick_rays::<S>(p, fields));
        to_front |= crossings.front;
        to_back |= crossings.back;
        S::put(p, &mut start, crossings.start);
        p.store_u(crossings.columns[0], &mut columns[0]);
        p.store_u(crossings.columns[1], &mut columns[1]);
    }
    let [column, row] = [s.load_u(&columns[0]), s.load_u(&columns[1])];
    let free = if R::HAS_BINS { free_lanes(s, starts, [column, row], [to_front, to_back]) } else { 0 };
    let sectors = [s.load_u(&starts.sectors[0]), s.load_u(&starts.sectors[1])];
    let none = s.splat_u(0);
    let of_side = s.select_u(s.mask(to_front), sectors[0], s.select_u(s.mask(to_back), sectors[1], none));
    let begin = begins(s, fields, start, within(s, of_side, [column, row], levels));
    (free, begin)
}

/// Bits of the rays in free directions, given their columns and rows, and the bits of those to the front and to the back.
#[inline(always)]
fn free_lanes<S: Simd>(
    s: S,
    starts: &Starts,
    [column, row]: [S::U; 2],
    [to_front, to_back]: [u32; 2],
) -> u32 {
    let bin = s.add_u(s.lookup_u(s.load_u(&FIRST_BIN), row), column);
    let mut words = [s.splat_u(0); 4];
    for word in 0..4 {
        words[word] = s.load_u(&starts.bins[word]);
    }
    let mut word = words[3];
    for k in [2, 1, 0] {
        word = s.select_u(s.lt_u(bin, s.splat_u(32 * (k + 1))), words[k as usize], word);
    }
    let power = s.lookup_u(s.load_u(&POWERS), bin);
    let in_lower_half = s.eq_u(s.and_u(bin, s.splat_u(16)), s.splat_u(0));
    let bit = s.select_u(in_lower_half, power, s.shl_u::<16>(power));
    let back = lanes_with(s, words[3], BACK);
    let open = !s.mask_bits(s.eq_u(s.and_u(word, bit), s.splat_u(0)));
    open & s.mask_bits(s.lt_u(row, s.splat_u(FREE_SIDE as u32))) & (to_front & !back | to_back & back)
}

/// The distances within which nothing is met, given the sectors of the sides to which rays go, and their columns and rows.
#[inline(always)]
fn within<S: Simd>(s: S, sectors: S::U, [column, row]: [S::U; 2], levels: &FreeLevels) -> S::F {
    let of_column = s.lookup_u(s.load_u(&OF_SECTORS[0]), column);
    let of_row = s.lookup_u(s.load_u(&OF_SECTORS[1]), row);
    let bits = s.and_u(sectors, s.and_u(of_column, of_row));
    let is_low = s.lt_u(s.splat_u(0), s.and_u(bits, s.splat_u(0xffff)));
    let is_high = s.lt_u(s.splat_u(0xffff), bits);
    let [one, two, three] = [0, 1, 2].map(|level| s.splat(levels.distance[level]));
    s.select(is_high, s.select(is_low, three, two), s.select(is_low, one, s.splat(0.0)))
}

/// Where the ranges of rays can begin, at their `tmin` or later, given lower bounds of t where they cross their triangles and the
/// distances within which they meet nothing from there.
///
/// With a guess g of the length of a direction d, (g² + d²) / 2g is an upper bound of it, by the inequality of the means, and for a good guess
/// a close one. The slack is more than the rounding errors of all terms.
#[inline(always)]
fn begins<S: Simd>(s: S, fields: &[S::F; 8], start: S::F, within: S::F) -> S::F {
    let &[_, _, _, tmin, dx, dy, dz, _] = fields;
    let greatest = s.max_abs(s.max_abs(dx, dy), dz);
    let sum = s.add(s.add(s.abs(dx), s.abs(dy)), s.abs(dz));
    let guess = s.fma(s.sub(sum, greatest), s.splat(0.35), greatest);
    let square = s.fma(dz, dz, s.fma(dy, dy, s.mul(dx, dx)));
    // The division does not wait for the distance.
    let per_length = s.div(s.add(guess, guess), s.fma(guess, guess, square));
    let step = s.mul(within, per_length);
    let begin = s.fnma(s.sub(step, start), s.splat(4.0 * SLACK), s.add(start, step));
    let is_later = s.and(s.lt(s.splat(0.0), within), s.lt(tmin, begin));
    s.select(is_later, begin, tmin)
}

/// Bits of the lanes whose word has a bit in common with `bits`.
#[inline(always)]
fn lanes_with<S: Simd>(s: S, word: S::U, bits: u32) -> u32 {
    !s.mask_bits(s.eq_u(s.and_u(word, s.splat_u(bits)), s.splat_u(0))) & 0xffff
}
