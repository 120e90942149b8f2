//! Traversal of the top level by single rays, from one instance to the next, nearest boxes first.
//!
//! The rays of a block advance alternately, one step each, so that their memory latencies overlap. A ray stops at each instance
//! until it has been traced in it.

use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use crate::bvh::ray_state::KEY_SLACK;
use crate::bvh::stack::{BOTTOM, StackPosition, Stacks};
use crate::intersect::boxes::RaySlabs;
use crate::intersect::prepare::Prepared;
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
    /// Code of an instance that the ray does not enter, or `NONE`.
    skip: u32,
    /// The top of the ray's stack.
    top: StackPosition,
}

/// The constants of a ray for box tests, computed in f64. For rays from beyond [`TopLevel::reach`] they widen the boxes. `None`
/// for rays that cannot hit anything.
pub(super) fn widened_slabs(ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    RaySlabs::widened(ray, top.greatest_coordinate(), |start| {
        if start > f64::from(top.reach) { f64::from(top.origin_slack) * start } else { 0.0 }
    })
}

/// Upper bound of the depths of hits whose t, rounded to f32, is at most `tmax`; `scale` is the depth of t = 1.
#[inline(always)]
pub(super) fn limit(scale: f32, tmax: f32) -> f32 {
    const SLACK: f64 = 1.0 / (1 << 22) as f64;
    let tmax = f64::from(tmax);
    let limit = ((tmax + tmax.abs() * SLACK + f64::from(f32::from_bits(1))) * f64::from(scale)) as f32;
    // This adds at least one unit in the last place. There is no branch, because a batch may mix finite and infinite values.
    limit + (limit.abs() * f32::EPSILON + f32::MIN_POSITIVE)
}

impl RayTraversals {
    /// Starts the rays whose indices are in `active`, and removes those that cannot hit anything. `skip` returns for the index of
    /// a ray an instance that it is not to enter, or `NONE`.
    #[inline(always)]
    pub(super) fn start<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        rays: &[Ray],
        active: &mut Vec<u32>,
        skip: impl Fn(usize) -> u32,
    ) {
        if top.is_empty() || active.is_empty() {
            return active.clear();
        }
        self.stacks.reserve_for(top.depth as usize, rays.len());
        let vacant = TopLevelRay {
            slabs: RaySlabs::NONE,
            tmax: 0.0,
            limit: 0.0,
            skip: NONE,
            top: StackPosition::FIRST,
        };
        if self.states.len() < rays.len() {
            self.states.resize(rays.len(), vacant);
        }
        let mut prepared = Prepared::new();
        let mut index = [0; LANES];
        let mut kept = 0;
        for first in (0..active.len()).step_by(LANES) {
            let count = LANES.min(active.len() - first);
            index[..count].copy_from_slice(&active[first..first + count]);
            // Without vectors, preparation in lanes takes as long as one ray after the other, and much code.
            if S::HAS_VECTORS {
                prepared.fill(s, &top.cube, rays, &index, count);
            }
            for (lane, &ray_index) in index[..count].iter().enumerate() {
                let ray_index = ray_index as usize;
                let ray = &rays[ray_index];
                let [x, y, z] = ray.origin;
                let is_near = x.abs() <= top.reach && y.abs() <= top.reach && z.abs() <= top.reach;
                let state = &mut self.states[ray_index];
                match prepared.prepared(lane).filter(|_| S::HAS_VECTORS && is_near) {
                    Some(prepared) => state.slabs = prepared.slabs,
                    None => match widened_slabs(ray, top) {
                        Some(slabs) => state.slabs = slabs,
                        None => continue,
                    },
                }
                (state.tmax, state.limit) = (ray.tmax, limit(state.slabs.scale, ray.tmax));
                state.skip = INSTANCE | skip(ray_index);
                state.top = self.stacks.start(ray_index, 0);
                active[kept] = index[lane];
                kept += 1;
            }
        }
        active.truncate(kept);
    }

    /// Advances each ray of `active` to the next instance whose box it may intersect, and appends the visit to `visits` in the
    /// order of `active`. `tmax` returns for the index of a ray the greatest t, rounded to f32, of hits that can change its
    /// result, or None if its query is complete. Rays that are complete or have no further instance are removed from `active`.
    /// `first_ray` is added to the index of the ray of a visit.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        active: &mut Vec<u32>,
        tmax: impl Fn(usize) -> Option<f32>,
        (first_ray, visits): (u32, &mut Vec<Visit>),
    ) {
        let mut kept = 0;
        let mut block = RayBlock::new();
        for first in (0..active.len()).step_by(BLOCK) {
            let end = (first + BLOCK).min(active.len());
            block.inner.len = 0;
            for (slot, &ray_index) in active[first..end].iter().enumerate() {
                let ray = ray_index as usize;
                let code = match tmax(ray) {
                    Some(tmax) => self.resume(s, ray, tmax),
                    None => BOTTOM,
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
            let keys = limit + (limit.abs() * KEY_SLACK + f32::MIN_POSITIVE);
            state.top = self.stacks.keep_up_to(s, self.stacks.bottom(ray), state.top, keys);
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
        let allowed = s.and_not(s.lt_u(child, s.splat_u(BOTTOM)), s.eq_u(child, s.splat_u(state.skip)));
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
