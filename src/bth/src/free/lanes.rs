//! The decision about sixteen rays at a time, in f32.

use super::corners_at;
use crate::intersect::prepare::load_rays;
use crate::rays::Ray;
use crate::simd::{Kernel, LANES, Lanewise, Simd};
use bth_format::layout::{FREE_BINS, FREE_BORDERS, FREE_SIDE, FREE_STEEPEST, FreePlace, NONE};
use bth_format::object::ObjectView;
use std::ops::Range;

/// Directions are looked up whose greatest component in absolute value is between these, so that no product underflows or overflows.
pub(super) const DIRECTIONS: [f32; 2] = [1.0 / (1 << 20) as f32, (1 << 20) as f32];
/// Unit of rounding.
const U: f32 = f32::EPSILON / 2.0;

/// Appends to `rest` the indices of the rays of a range that may meet something.
pub(super) struct FreeKernel<'a, 'r> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) rays: &'a [Ray],
    /// For each ray the triangle on which it starts, or `NONE`.
    pub(super) from: &'a [u32],
    pub(super) range: Range<usize>,
    pub(super) rest: &'r mut Vec<u32>,
}

impl Kernel for FreeKernel<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let FreeKernel { object, rays, from, range, rest } = self;
        let reach = object.free_reach.first().map_or(0.0, |row| row.reach);
        let mut block = Block::new();
        let mut first = range.start;
        rest.reserve(range.len() + LANES);
        let hints = &from[..range.end];
        prefetch_rows(s, object, hints, first);
        prefetch_rows(s, object, hints, first + LANES);
        prefetch_leaves(s, object, hints, first);
        while let Some(chunk) = rays[first..range.end].first_chunk() {
            prefetch_rows(s, object, hints, first + 2 * LANES);
            prefetch_leaves(s, object, hints, first + LANES);
            let fields = load_rays(s, chunk);
            let free = block.free_lanes(s, object, &fields, &from[first..][..LANES], reach);
            for lane in 0..LANES {
                block.index[lane] = (first + lane) as u32;
            }
            let mut left = [0; LANES];
            let count = s.compress(!free & 0xffff, s.load_u(&block.index), &mut left);
            rest.extend_from_slice(&left[..count]);
            first += LANES;
        }
        rest.extend(first as u32..range.end as u32);
    }
}

/// Prefetches the rows of sixteen triangles.
#[inline(always)]
fn prefetch_rows<S: Simd>(s: S, object: &ObjectView<'_>, from: &[u32], first: usize) {
    for &triangle in from[first.min(from.len())..].iter().take(LANES) {
        s.prefetch(object.free.as_ptr().wrapping_add(triangle as usize));
    }
}

/// Prefetches the leaves in which sixteen triangles lie, whose rows are there. Those on a grid, and what is beyond the lines of an
/// indexed leaf, are not.
#[inline(always)]
fn prefetch_leaves<S: Simd>(s: S, object: &ObjectView<'_>, from: &[u32], first: usize) {
    let mut last = NONE;
    for &triangle in from[first.min(from.len())..].iter().take(LANES) {
        let Some(row) = object.free.get(triangle as usize) else { continue };
        let line = row.place >> 4 & FreePlace::INDEX_LIMIT;
        if line != last {
            last = line;
            let leaf = object.lines.as_ptr().wrapping_add(line as usize);
            for k in 0..4 {
                s.prefetch(leaf.wrapping_add(k));
            }
        }
    }
}

/// What is looked up for sixteen rays.
#[repr(C, align(64))]
struct Block {
    /// The bins of the directions.
    bins: [u32; LANES],
    /// Corners of the triangles, by corner and axis. Lanes whose triangle is not looked up hold any numbers.
    corners: [[[f32; LANES]; 3]; 3],
    index: [u32; LANES],
}

/// What follows from the triangles of the rays of a piece.
struct Crossings<S: Lanewise> {
    /// Bits of the rays whose line certainly crosses the triangle before `tmin` to its front, and to its back.
    front: u32,
    back: u32,
    /// Lower bounds of t there.
    start: S::F,
    /// The bins of the directions.
    bins: S::U,
}

impl Block {
    fn new() -> Self {
        Block { bins: [0; LANES], corners: [[[0.0; LANES]; 3]; 3], index: [0; LANES] }
    }

    /// Bits of the rays that certainly meet nothing, given the floats of the rays and the triangles on which they start.
    #[inline(always)]
    fn free_lanes<S: Simd>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        fields: &[S::F; 8],
        from: &[u32],
        reach: f32,
    ) -> u32 {
        let rows = object.free;
        let mut known = 0;
        for lane in 0..LANES {
            // A triangle that does not exist has no row, nor has NONE.
            let Some(corners) = rows.get(from[lane] as usize).and_then(|row| corners_at(object, row.place))
            else {
                continue;
            };
            known |= 1 << lane;
            for corner in 0..3 {
                for axis in 0..3 {
                    self.corners[corner][axis][lane] = corners[corner][axis];
                }
            }
        }
        if known == 0 {
            return 0;
        }
        let (mut to_front, mut to_back, mut start) = (0, 0, s.splat(0.0));
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let crossings = self.crossings(p, fields.map(|field| S::pick(p, &field)));
            to_front |= crossings.front;
            to_back |= crossings.back;
            S::put(p, &mut start, crossings.start);
            p.store_u(crossings.bins, &mut self.bins);
        }
        let (mut free, mut back, mut near) = (0, 0, 0);
        for lane in 0..LANES {
            let row = &rows[if known >> lane & 1 == 1 { from[lane] as usize } else { 0 }];
            let bin = self.bins[lane];
            free |= (row.bins[bin as usize / 32 % 4] >> (bin % 32) & 1) << lane;
            back |= (row.bins[3] >> 30 & 1) << lane;
            near |= (row.bins[3] >> 31) << lane;
        }
        free &= known & (to_front & !back | to_back & back);
        near &= free;
        if near != 0 {
            free &= !near | self.ends_within(s, fields, start, reach);
        }
        free
    }

    /// Bits of the rays that end within the reach of where they cross their triangle, for lower bounds of t there.
    #[inline(always)]
    fn ends_within<S: Simd>(&self, s: S, fields: &[S::F; 8], start: S::F, reach: f32) -> u32 {
        let &[_, _, _, _, dx, dy, dz, tmax] = fields;
        // Squares that underflow are less than that of any reach but 0 by more than the slack.
        let length = s.sub(s.fma(s.abs(tmax), s.splat(1.0 / (1 << 20) as f32), tmax), start);
        let mut square = s.splat(0.0);
        for component in [dx, dy, dz] {
            let part = s.mul(component, length);
            square = s.fma(part, part, square);
        }
        s.mask_bits(s.lt(square, s.splat(reach * reach * (1.0 - 1e-4))))
    }

    /// Where the lines of the rays cross the triangles. Derivation: as in the f64 decision about one ray, whose bounds these are with
    /// the unit of f32; terms with `MIN_POSITIVE` bound what underflows.
    #[inline(always)]
    fn crossings<S: Lanewise>(&self, s: S, fields: [S::F; 8]) -> Crossings<S> {
        let [ox, oy, oz, tmin, dx, dy, dz, _] = fields;
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let zero = s.splat(0.0);
        let mut p = [[zero; 3]; 3];
        let mut r = [[zero; 3]; 3];
        let mut far = zero;
        for corner in 0..3 {
            for k in 0..3 {
                p[corner][k] = s.load(&self.corners[corner][k]);
                r[corner][k] = s.sub(p[corner][k], o[k]);
                far = s.max_abs(far, r[corner][k]);
            }
        }
        let size = s.add(s.add(s.abs(dx), s.abs(dy)), s.abs(dz));
        let least = s.splat(f32::MIN_POSITIVE);
        let square = s.mul(far, far);
        let side_error = s.fma(s.mul(square, size), s.splat(20.0 * U), s.fma(size, least, least));
        let normal = cross(s, r[1], r[2]);
        let a = dot(s, d, normal);
        let b = dot(s, d, cross(s, r[2], r[0]));
        let c = dot(s, d, cross(s, r[0], r[1]));
        let above = s.and(s.and(s.lt(side_error, a), s.lt(side_error, b)), s.lt(side_error, c));
        let minus = s.sub(zero, side_error);
        let below = s.and(s.and(s.lt(a, minus), s.lt(b, minus)), s.lt(c, minus));

        let volume = dot(s, r[0], normal);
        let volume = s.select(above, volume, s.sub(zero, volume));
        let volume_error =
            s.fma(s.mul(square, far), s.splat(64.0 * U), s.fma(s.mul(far, s.splat(3.0)), least, least));
        let sum = s.abs(s.add(s.add(a, b), c));
        let sum_error = s.fma(side_error, s.splat(4.0), s.mul(sum, s.splat(8.0 * U)));
        let first = s.sub(tmin, s.fma(s.abs(tmin), s.splat(1.0 / (1 << 20) as f32), least));
        let bound = s.sub(s.fnma(s.abs(first), sum_error, s.mul(first, sum)), least);
        let before = s.lt(s.add(volume, volume_error), bound);

        let least_sum = s.sub(sum, sum_error);
        let start = s.div(s.min(s.sub(volume, volume_error), zero), least_sum);
        let greatest = s.max_abs(s.max_abs(dx, dy), dz);
        let is_usual = s.and(s.lt(s.splat(DIRECTIONS[0]), greatest), s.lt(greatest, s.splat(DIRECTIONS[1])));
        let usable = s.and(s.and(s.lt(zero, least_sum), before), is_usual);
        Crossings {
            front: s.mask_bits(s.and(above, usable)),
            back: s.mask_bits(s.and(below, usable)),
            start,
            bins: bins(s, &p, d),
        }
    }
}

#[inline(always)]
fn dot<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], s.mul(a[0], b[0])))
}

#[inline(always)]
fn cross<S: Lanewise>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    [
        s.fnma(a[2], b[1], s.mul(a[1], b[2])),
        s.fnma(a[0], b[2], s.mul(a[2], b[0])),
        s.fnma(a[1], b[0], s.mul(a[0], b[1])),
    ]
}

/// The bins of directions ([`bth_format::layout::free_bin`]), or [`FREE_BINS`], whose bit is never set.
///
/// The errors of the axes are 5 units of the lengths of the edges, those of their products with a direction a few more: relative to
/// the normal, which is at least 1/128 of the product of the edges, less than 2^-13, a sixteenth of the margin. For edges and
/// directions in their ranges nothing overflows, and what underflows is less than that.
#[inline(always)]
fn bins<S: Lanewise>(s: S, corners: &[[S::F; 3]; 3], d: [S::F; 3]) -> S::U {
    let zero = s.splat(0.0);
    let (mut e, mut f) = ([zero; 3], [zero; 3]);
    for k in 0..3 {
        e[k] = s.sub(corners[1][k], corners[0][k]);
        f[k] = s.sub(corners[2][k], corners[0][k]);
    }
    let normal = cross(s, e, f);
    let per_height = s.div(s.splat(1.0), dot(s, d, normal));
    let per_square = s.div(s.splat(1.0), dot(s, e, e));
    let x = s.mul(dot(s, d, e), per_height);
    let y = s.mul(dot(s, d, cross(s, normal, e)), per_height);
    // Squares of the slopes. Signs are those of the components, not of the slopes, which are negated on the back.
    let x_square = s.mul(s.mul(s.mul(x, x), per_square), dot(s, normal, normal));
    let y_square = s.mul(s.mul(y, y), per_square);
    let upwards = s.lt(zero, per_height);
    let (x_negative, x_beyond) = column(s, (x, x_square), upwards, 1);
    let (y_negative, y_beyond) = column(s, (y, y_square), upwards, FREE_SIDE as u32);
    let middle = s.splat_u((FREE_BINS / 2) as u32);
    let flat = s.and(s.lt(x_square, s.splat(STEEPEST)), s.lt(y_square, s.splat(STEEPEST)));
    let bin = add_signed(s, middle, x_negative, x_beyond);
    let bin = add_signed(s, bin, y_negative, y_beyond);
    s.select_u(flat, bin, s.splat_u(FREE_BINS as u32))
}

/// Whether a component is negative, given the slope and its square, and its columns beyond the middle times a unit.
#[inline(always)]
fn column<S: Lanewise>(s: S, (slope, square): (S::F, S::F), upwards: S::M, unit: u32) -> (S::M, S::U) {
    let zero = s.splat(0.0);
    let mut beyond = s.splat_u(0);
    for border in FREE_BORDERS {
        beyond = s.add_where(beyond, s.lt(s.splat(border as f32), square), s.splat_u(unit));
    }
    let negative = s.or(s.and(upwards, s.lt(slope, zero)), s.and_not(s.lt(zero, slope), upwards));
    (negative, beyond)
}

/// Square of the greatest slope.
const STEEPEST: f32 = (FREE_STEEPEST * FREE_STEEPEST) as f32;

/// a ± b, the latter where the mask is set.
#[inline(always)]
fn add_signed<S: Lanewise>(s: S, a: S::U, negative: S::M, b: S::U) -> S::U {
    let ones = s.select_u(negative, s.splat_u(u32::MAX), s.splat_u(0));
    s.add_u(a, s.add_where(s.xor_u(b, ones), negative, s.splat_u(1)))
}
