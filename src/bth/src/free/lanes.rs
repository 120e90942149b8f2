//! The decision about sixteen rays at a time, in f32.

use super::corners_at;
use crate::intersect::prepare::load_rays;
use crate::rays::Ray;
use crate::simd::{Kernel, LANES, Simd};
use bth_format::layout::{FREE_BORDER, FREE_SIDE, NONE};
use bth_format::object::ObjectView;
use std::ops::Range;

/// Directions all of whose components are below it in absolute value are not looked up.
pub(super) const LEAST_DIRECTION: f32 = 1.0 / (1u128 << 100) as f32;
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
        while let Some(chunk) = rays[first..range.end].first_chunk() {
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

/// What is looked up for sixteen rays.
#[repr(C, align(64))]
struct Block {
    /// The bins of the directions.
    bins: [u32; LANES],
    /// Corners of the triangles, by corner and axis. Lanes whose triangle is not looked up hold any numbers.
    corners: [[[f32; LANES]; 3]; 3],
    index: [u32; LANES],
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
        let &[_, _, _, tmin, dx, dy, dz, tmax] = fields;
        s.store_u(bins(s, [dx, dy, dz]), &mut self.bins);
        let short = s.mask_bits(s.lt(tmax, s.splat(f32::INFINITY)));
        let (mut all, mut near) = (0, 0);
        let mut places = [NONE; LANES];
        for lane in 0..LANES {
            // A triangle that does not exist has no row, nor has NONE. Which lanes are free is not predictable: there are no branches.
            let exists = (from[lane] as usize) < object.free.len();
            let row = &object.free[if exists { from[lane] as usize } else { 0 }];
            let digit = if exists { row.digit(self.bins[lane] as usize) } else { 0 };
            places[lane] = row.place;
            all |= (digit >> 1) << lane;
            near |= (digit & 1) << lane;
        }
        near &= short;
        let mut wanted = all | near;
        while wanted != 0 {
            let lane = wanted.trailing_zeros() as usize % LANES;
            wanted &= wanted - 1;
            let Some(corners) = corners_at(object, places[lane]) else {
                (all, near) = (all & !(1 << lane), near & !(1 << lane));
                continue;
            };
            for corner in 0..3 {
                for axis in 0..3 {
                    self.corners[corner][axis][lane] = corners[corner][axis];
                }
            }
        }
        if all | near == 0 {
            return 0;
        }
        let (crosses, start) = self.crossings(s, fields, tmin);
        let mut free = all & crosses;
        if near & crosses != 0 {
            // Squares that underflow are less than that of any reach but 0 by more than the slack.
            let length = s.sub(s.fma(s.abs(tmax), s.splat(1.0 / (1 << 20) as f32), tmax), start);
            let mut square = s.splat(0.0);
            for component in [dx, dy, dz] {
                let part = s.mul(component, length);
                square = s.fma(part, part, square);
            }
            let within = s.lt(square, s.splat(reach * reach * (1.0 - 1e-4)));
            free |= near & crosses & s.mask_bits(within);
        }
        free
    }

    /// Bits of the rays whose line certainly crosses the triangle before `tmin`, and lower bounds of t there. Derivation: as in the
    /// f64 decision about one ray, whose bounds these are with the unit of f32; terms with `MIN_POSITIVE` bound what underflows.
    #[inline(always)]
    fn crossings<S: Simd>(&self, s: S, fields: &[S::F; 8], tmin: S::F) -> (u32, S::F) {
        let &[ox, oy, oz, _, dx, dy, dz, _] = fields;
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let zero = s.splat(0.0);
        let mut r = [[zero; 3]; 3];
        let mut far = zero;
        for corner in 0..3 {
            for k in 0..3 {
                r[corner][k] = s.sub(s.load(&self.corners[corner][k]), o[k]);
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
        let usable = s.and(s.lt(zero, least_sum), s.lt(s.splat(LEAST_DIRECTION), s.max_abs(s.max_abs(dx, dy), dz)));
        (s.mask_bits(s.and(s.and(s.or(above, below), before), usable)), start)
    }
}

#[inline(always)]
fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], s.mul(a[0], b[0])))
}

#[inline(always)]
fn cross<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    [
        s.fnma(a[2], b[1], s.mul(a[1], b[2])),
        s.fnma(a[0], b[2], s.mul(a[2], b[0])),
        s.fnma(a[1], b[0], s.mul(a[0], b[1])),
    ]
}

/// The bins of directions ([`bth_format::layout::free_bin`]); some bin for what is no number.
#[inline(always)]
fn bins<S: Simd>(s: S, [x, y, z]: [S::F; 3]) -> S::U {
    let zero = s.splat(0.0);
    let (ax, ay, az) = (s.abs(x), s.abs(y), s.abs(z));
    let along_x = s.and(s.le(ay, ax), s.le(az, ax));
    let along_y = s.and_not(s.le(az, ay), along_x);
    let depth = s.select(along_x, x, s.select(along_y, y, z));
    let u = s.select(along_x, y, s.select(along_y, z, x));
    let v = s.select(along_x, z, s.select(along_y, x, y));
    let border = s.mul(s.abs(depth), s.splat(FREE_BORDER));
    let column = |a: S::F| (s.lt(a, zero), s.lt(border, s.abs(a)));
    let number = |(negative, outer): (S::M, S::M), unit: u32| {
        let of = |n: u32| s.splat_u(n * unit);
        let below = s.select_u(outer, of(0), of(1));
        s.select_u(negative, below, s.select_u(outer, of(3), of(2)))
    };
    let face = s.select_u(along_x, s.splat_u(0), s.select_u(along_y, s.splat_u(32), s.splat_u(64)));
    let half = s.select_u(s.lt(depth, zero), s.splat_u(16), s.splat_u(0));
    let (columns, rows) = (number(column(u), 1), number(column(v), FREE_SIDE as u32));
    s.add_u(s.add_u(face, half), s.add_u(columns, rows))
}
