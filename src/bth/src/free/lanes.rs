//! The decision about sixteen rays at a time, in f32.

use super::crossings::Crossings;
use super::starts::{Hints, Starts};
use crate::intersect::prepare::{load_rays, pick_rays};
use crate::rays::Ray;
use crate::simd::{Kernel, LANES, Lanewise, Simd};
use bth_format::layout::{CacheLine, FreeBins, NONE};
use bth_format::object::ObjectView;
use std::ops::Range;

/// Rays in a cache line.
const RAYS_PER_LINE: usize = size_of::<CacheLine>() / size_of::<Ray>();
/// Bits of the last word of bins.
const BACK: u32 = (FreeBins::BACK >> 96) as u32;
const NEARBY: u32 = (FreeBins::NEARBY >> 96) as u32;
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
        let mut ahead = [hints(s, blocks, 0), hints(s, blocks, 1)];
        ahead[0].prefetch_rows(s, object);
        ahead[1].prefetch_rows(s, object);
        ahead[0].prefetch_leaves(s, object);
        for i in 0..=blocks.len() {
            let next = hints(s, blocks, i + 2);
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
            let free = free_lanes(s, &mut starts[before % 2], &load_rays(s, chunk), reach);
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

/// The hints of a group of sixteen rays; beyond the last one, none.
#[inline(always)]
fn hints<S: Simd>(s: S, groups: &[[u32; LANES]], i: usize) -> Hints<'_> {
    Hints::new(s, groups.get(i).unwrap_or(&[NONE; LANES]))
}

/// Bits of the rays that certainly meet nothing, given the floats of the rays.
#[inline(always)]
fn free_lanes<S: Simd>(s: S, starts: &mut Starts, fields: &[S::F; 8], reach: f32) -> u32 {
    starts.expand(s);
    let (mut to_front, mut to_back, mut start) = (0, 0, s.splat(0.0));
    let mut bins = [0; LANES];
    for i in 0..S::PIECES {
        let p = s.piece(i);
        let crossings = Crossings::new(p, &starts.corners, pick_rays::<S>(p, fields));
        to_front |= crossings.front;
        to_back |= crossings.back;
        S::put(p, &mut start, crossings.start);
        p.store_u(crossings.bins, &mut bins);
    }
    let bin = s.load_u(&bins);
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
    let blocked = s.mask_bits(s.eq_u(s.and_u(word, bit), s.splat_u(0)));
    let mut free = !blocked & (to_front & !back | to_back & back);
    let near = lanes_with(s, words[3], NEARBY) & free;
    if near != 0 {
        free &= !near | ends_within(s, fields, start, reach);
    }
    free
}

/// Bits of the rays that end within the reach of where they cross their triangle, for lower bounds of t there.
#[inline(always)]
fn ends_within<S: Simd>(s: S, fields: &[S::F; 8], start: S::F, reach: f32) -> u32 {
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

/// Bits of the lanes whose word has a bit in common with `bits`.
#[inline(always)]
fn lanes_with<S: Simd>(s: S, word: S::U, bits: u32) -> u32 {
    !s.mask_bits(s.eq_u(s.and_u(word, s.splat_u(bits)), s.splat_u(0))) & 0xffff
}
