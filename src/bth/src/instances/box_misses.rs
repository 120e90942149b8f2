//! Rays that meet the box of no instance but that on which they start, sixteen at a time.
//!
//! A ray that certainly does not meet the instance on which it starts ([`super::free_starts`]) and no other instance's box meets
//! nothing. In lanes that takes a part of the instructions of its own way through the top level, where that has few nodes: sixteen rays
//! in all directions reach most of them.

use super::scene_batch::SceneBatch;
use super::top_level::TopLevel;
use super::top_nodes::{INSTANCE, used};
use crate::bvh::packet::ray_group::GroupSlabs;
use crate::intersect::prepare::{CommonAxis, gather_rays, pick_rays, prepare_lanes};
use crate::query::sink::Visit;
use crate::simd::{Kernel, LANES, Lanewise, Simd};
use bth_format::layout::{NODE_LINES, NONE};
use bth_format::object::ObjectBounds;

/// Greatest number of nodes of a top level.
const MAX_NODES: usize = 16;
/// Rays that are tested before it is known whether to go on.
const PROBE: usize = 8 * LANES;
/// The least share of these rays, one in this many, that must meet nothing for the test to cost less than it saves.
const LEAST: usize = 8;

/// Kernel that marks rays which meet no box.
pub(super) struct MarkBoxMisses<'a> {
    pub(super) batch: &'a SceneBatch<'a>,
    /// Rays, and for each the instance that it certainly does not meet.
    pub(super) starts: &'a [Visit],
    /// Index in the batch of the ray of the first mark.
    pub(super) first: usize,
    /// By ray; `false` before.
    pub(super) marks: &'a mut [bool],
}

impl MarkBoxMisses<'_> {
    /// Whether rays through a top level can be marked.
    pub(super) fn is_applicable(top: &TopLevel) -> bool {
        (1..=MAX_NODES).contains(&(top.lines.len() / NODE_LINES))
    }
}

impl Kernel for MarkBoxMisses<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let MarkBoxMisses { batch, starts, first, marks } = self;
        let top = &batch.world.top;
        let bounds = top.cube;
        let mut marked = 0;
        for (group, starts) in starts.chunks(LANES).enumerate() {
            if group * LANES == PROBE && marked * LEAST < PROBE {
                return;
            }
            let (mut at, mut own) = ([starts[0].ray; LANES], [NONE; LANES]);
            for (lane, start) in starts.iter().enumerate() {
                (at[lane], own[lane]) = (start.ray, INSTANCE | start.instance);
            }
            let lanes = s.mask(((1u64 << starts.len()) - 1) as u32);
            let field = gather_rays(s, lanes, batch.rays, s.load_u(&at));
            let own = s.floats(s.load_u(&own));
            let mut misses = 0;
            for i in 0..S::PIECES {
                let p = s.piece(i);
                let (field, own) = (pick_rays::<S>(p, &field), p.bits(S::pick(p, &own)));
                misses |= box_misses(p, top, &bounds, field, own);
            }
            misses &= s.mask_bits(lanes);
            marked += misses.count_ones() as usize;
            for (lane, start) in starts.iter().enumerate() {
                marks[start.ray as usize - first] = misses >> lane & 1 != 0;
            }
        }
    }
}

/// The rays, a bit each, that certainly meet no instance's box but that of their own instance, whose child codes are `own`. `bounds` are
/// those of all boxes.
#[inline(always)]
fn box_misses<L: Lanewise>(p: L, top: &TopLevel, bounds: &ObjectBounds, field: [L::F; 8], own: L::U) -> u32 {
    // The boxes are wide enough for rays from within the reach.
    let farthest = p.max(p.max(p.abs(field[0]), p.abs(field[1])), p.abs(field[2]));
    let is_near = p.mask_bits(p.le(farthest, p.splat(top.reach)));
    // Boxes do not need to know the greatest axis.
    let prepared = prepare_lanes(p, bounds, field, &CommonAxis(2));
    let slabs = GroupSlabs::of(&prepared);
    let mut open = is_near & p.mask_bits(prepared.usable);
    let (mut stack, mut height) = ([0; MAX_NODES], 1);
    while height > 0 && open != 0 {
        height -= 1;
        let node = top.node(stack[height % MAX_NODES]);
        for slot in 0..used(node) {
            let code = node.child[slot];
            let corners = [0, 1].map(|end| [0, 1, 2].map(|k| node.bounds[k][end][slot]));
            let is_own = p.mask_bits(p.eq_u(own, p.splat_u(code)));
            let meets = slabs.may_enter(p, corners, (true, false)) & open & !is_own;
            if code & INSTANCE != 0 {
                open &= !meets;
            } else if meets != 0 {
                // A node is stacked once, so no more than there are.
                stack[height % MAX_NODES] = code;
                height += 1;
            }
        }
    }
    open
}
