//! The ways of many rays through the top level: instance by instance, nearest boxes first.
//!
//! All rays take a step each in turn, so that none waits for another's, and rest where they come to an instance.

use super::top_level::{INSTANCE, TopLevel};
use crate::bvh::ray_state::KEY_SLACK;
use crate::bvh::stack::{BOTTOM, StackPosition, Stacks};
use crate::intersect::boxes::RaySlabs;
use crate::intersect::prepare::Prepared;
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectBounds;

/// Rays that take turns: few enough that what they need stays in the innermost cache.
const BLOCK: usize = 64;

/// Rays on their way, by number.
#[derive(Debug, Default)]
pub(super) struct RayTraversals {
    active_rays: Vec<TopLevelRay>,
    /// A stack each.
    stacks: Stacks,
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
struct TopLevelRay {
    /// Its slopes. Depths are t in units of the greatest component of the direction.
    slabs: RaySlabs,
    /// Nothing beyond this t matters,
    tmax: f32,
    /// and so nothing beyond this depth.
    limit: f32,
    /// Code of the instance that it passes by, or `NONE`.
    skip: u32,
    /// The top of its stack.
    top: StackPosition,
}

/// The slopes of a ray, prepared in f64; for rays from so far away that boxes must be widened for them.
fn slabs_from_afar(ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    RaySlabs::widened(ray, top.farthest(), |start| {
        if start > f64::from(top.reach) { f64::from(top.looseness) * start } else { 0.0 }
    })
}

/// The depth beyond which nothing matters where no t matters that, rounded to f32, exceeds `tmax`; `scale` is the depth
/// of t = 1.
#[inline(always)]
pub(super) fn limit(scale: f32, tmax: f32) -> f32 {
    const SLACK: f64 = 1.0 / (1 << 22) as f64;
    let tmax = f64::from(tmax);
    let limit = ((tmax + tmax.abs() * SLACK + f64::from(f32::from_bits(1))) * f64::from(scale)) as f32;
    // At least the next number, without a branch: rays with and without an end are mixed.
    limit + (limit.abs() * f32::EPSILON + f32::MIN_POSITIVE)
}

impl RayTraversals {
    /// Starts the rays of these numbers; those remain that may hit something. A ray will pass by the instance that `skip` gives
    /// for its number.
    #[inline(always)]
    pub(super) fn start<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        rays: &[Ray],
        active: &mut Vec<u32>,
        skip: impl Fn(usize) -> Option<u32>,
    ) {
        if top.is_empty() || active.is_empty() {
            return active.clear();
        }
        self.stacks.reserve_for(top.depth as usize, rays.len());
        let nowhere = TopLevelRay {
            slabs: RaySlabs::NONE,
            tmax: 0.0,
            limit: 0.0,
            skip: NONE,
            top: StackPosition::FIRST,
        };
        if self.active_rays.len() < rays.len() {
            self.active_rays.resize(rays.len(), nowhere);
        }
        let bounds = ObjectBounds::around(top.farthest());
        let mut prepared = Prepared::new();
        let mut at = [0; LANES];
        let mut kept = 0;
        for first in (0..active.len()).step_by(LANES) {
            let count = LANES.min(active.len() - first);
            at[..count].copy_from_slice(&active[first..first + count]);
            prepared.fill(s, &bounds, rays, &at, count);
            for (lane, &number) in at[..count].iter().enumerate() {
                let number = number as usize;
                let ray = &rays[number];
                let [x, y, z] = ray.origin;
                let is_near = x.abs() <= top.reach && y.abs() <= top.reach && z.abs() <= top.reach;
                let state = &mut self.active_rays[number];
                match prepared.prepared(lane).filter(|_| is_near) {
                    Some(prepared) => state.slabs = prepared.slabs,
                    None => match slabs_from_afar(ray, top) {
                        Some(slabs) => state.slabs = slabs,
                        None => continue,
                    },
                }
                (state.tmax, state.limit) = (ray.tmax, limit(state.slabs.scale, ray.tmax));
                state.skip = skip(number).map_or(NONE, |instance| INSTANCE | instance);
                state.top = self.stacks.start(number, 0);
                active[kept] = at[lane];
                kept += 1;
            }
        }
        active.truncate(kept);
    }

    /// Takes rays on to the next instance whose box they may meet at a t that, rounded to f32, is at most that which
    /// `tmax` gives for their number; those for which it gives none, and those at the end of their way, leave `active`. The
    /// visits are added to these, in the order of `active`; rays are numbered from the first.
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
            for (place, &number) in active[first..end].iter().enumerate() {
                let ray = number as usize;
                let code = match tmax(ray) {
                    Some(tmax) => self.resume(s, ray, tmax),
                    None => BOTTOM,
                };
                block.sort(place, code);
            }
            let numbers = &active[first..end];
            while block.inner.len > 0 {
                for i in 0..block.inner.take() {
                    let place = block.inner.get(i);
                    let ray = numbers[place] as usize;
                    let code = self.step(s, top, ray, block.code[place]);
                    block.sort(place, code);
                }
            }
            // Without branches: which rays go on can't be foretold.
            let mut count = visits.len();
            visits.resize(count + end - first, Visit { ray: NONE, instance: NONE });
            for place in 0..end - first {
                let (code, number) = (block.code[place % BLOCK], active[first + place]);
                let state = &mut self.active_rays[number as usize];
                state.top = state.top.below();
                visits[count] = Visit { ray: first_ray + number, instance: code & !INSTANCE };
                active[kept] = number;
                count += usize::from(code != BOTTOM);
                kept += usize::from(code != BOTTOM);
            }
            visits.truncate(count);
        }
        active.truncate(kept);
    }

    /// Drops what a ray need not visit any more; returns the code on top of its stack.
    #[inline(always)]
    fn resume<S: Simd>(&mut self, s: S, ray: usize, tmax: f32) -> u32 {
        let state = &mut self.active_rays[ray];
        if tmax < state.tmax {
            let limit = limit(state.slabs.scale, tmax);
            (state.tmax, state.limit) = (tmax, limit);
            let keys = limit + (limit.abs() * KEY_SLACK + f32::MIN_POSITIVE);
            state.top = self.stacks.keep_up_to(s, self.stacks.bottom(ray), state.top, keys);
        }
        self.stacks.code(state.top)
    }

    /// Takes the node on top of a ray's stack off it, and puts its children on it; returns the code on top then.
    #[inline(always)]
    fn step<S: Simd>(&mut self, s: S, top: &TopLevel, ray: usize, code: u32) -> u32 {
        let state = &mut self.active_rays[ray];
        let node = top.node(code);
        let (bits, enter) = state.slabs.children(s, node, state.limit);
        let child = s.load_u(&node.child);
        // Where coordinates are too great for f32 all boxes are met, those of no child too. What it passes by it need not meet.
        let wanted = s.and_not(s.lt_u(child, s.splat_u(BOTTOM)), s.eq_u(child, s.splat_u(state.skip)));
        let (codes, keys) = self.stacks.free_entries(state.top);
        let count = s.compress_far_to_near(bits & s.mask_bits(wanted), enter, child, codes, keys);
        state.top = self.stacks.replaced(state.top, count);
        self.stacks.code(state.top)
    }
}

/// Rays of a block, by place within.
struct RayBlock {
    /// Those that are not yet where they rest.
    inner: List,
    /// Code on top of a ray's stack; where it rests, of an instance, or [`BOTTOM`].
    code: [u32; BLOCK],
}

/// Places within a block.
struct List {
    place: [u8; 2 * BLOCK],
    len: u8,
}

impl List {
    #[inline(always)]
    fn get(&self, i: u8) -> usize {
        usize::from(self.place[usize::from(i) % (2 * BLOCK)]) % BLOCK
    }
    /// Empties the list, whose entries can still be read if at most as many are added as were read.
    #[inline(always)]
    fn take(&mut self) -> u8 {
        std::mem::replace(&mut self.len, 0)
    }
}

impl RayBlock {
    fn new() -> Self {
        let inner = List { place: [0; 2 * BLOCK], len: 0 };
        RayBlock { inner, code: [BOTTOM; BLOCK] }
    }

    /// Notes the code on top of the stack of a ray. Without a branch.
    #[inline(always)]
    fn sort(&mut self, place: usize, code: u32) {
        self.code[place] = code;
        self.inner.place[usize::from(self.inner.len) % (2 * BLOCK)] = place as u8;
        self.inner.len += u8::from(code & INSTANCE == 0);
    }
}
