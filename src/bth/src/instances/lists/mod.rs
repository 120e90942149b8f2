//! Lists of the instances whose boxes rays may enter, sorted by depth.
//!
//! Sixteen rays are tested together: all against one box at a time if there are few boxes
//! ([`by_boxes`]), else each against the nodes that it reaches ([`by_nodes`]). A ray visits its
//! nearest instance at once, and the next ones in later rounds unless it has ended. With a list, a
//! ray needs neither its constants nor a stack any more. A list holds the nearest instances. A ray
//! that goes on behind all of them is traced alone.

mod by_boxes;
mod by_nodes;

use self::by_boxes::BoxTests;
use self::by_nodes::{NodeTests, RayToList};
use super::box_tests::limit;
use super::scene_batch::{BatchProgress, Chunk};
use super::top_nodes::INSTANCE;
use crate::bvh::packet::backoff::PacketBackoff;
use crate::bvh::ray_state::key_limit;
use crate::bvh::stack::BOTTOM;
use crate::intersect::prepare::{Prepared, PreparedRay};
use crate::query::sink::Visit;
use crate::simd::{LANES, Part, Simd};

/// Max number of instances in a list.
const MAX_LISTED: usize = LANES;
/// Tests of sixteen rays together pay unless more than this number of them reach too many nodes.
const MAX_FAILED: usize = 4;
/// The min key of an instance. Rounding may turn a depth of zero into a negative number, which
/// would not be sorted. Keys near zero would be denormal, since their lowest bits are overwritten.
/// The key is still a lower bound when compared with a limit, to which [`key_limit`] adds as much.
const MIN_KEY: f32 = f32::MIN_POSITIVE;

/// The lists of the rays of a chunk.
#[derive(Debug, Default)]
pub(super) struct InstanceLists {
    /// The lists, one after the other: [`BOTTOM`], then the codes of a ray's instances, the nearest
    /// last.
    codes: Vec<u32>,
    /// For each code a lower bound of the depth at which the ray enters the box. The first of each
    /// list is the key from which on instances are missing. If none is, it is NaN, which no limit
    /// exceeds.
    keys: Vec<f32>,
    /// Length of all lists.
    len: usize,
    /// By index of the ray in the chunk.
    rays: Vec<ListedRay>,
    /// The indices within the chunk of the rays that still have instances in their list.
    pub(super) active: Vec<u32>,
    /// The indices of rays that have passed all instances of their list, but not all instances.
    pub(super) unfinished: Vec<u32>,
    tests: NodeTests,
    /// Skips tests of sixteen rays against nodes after rays that reached too many.
    backoff_nodes: PacketBackoff,
    /// Skips tests against single boxes after rays for which they did not pay.
    backoff_boxes: PacketBackoff,
}

/// A ray with a list.
#[derive(Clone, Copy, Debug)]
struct ListedRay {
    /// Depth of t = 1.
    scale: f32,
    /// Index of the next entry of its list.
    next: u32,
}

/// Up to sixteen rays of a chunk that are to be listed.
#[derive(Clone, Copy)]
struct RaysToList<'a> {
    chunk: &'a Chunk<'a>,
    /// The indices of the rays in the chunk, and their number.
    at: &'a [u32; LANES],
    count: usize,
}

/// Up to sixteen instances, one in each lane.
struct InstanceLanes<S: Simd> {
    /// One bit per lane in use.
    bits: u32,
    /// Lower bounds of the depths at which a ray enters them.
    depths: S::F,
    codes: S::U,
}

impl InstanceLists {
    /// Lists rays of a chunk, and appends a visit of the nearest instance of each to `visits`.
    /// `rest` holds the indices of the rays, and keeps those that get no list.
    #[inline(always)]
    pub(super) fn start<S: Simd>(
        &mut self,
        s: S,
        chunk: &Chunk<'_>,
        rest: &mut Vec<u32>,
        visits: &mut Vec<Visit>,
    ) {
        self.active.clear();
        if chunk.top.is_empty() {
            return rest.clear();
        }
        if !S::HAS_VECTORS || rest.is_empty() {
            return;
        }
        self.reserve(chunk.rays.len());
        let mut prepared = Prepared::new();
        let mut at = [0; LANES];
        let mut kept = 0;
        for first in (0..rest.len()).step_by(LANES) {
            let count = LANES.min(rest.len() - first);
            at[..count].copy_from_slice(&rest[first..first + count]);
            let mut done = 0;
            if self.backoff_boxes.may_try() {
                let rays = RaysToList { chunk, at: &at, count };
                done = s.call(ListByBoxes { lists: self, rays, visits });
                if done.count_ones() as usize == count {
                    continue;
                }
            }
            let together = self.backoff_nodes.may_try();
            let lists_nodes = together || S::HAS_FAST_COMPRESS;
            if lists_nodes {
                prepared.fill(s, &chunk.top.cube, chunk.rays, &at, count);
            }
            let mut listed = [RayToList::NONE; LANES];
            let mut listed_count = 0;
            for (lane, &index) in at[..count].iter().enumerate() {
                if done >> lane & 1 != 0 {
                    continue;
                }
                let ray = &chunk.rays[index as usize];
                let [x, y, z] = ray.origin.map(f32::abs);
                let reach = chunk.top.reach;
                let may_list = lists_nodes && x <= reach && y <= reach && z <= reach && ray.tmin >= 0.0;
                match prepared.prepared(lane).filter(|_| may_list) {
                    Some(PreparedRay { slabs, .. }) => {
                        let last = limit(slabs.scale, ray.tmax);
                        listed[listed_count] = RayToList { index, slabs, last };
                        listed_count += 1;
                    }
                    None => {
                        rest[kept] = index;
                        kept += 1;
                    }
                }
            }
            if listed_count == 0 {
                continue;
            }
            let listed = &listed[..listed_count];
            let mut failed = self.list_by_nodes(s, chunk, listed, together, visits);
            while failed != 0 {
                rest[kept] = listed[failed.trailing_zeros() as usize % LANES].index;
                failed &= failed - 1;
                kept += 1;
            }
        }
        rest.truncate(kept);
    }

    /// Removes all lists, and makes room for the lists of `count` rays.
    fn reserve(&mut self, count: usize) {
        self.len = 0;
        let total = count * (1 + MAX_LISTED) + LANES;
        if self.codes.len() < total {
            self.codes.resize(total, BOTTOM);
            self.keys.resize(total, f32::NAN);
            self.rays.resize(count, ListedRay { scale: 0.0, next: 0 });
        }
    }

    /// Lists rays by tests of each against the nodes that it reaches, first of all rays `together`
    /// if that may pay. Returns one bit per ray that reaches too many boxes: where
    /// [`Simd::compress`] is slow, a list of its nearest takes too long.
    #[inline(always)]
    fn list_by_nodes<S: Simd>(
        &mut self,
        s: S,
        chunk: &Chunk<'_>,
        rays: &[RayToList<'_>],
        together: bool,
        visits: &mut Vec<Visit>,
    ) -> u32 {
        let mut failed = ((1u64 << rays.len()) - 1) as u32;
        if together {
            failed = self.tests.run(s, chunk.top, rays);
            self.backoff_nodes.record(failed.count_ones() as usize <= MAX_FAILED);
        }
        for (lane, ray) in rays.iter().enumerate() {
            let mut missing = f32::INFINITY;
            if failed >> lane & 1 != 0 {
                if !S::HAS_FAST_COMPRESS {
                    continue;
                }
                missing = self.tests.run_one(s, chunk.top, ray, lane);
            }
            let found = self.tests.found(s, lane);
            let is_any = found.bits != 0;
            let nearest = self.push(s, ray.index, ray.slabs.scale, found, missing);
            if is_any {
                let instance = self.codes[nearest] & !INSTANCE;
                visits.push(Visit { ray: chunk.first + ray.index, instance });
            }
        }
        if S::HAS_FAST_COMPRESS { 0 } else { failed }
    }

    /// Stores the lists of rays that were tested against all boxes.
    #[inline(always)]
    fn store_by_boxes<S: Simd>(
        &mut self,
        s: S,
        rays: &RaysToList<'_>,
        tests: &BoxTests<S>,
        visits: &mut Vec<Visit>,
    ) {
        let mut code = [0; LANES];
        s.store_u(tests.code, &mut code);
        if tests.several != 0 {
            let codes = s.load_u(&tests.codes);
            let (mut of_ray, mut scale) = ([[0.0; LANES]; LANES], [0.0; LANES]);
            for (to, depths) in of_ray.iter_mut().zip(s.transpose(tests.depths)) {
                s.store(depths, to);
            }
            s.store(tests.scale, &mut scale);
            let mut several = tests.several;
            while several != 0 {
                let lane = several.trailing_zeros() as usize % LANES;
                several &= several - 1;
                let depths = s.load(&of_ray[lane]);
                let bits = s.mask_bits(s.lt(depths, s.splat(f32::INFINITY)));
                // Unused lanes are not stored, but may be sorted.
                let depths = s.min(s.max(depths, s.splat(MIN_KEY)), s.splat(f32::MAX));
                let found = InstanceLanes { bits, depths, codes };
                let nearest = self.push(s, rays.at[lane], scale[lane], found, f32::INFINITY);
                code[lane] = self.codes[nearest];
            }
        }
        let mut count = visits.len();
        visits.resize(count + LANES, Visit { ray: 0, instance: 0 });
        let (mut indices, mut instances) = ([0; LANES], [0; LANES]);
        s.compress(tests.any, s.add_u(s.load_u(rays.at), s.splat_u(rays.chunk.first)), &mut indices);
        s.compress(tests.any, s.load_u(&code), &mut instances);
        for (to, (ray, code)) in visits[count..].iter_mut().zip(indices.iter().zip(instances)) {
            *to = Visit { ray: *ray, instance: code & !INSTANCE };
        }
        count += tests.any.count_ones() as usize;
        visits.truncate(count);
    }

    /// Stores the list of a ray. `ray` is its index in the chunk, `scale` the depth of t = 1. From
    /// the key `missing` on instances are missing. Returns the index of the nearest entry. The ray
    /// visits that instance at once; the list holds the others.
    #[inline(always)]
    fn push<S: Simd>(&mut self, s: S, ray: u32, scale: f32, found: InstanceLanes<S>, missing: f32) -> usize {
        self.keys[self.len] = if missing < f32::INFINITY { missing } else { f32::NAN };
        self.codes[self.len] = BOTTOM;
        let first = self.len + 1;
        let codes = self.codes[first..].first_chunk_mut().expect("there is room for all lists");
        let keys = self.keys[first..].first_chunk_mut().expect("there is room for all lists");
        let count = s.compress_far_to_near(found.bits, found.depths, found.codes, codes, keys);
        let nearest = self.len + count;
        self.len = nearest + 1;
        if count > 1 {
            self.rays[ray as usize] = ListedRay { scale, next: (nearest - 1) as u32 };
            self.active.push(ray);
        }
        nearest
    }

    /// Advances each active ray to the next instance whose box it may enter, and appends the visits
    /// to `visits`, in the order of the rays. Removes rays without a further instance from the
    /// active ones, and fills `unfinished`. `first_ray` is added to the index of the ray of a
    /// visit.
    #[inline(always)]
    pub(super) fn advance(&mut self, progress: BatchProgress<'_>, first_ray: u32, visits: &mut Vec<Visit>) {
        let InstanceLists { codes, keys, rays, active, unfinished, .. } = self;
        unfinished.clear();
        let (mut count, mut kept) = (visits.len(), 0);
        visits.resize(count + active.len(), Visit { ray: 0, instance: 0 });
        for i in 0..active.len() {
            let index = active[i];
            let ray = &mut rays[index as usize];
            let next = ray.next as usize;
            // The list holds nothing beyond the ray's own range.
            let farthest = key_limit(limit(ray.scale, progress.tmax(index as usize)));
            // Which rays continue is not predictable, so no branch depends on it; few pass all
            // instances of their list.
            let mut goes_on = usize::from(keys[next] <= farthest);
            if goes_on != 0 && codes[next] == BOTTOM {
                unfinished.push(index);
                goes_on = 0;
            }
            visits[count] = Visit { ray: first_ray + index, instance: codes[next] & !INSTANCE };
            active[kept] = index;
            ray.next = (next - goes_on) as u32;
            count += goes_on;
            kept += goes_on;
        }
        visits.truncate(count);
        active.truncate(kept);
    }
}

/// Makes lists for the rays, out of up to sixteen, that f32 prepares. Tests all rays against one
/// box at a time. Returns one bit per listed ray, or 0 if there are too many boxes. A separate
/// function, which leaves the kernel's registers to tests against nodes.
struct ListByBoxes<'a> {
    lists: &'a mut InstanceLists,
    rays: RaysToList<'a>,
    visits: &'a mut Vec<Visit>,
}

impl<S: Simd> Part<S> for ListByBoxes<'_> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let ListByBoxes { lists, rays, visits } = self;
        let tests = BoxTests::of(s, &rays);
        lists.backoff_boxes.record(tests.as_ref().is_some_and(|tests| tests.is_worthwhile));
        tests.map_or(0, |tests| {
            lists.store_by_boxes(s, &rays, &tests, visits);
            tests.tested
        })
    }
}

#[cfg(test)]
mod tests;
