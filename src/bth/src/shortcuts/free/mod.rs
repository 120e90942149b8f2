//! What rays that start on triangles certainly do not hit.
//!
//! For directions in bins, a file may say that rays that leave a triangle hit nothing else, at all
//! or within a distance (specification, "Free directions"). A ray whose bin is free hits nothing;
//! another one begins behind that distance, where boxes and triangles before it are skipped.
//! Neither changes an answer. Where a direction is in doubt, the ray is traced from its start.

mod columns;
mod leaving;
#[cfg(test)]
mod tests;

pub(crate) use columns::{FreeColumns, FreeRow, NoRow};

use crate::intersect::start::start_corners;
use crate::intersect::start_point::StartPoint;
use crate::simd::{LANES, Lanewise, Simd};
use bth_format::layout::{FREE_BINS, FREE_SECTOR_OF, FREE_SIDE, FreeLevels, KnownFree};
use bth_format::object::ObjectView;
use columns::BACK;
use leaving::{Leaving, SLACK};

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
/// For each column and each row the bits of the levels in the sectors that hold it. Lanes without a
/// column have none.
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

/// Where the range of a ray in the space of an object can begin, given the triangle and the point
/// at which it starts: infinite in a free direction, 0 where nothing is known.
#[inline(always)]
pub(crate) fn begin<S: Simd>(
    s: S,
    object: &ObjectView<'_>,
    triangle: u32,
    point: &StartPoint,
    direction: [f32; 3],
) -> f32 {
    match object.known_free(triangle as usize) {
        Some(known) => known_begin(s, object, &known, point, direction).unwrap_or(0.0),
        None => 0.0,
    }
}

#[inline(always)]
fn known_begin<S: Simd>(
    s: S,
    object: &ObjectView<'_>,
    known: &KnownFree,
    point: &StartPoint,
    direction: [f32; 3],
) -> Option<f32> {
    let corners = start_corners(object, point.leaf, point.slot)?;
    // All lanes do the same.
    let p = s.piece(0);
    let d = [p.splat(direction[0]), p.splat(direction[1]), p.splat(direction[2])];
    let Leaving { front, back, columns } = Leaving::new(p, |corner, k| p.splat(corners[corner][k]), d);
    let (mut column, mut row) = ([0; LANES], [0; LANES]);
    p.store_u(columns[0], &mut column);
    p.store_u(columns[1], &mut row);
    let (column, row) = (column[0] as usize, row[0] as usize);
    if (front | back) & 1 == 0 || column >= FREE_SIDE || row >= FREE_SIDE {
        return None;
    }
    let (bin, is_back) = (FREE_SIDE * row + column, back & 1 != 0);
    if known.bins.is_free(bin) && known.bins.is_back() == is_back {
        return Some(f32::INFINITY);
    }
    let level = known.sectors[usize::from(is_back)].level_of_bin(bin);
    if level == 0 {
        return None;
    }
    let within = object.free_levels.first()?.within(level);
    let [x, y, z] = direction;
    // The slack is more than the rounding errors of all terms.
    Some(within / (x * x + y * y + z * z).sqrt() * (1.0 - 4.0 * SLACK))
}

/// Prefetches what [`begin`] reads.
#[inline(always)]
pub(crate) fn prefetch<S: Simd>(s: S, object: &ObjectView<'_>, triangle: u32) {
    let at = triangle as usize;
    if object.free.is_empty() {
        s.prefetch(object.free_distances.as_ptr().wrapping_add(at));
    } else {
        s.prefetch(object.free.as_ptr().wrapping_add(at));
    }
}

/// Bits of the rays in free directions, and where the ranges of the others can begin, given the
/// corners of the triangles on which they start, what the file knows of these, and the directions.
#[inline(always)]
pub(crate) fn free_rays<S: Simd, R: FreeRow>(
    s: S,
    corners: &[[[f32; LANES]; 3]; 3],
    known: &FreeColumns,
    direction: [S::F; 3],
    levels: &FreeLevels,
) -> (u32, S::F) {
    let (mut to_front, mut to_back) = (0, 0);
    let mut columns = [[0; LANES]; 2];
    for i in 0..S::PIECES {
        let p = s.piece(i);
        let d = [S::pick(p, &direction[0]), S::pick(p, &direction[1]), S::pick(p, &direction[2])];
        let leaving = Leaving::new(p, |corner, k| p.load(&corners[corner][k]), d);
        to_front |= leaving.front;
        to_back |= leaving.back;
        p.store_u(leaving.columns[0], &mut columns[0]);
        p.store_u(leaving.columns[1], &mut columns[1]);
    }
    let [column, row] = [s.load_u(&columns[0]), s.load_u(&columns[1])];
    let free = if R::HAS_BINS { free_lanes(s, known, [column, row], [to_front, to_back]) } else { 0 };
    let sectors = [s.load_u(&known.sectors[0]), s.load_u(&known.sectors[1])];
    let none = s.splat_u(0);
    let of_side = s.select_u(s.mask(to_front), sectors[0], s.select_u(s.mask(to_back), sectors[1], none));
    (free, begins(s, direction, within(s, of_side, [column, row], levels)))
}

/// Bits of the rays in free directions, given their columns and rows, and the bits of those to the
/// front and to the back.
#[inline(always)]
fn free_lanes<S: Simd>(
    s: S,
    known: &FreeColumns,
    [column, row]: [S::U; 2],
    [to_front, to_back]: [u32; 2],
) -> u32 {
    let bin = s.add_u(s.lookup_u(s.load_u(&FIRST_BIN), row), column);
    let mut words = [s.splat_u(0); 4];
    for word in 0..4 {
        words[word] = s.load_u(&known.bins[word]);
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

/// The distances within which nothing is hit, given the sectors of the sides to which rays go, and
/// their columns and rows.
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

/// Where the ranges of rays can begin, given the distances within which they hit nothing.
///
/// With a guess g of the length of a direction d, (g² + d²) / 2g is an upper bound of it, by the
/// inequality of the means, and for a good guess a close one. The slack is more than the rounding
/// errors of all terms.
#[inline(always)]
fn begins<S: Simd>(s: S, [dx, dy, dz]: [S::F; 3], within: S::F) -> S::F {
    let greatest = s.max_abs(s.max_abs(dx, dy), dz);
    let sum = s.add(s.add(s.abs(dx), s.abs(dy)), s.abs(dz));
    let guess = s.fma(s.sub(sum, greatest), s.splat(0.35), greatest);
    let square = s.fma(dz, dz, s.fma(dy, dy, s.mul(dx, dx)));
    // The division does not wait for the distance.
    let per_length = s.div(s.add(guess, guess), s.fma(guess, guess, square));
    let begin = s.mul(s.mul(within, per_length), s.splat(1.0 - 4.0 * SLACK));
    s.select(s.lt(s.splat(0.0), within), begin, s.splat(0.0))
}

/// Bits of the lanes whose word has a bit in common with `bits`.
#[inline(always)]
fn lanes_with<S: Simd>(s: S, word: S::U, bits: u32) -> u32 {
    !s.mask_bits(s.eq_u(s.and_u(word, s.splat_u(bits)), s.splat_u(0))) & 0xffff
}
