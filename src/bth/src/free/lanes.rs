//! The decision about sixteen rays at a time, in f32.

use super::corners_at;
use crate::intersect::prepare::load_rays;
use crate::rays::Ray;
use crate::simd::{Kernel, LANES, Lanewise, Simd};
use bth_format::layout::{
    CacheLine, Child, FREE_BINS, FREE_BORDERS, FREE_SIDE, FREE_STEEPEST, FreePlace, NONE,
};
use bth_format::object::{NodeBase, ObjectView};
use std::ops::Range;

/// Directions are looked up whose greatest component in absolute value is between these, so that no product underflows or overflows.
pub(super) const DIRECTIONS: [f32; 2] = [1.0 / (1 << 20) as f32, (1 << 20) as f32];
/// Rays in a cache line.
const RAYS_PER_LINE: usize = size_of::<CacheLine>() / size_of::<Ray>();
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
        // What is stored lane by lane and loaded at once waits until the stores are done, so sixteen rays are fetched before the sixteen
        // before them are decided.
        let mut starts = [Starts::NONE; 2];
        let mut index = [0; LANES];
        rest.reserve(range.len() + LANES);
        let (blocks, _) = from[range.clone()].as_chunks::<LANES>();
        let block = |i: usize| Hints::new(s, blocks.get(i).unwrap_or(&[NONE; LANES]));
        let mut ahead = [block(0), block(1)];
        ahead[0].prefetch_rows(s, object);
        ahead[1].prefetch_rows(s, object);
        ahead[0].prefetch_leaves(s, object);
        for i in 0..=blocks.len() {
            let next = block(i + 2);
            next.prefetch_rows(s, object);
            ahead[1].prefetch_leaves(s, object);
            for line in 0..LANES / RAYS_PER_LINE {
                s.prefetch(rays.as_ptr().wrapping_add(range.start + (i + 1) * LANES + line * RAYS_PER_LINE));
            }
            starts[i % 2].fetch(object, &ahead[0]);
            ahead = [ahead[1], next];
            let Some(before) = i.checked_sub(1) else { continue };
            let first = range.start + before * LANES;
            let Some(chunk) = rays[first..].first_chunk() else { break };
            let free = starts[before % 2].free_lanes(s, &load_rays(s, chunk), reach);
            for lane in 0..LANES {
                index[lane] = (first + lane) as u32;
            }
            let mut left = [0; LANES];
            let count = s.compress(!free & 0xffff, s.load_u(&index), &mut left);
            rest.extend_from_slice(&left[..count]);
        }
        rest.extend((range.start + blocks.len() * LANES) as u32..range.end as u32);
    }
}

/// The triangles on which sixteen rays start.
#[derive(Clone, Copy)]
struct Hints<'a> {
    triangle: &'a [u32; LANES],
    /// Bits of the rays that start on another triangle than the one before. Neighbouring rays often start on the same one.
    new: u32,
}

impl<'a> Hints<'a> {
    #[inline(always)]
    fn new<S: Simd>(s: S, triangle: &'a [u32; LANES]) -> Self {
        static BEFORE: [u32; LANES] = [0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14];
        let of = s.load_u(triangle);
        let same = s.mask_bits(s.eq_u(of, s.lookup_u(of, s.load_u(&BEFORE))));
        Hints { triangle, new: !same & 0xffff | 1 }
    }

    /// Prefetches the rows of the triangles.
    #[inline(always)]
    fn prefetch_rows<S: Simd>(&self, s: S, object: &ObjectView<'_>) {
        for &triangle in self.triangle {
            s.prefetch(object.free.as_ptr().wrapping_add(triangle as usize));
        }
    }

    /// Prefetches the leaves in which the triangles lie, whose rows are there. Those on a grid, and what is beyond the lines of an
    /// indexed leaf, are not.
    #[inline(always)]
    fn prefetch_leaves<S: Simd>(&self, s: S, object: &ObjectView<'_>) {
        let mut new = self.new;
        while new != 0 {
            let lane = new.trailing_zeros() as usize % LANES;
            new &= new - 1;
            let Some(row) = object.free.get(self.triangle[lane] as usize) else { continue };
            let leaf = object.lines.as_ptr().wrapping_add((row.place >> 4 & FreePlace::INDEX_LIMIT) as usize);
            for k in 0..4 {
                s.prefetch(leaf.wrapping_add(k));
            }
        }
    }
}

/// What the file knows of the triangles on which sixteen rays start.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Starts {
    /// For each ray the column of its triangle: the first ray that starts there.
    column: [u32; LANES],
    /// Whether all rays have columns of their own.
    is_expanded: bool,
    /// Corners of the triangles, by corner and axis. Triangles of which nothing is known have no area.
    corners: [[[f32; LANES]; 3]; 3],
    /// The words of their bins.
    bins: [[u32; LANES]; 4],
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

/// 2^i for lane i.
static POWERS: [u32; LANES] = [
    1,
    1 << 1,
    1 << 2,
    1 << 3,
    1 << 4,
    1 << 5,
    1 << 6,
    1 << 7,
    1 << 8,
    1 << 9,
    1 << 10,
    1 << 11,
    1 << 12,
    1 << 13,
    1 << 14,
    1 << 15,
];

impl Starts {
    const NONE: Starts = Starts {
        column: [0; LANES],
        is_expanded: false,
        corners: [[[0.0; LANES]; 3]; 3],
        bins: [[0; LANES]; 4],
    };

    /// Reads the triangles.
    #[inline(always)]
    fn fetch(&mut self, object: &ObjectView<'_>, hints: &Hints<'_>) {
        let (mut new, base) = (hints.new, object.node_base());
        self.is_expanded = new == 0xffff;
        while new != 0 {
            let lane = new.trailing_zeros() as usize % LANES;
            new &= new - 1;
            self.set(object, base, hints.triangle[lane], lane);
        }
        let mut column = 0;
        for lane in 0..LANES as u32 {
            column = if hints.new >> lane & 1 != 0 { lane } else { column };
            self.column[lane as usize] = column;
        }
    }

    #[inline(always)]
    fn set(&mut self, object: &ObjectView<'_>, base: NodeBase<'_>, triangle: u32, column: usize) {
        // A triangle that does not exist has no row, nor has NONE.
        let Some(row) = object.free.get(triangle as usize) else {
            return self.set_corners([[0.0; 3]; 3], column);
        };
        for word in 0..4 {
            self.bins[word][column] = row.bins[word];
        }
        // Most triangles lie in indexed leaves of f32.
        let leaf = if row.place & FreePlace::RAW == 0 {
            base.indexed_leaf(Child::LEAF_BIT | row.place >> 4)
        } else {
            None
        };
        let Some(leaf) = leaf else {
            return self.set_corners(corners_at(object, row.place).unwrap_or_default(), column);
        };
        let slot = row.place as usize % LANES;
        for corner in 0..3 {
            let vertex = usize::from(leaf.corner[corner][slot]) % LANES;
            for axis in 0..3 {
                self.corners[corner][axis][column] = leaf.vertex[axis][vertex];
            }
        }
    }

    /// Sets the corners of a triangle. Nothing is known of one that has no area.
    #[inline(never)]
    fn set_corners(&mut self, corners: [[f32; 3]; 3], column: usize) {
        for corner in 0..3 {
            for axis in 0..3 {
                self.corners[corner][axis][column] = corners[corner][axis];
            }
        }
    }

    /// Copies each triangle to the lanes of its rays.
    #[inline(always)]
    fn expand<S: Simd>(&mut self, s: S) {
        if self.is_expanded {
            return;
        }
        let column = s.load_u(&self.column);
        for corner in &mut self.corners {
            for row in corner {
                s.store(s.lookup(s.load(row), column), row);
            }
        }
        for row in &mut self.bins {
            s.store_u(s.lookup_u(s.load_u(row), column), row);
        }
    }

    /// Bits of the rays that certainly meet nothing, given the floats of the rays.
    #[inline(always)]
    fn free_lanes<S: Simd>(&mut self, s: S, fields: &[S::F; 8], reach: f32) -> u32 {
        self.expand(s);
        let (mut to_front, mut to_back, mut start) = (0, 0, s.splat(0.0));
        let mut bins = [0; LANES];
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let crossings = self.crossings(p, fields.map(|field| S::pick(p, &field)));
            to_front |= crossings.front;
            to_back |= crossings.back;
            S::put(p, &mut start, crossings.start);
            p.store_u(crossings.bins, &mut bins);
        }
        let bin = s.load_u(&bins);
        let mut words = [s.splat_u(0); 4];
        for word in 0..4 {
            words[word] = s.load_u(&self.bins[word]);
        }
        let mut word = words[3];
        for k in [2, 1, 0] {
            word = s.select_u(s.lt_u(bin, s.splat_u(32 * (k + 1))), words[k as usize], word);
        }
        let power = s.lookup_u(s.load_u(&POWERS), bin);
        let in_lower_half = s.eq_u(s.and_u(bin, s.splat_u(16)), s.splat_u(0));
        let bit = s.select_u(in_lower_half, power, s.shl_u::<16>(power));
        let back = lanes_with(s, words[3], 1 << 30);
        let blocked = s.mask_bits(s.eq_u(s.and_u(word, bit), s.splat_u(0)));
        let mut free = !blocked & (to_front & !back | to_back & back);
        let near = lanes_with(s, words[3], 1 << 31) & free;
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

/// Bits of the lanes whose word has a bit in common with `bits`.
#[inline(always)]
fn lanes_with<S: Simd>(s: S, word: S::U, bits: u32) -> u32 {
    !s.mask_bits(s.eq_u(s.and_u(word, s.splat_u(bits)), s.splat_u(0))) & 0xffff
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
