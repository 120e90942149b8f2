//! Traversal of the top level by single rays, from one instance to the next, nearest boxes first.
//!
//! The rays of a block advance alternately, one step each, so that their memory latencies overlap. A ray stops at each instance
//! until it has been traced in it.

use super::box_tests::{limit, widened_slabs};
use super::listed_rays::{ListedRays, RayToList};
use super::met_by_lanes::RaysTogether;
use super::progress::Progress;
use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use crate::bvh::ray_state::key_limit;
use crate::bvh::stack::{BOTTOM, StackPosition, Stacks};
use crate::intersect::boxes::RaySlabs;
use crate::intersect::prepare::{Prepared, PreparedRay};
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;

/// Number of rays that advance alternately; their states fit in the first-level cache.
const BLOCK: usize = 64;

/// Rays in the top level, by their index in the chunk.
#[derive(Debug, Default)]
pub(super) struct RayTraversals {
    states: Vec<TopLevelRay>,
    /// One stack for each ray.
    stacks: Stacks,
}

/// State of a ray in the top level.
#[derive(Clone, Copy, Debug)]
struct TopLevelRay {
    /// The ray's constants for box tests. A depth is t times the greatest |component| of the direction.
    slabs: RaySlabs,
    /// Greatest t of hits that can still change the result.
    tmax: f32,
    /// Greatest depth of such hits.
    limit: f32,
    /// The top of the ray's stack.
    top: StackPosition,
}

impl RayTraversals {
    /// Starts the rays whose indices are in `active`, and removes those that cannot hit anything.
    #[inline(always)]
    pub(super) fn start<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        rays: &[Ray],
        active: &mut Vec<u32>,
        (lists, first_ray, visits): (&mut ListedRays, u32, &mut Vec<Visit>),
    ) {
        if S::HAS_VECTORS {
            lists.clear(rays.len());
        }
        if top.is_empty() || active.is_empty() {
            return active.clear();
        }
        self.stacks.reserve_for(top.depth as usize, rays.len());
        let vacant = TopLevelRay { slabs: RaySlabs::NONE, tmax: 0.0, limit: 0.0, top: StackPosition::FIRST };
        if self.states.len() < rays.len() {
            self.states.resize(rays.len(), vacant);
        }
        let mut prepared = Prepared::new();
        let mut index = [0; LANES];
        let mut kept = 0;
        for first in (0..active.len()).step_by(LANES) {
            let count = LANES.min(active.len() - first);
            index[..count].copy_from_slice(&active[first..first + count]);
            let mut done = 0;
            if S::HAS_VECTORS && lists.may_list_together() {
                let together = RaysTogether { top, rays, at: &index, count };
                done = lists.list_together(s, &together, (first_ray, visits));
                if done.count_ones() as usize == count {
                    continue;
                }
            }
            // Without vectors, preparation in lanes takes as long as one ray after the other, and much code.
            if S::HAS_VECTORS {
                prepared.fill(s, &top.cube, rays, &index, count);
            }
            let lists_rays = S::HAS_VECTORS && lists.may_list();
            let mut listed = [RayToList::NONE; LANES];
            let mut listed_count = 0;
            for (lane, &ray_index) in index[..count].iter().enumerate() {
                if done >> lane & 1 != 0 {
                    continue;
                }
                let ray = &rays[ray_index as usize];
                let [x, y, z] = ray.origin;
                let is_near = x.abs() <= top.reach && y.abs() <= top.reach && z.abs() <= top.reach;
                let slabs = match prepared.prepared(lane).filter(|_| S::HAS_VECTORS && is_near) {
                    Some(PreparedRay { slabs, .. }) if lists_rays && ray.tmin >= 0.0 => {
                        let last = limit(slabs.scale, ray.tmax);
                        listed[listed_count] = RayToList { index: ray_index, slabs, last };
                        listed_count += 1;
                        continue;
                    }
                    Some(prepared) => prepared.slabs,
                    None => match widened_slabs(ray, top) {
                        Some(slabs) => slabs,
                        None => continue,
                    },
                };
                self.start_ray(ray_index, &slabs, ray.tmax);
                active[kept] = ray_index;
                kept += 1;
            }
            let listed = &listed[..listed_count];
            let mut failed =
                if listed_count > 0 { lists.list(s, top, listed, (first_ray, visits)) } else { 0 };
            while failed != 0 {
                let RayToList { index, slabs, .. } = listed[failed.trailing_zeros() as usize % LANES];
                failed &= failed - 1;
                self.start_ray(index, slabs, rays[index as usize].tmax);
                active[kept] = index;
                kept += 1;
            }
        }
        active.truncate(kept);
    }

    /// Starts a ray at the root.
    #[inline(always)]
    fn start_ray(&mut self, index: u32, slabs: &RaySlabs, tmax: f32) {
        let (limit, top) = (limit(slabs.scale, tmax), self.stacks.start(index as usize, 0));
        self.states[index as usize] = TopLevelRay { slabs: *slabs, tmax, limit, top };
    }

    /// Advances each ray of `active` to the next instance whose box it may intersect, and appends the visit to `visits` in the
    /// order of `active`. Rays that are complete or have no further instance are removed from `active`.
    /// `first_ray` is added to the index of the ray of a visit.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        active: &mut Vec<u32>,
        progress: Progress<'_>,
        (first_ray, visits): (u32, &mut Vec<Visit>),
    ) {
        let mut kept = 0;
        let mut block = RayBlock::new();
        for first in (0..active.len()).step_by(BLOCK) {
            let end = (first + BLOCK).min(active.len());
            block.inner.len = 0;
            for (slot, &ray_index) in active[first..end].iter().enumerate() {
                let ray = ray_index as usize;
                let code = match progress.tmax(ray) {
                    f32::NEG_INFINITY => BOTTOM,
                    tmax => self.resume(s, ray, tmax),
                };
                block.push(slot, code);
            }
            let ray_indices = &active[first..end];
            while block.inner.len > 0 {
                for i in 0..block.inner.take() {
                    let slot = block.inner.get(i);
                    let ray = ray_indices[slot] as usize;
                    let code = self.step(s, top, ray, block.code[slot]);
                    block.push(slot, code);
                }
            }
            // There are no branches, because which rays continue is not predictable.
            let mut count = visits.len();
            visits.resize(count + end - first, Visit { ray: NONE, instance: NONE });
            for slot in 0..end - first {
                let (code, ray_index) = (block.code[slot % BLOCK], active[first + slot]);
                let state = &mut self.states[ray_index as usize];
                state.top = state.top.below();
                visits[count] = Visit { ray: first_ray + ray_index, instance: code & !INSTANCE };
                active[kept] = ray_index;
                count += usize::from(code != BOTTOM);
                kept += usize::from(code != BOTTOM);
            }
            visits.truncate(count);
        }
        active.truncate(kept);
    }

    /// Drops stack entries beyond a ray's new `tmax`; returns the code on top of its stack.
    #[inline(always)]
    fn resume<S: Simd>(&mut self, s: S, ray: usize, tmax: f32) -> u32 {
        let state = &mut self.states[ray];
        if tmax < state.tmax {
            let limit = limit(state.slabs.scale, tmax);
            (state.tmax, state.limit) = (tmax, limit);
            state.top = self.stacks.keep_up_to(s, self.stacks.bottom(ray), state.top, key_limit(limit));
        }
        self.stacks.code(state.top)
    }

    /// Replaces the node on top of a ray's stack by those of its children whose boxes the ray may intersect. Returns the code of
    /// the new top.
    #[inline(always)]
    fn step<S: Simd>(&mut self, s: S, top: &TopLevel, ray: usize, code: u32) -> u32 {
        let state = &mut self.states[ray];
        let node = top.node(code);
        let (bits, enter) = state.slabs.children(s, node, state.limit);
        let child = s.load_u(&node.child);
        // With coordinates near the limit of f32 the test accepts all boxes, also of empty children, so these are excluded here.
        let allowed = s.lt_u(child, s.splat_u(BOTTOM));
        let (codes, keys) = self.stacks.free_entries(state.top);
        let count = s.compress_far_to_near(bits & s.mask_bits(allowed), enter, child, codes, keys);
        state.top = self.stacks.replaced(state.top, count);
        self.stacks.code(state.top)
    }
}

/// The rays of a block, by their slot in it.
struct RayBlock {
    /// Slots of the rays that have an inner node on top of their stack.
    inner: SlotList,
    /// For each slot the code on top of the stack. A ray stops at the code of an instance or at [`BOTTOM`].
    code: [u32; BLOCK],
}

/// A list of slots.
struct SlotList {
    slot: [u8; 2 * BLOCK],
    len: u8,
}

impl SlotList {
    #[inline(always)]
    fn get(&self, i: u8) -> usize {
        usize::from(self.slot[usize::from(i) % (2 * BLOCK)]) % BLOCK
    }
    /// Empties the list. Its entries remain readable as long as not more entries are added than have been read.
    #[inline(always)]
    fn take(&mut self) -> u8 {
        std::mem::replace(&mut self.len, 0)
    }
}

impl RayBlock {
    fn new() -> Self {
        let inner = SlotList { slot: [0; 2 * BLOCK], len: 0 };
        RayBlock { inner, code: [BOTTOM; BLOCK] }
    }

    /// Stores the code on top of a ray's stack, and adds the slot to `inner` if it is the code of a node, without a branch.
    #[inline(always)]
    fn push(&mut self, slot: usize, code: u32) {
        self.code[slot] = code;
        self.inner.slot[usize::from(self.inner.len) % (2 * BLOCK)] = slot as u8;
        self.inner.len += u8::from(code & INSTANCE == 0);
    }
}
