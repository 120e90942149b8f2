//! Single rays through the top level by lists of the instances whose boxes they may intersect.
//!
//! A ray is tested against all nodes that it reaches at once, and the instances that it meets are sorted by depth. That takes a part of the
//! time of a traversal that stops at each instance and goes on when that has been traced ([`super::traverse`]), because a ray needs
//! neither its constants nor a stack any more. In exchange rays are also tested against boxes behind their hit, so where rays meet
//! many boxes they are traversed.

use super::box_tests::limit;
use super::instance_list::LEAST_KEY;
use super::met_by_lanes::{MetByLanes, RaysTogether};
use super::progress::Progress;
use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use crate::bvh::packet::backoff::PacketBackoff;
use crate::bvh::ray_state::key_limit;
use crate::bvh::stack::BOTTOM;
use crate::intersect::boxes::RaySlabs;
use crate::query::sink::Visit;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::NONE;

/// Greatest number of instances in a list.
const MAX_LISTED: usize = LANES;
/// Greatest number of tests of sixteen rays against nodes.
const MAX_TESTS: usize = 16 * LANES;
/// Of sixteen rays at most so many may meet too many boxes for lists to pay.
const MAX_FAILED: usize = 4;

/// The lists of the rays of a chunk.
#[derive(Debug, Default)]
pub(super) struct ListedRays {
    /// The lists, one after the other: a code that is not read, then the codes of a ray's instances, the nearest last.
    codes: Vec<u32>,
    /// For each code a lower bound of the depth at which the ray enters the box. The first of each list is NaN, which no limit exceeds.
    keys: Vec<f32>,
    /// Length of all lists.
    len: usize,
    /// By index of the ray in the chunk.
    rays: Vec<ListedRay>,
    /// The indices within the chunk of the rays that have a list with instances in front of them.
    pub(super) active: Vec<u32>,
    tests: Tests,
    /// Decides after rays that met too many boxes that the next ones are not listed.
    backoff: PacketBackoff,
    /// Decides after rays that were tested together against many boxes that the next ones are not.
    backoff_together: PacketBackoff,
}

/// A ray that is to be listed. Its tmin is not negative.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayToList<'a> {
    /// Its index in the chunk.
    pub(super) index: u32,
    /// Its constants for box tests.
    pub(super) slabs: &'a RaySlabs,
    /// Greatest depth of hits.
    pub(super) last: f32,
}

impl RayToList<'_> {
    pub(super) const NONE: Self = RayToList { index: NONE, slabs: &RaySlabs::NONE, last: 0.0 };
}

/// A ray with a list.
#[derive(Clone, Copy, Debug)]
struct ListedRay {
    /// Depth of t = 1.
    scale: f32,
    /// Index of the next entry of its list.
    next: u32,
}

/// The unsorted entries of a list, with room for those of a node more.
#[derive(Clone, Copy, Debug)]
struct Unsorted {
    codes: [u32; 2 * LANES],
    keys: [f32; 2 * LANES],
}

/// What sixteen rays are still to be tested against, and what they have met.
#[derive(Debug)]
struct Tests {
    /// The nodes, and for each the lane of the ray, with room for the children of a node more.
    nodes: [u32; MAX_TESTS + LANES],
    lanes: [u8; MAX_TESTS + LANES],
    /// By lane.
    lists: [Unsorted; LANES],
    counts: [u8; LANES],
}

impl ListedRays {
    /// Removes the rays of the chunk before, for one with `count` rays.
    pub(super) fn clear(&mut self, count: usize) {
        self.active.clear();
        self.len = 0;
        let total = count * (1 + MAX_LISTED) + LANES;
        if self.codes.len() < total {
            self.codes.resize(total, BOTTOM);
            self.keys.resize(total, f32::NAN);
            self.rays.resize(count, ListedRay { scale: 0.0, next: 0 });
        }
    }

    /// Whether the next sixteen rays are to be listed.
    pub(super) fn may_list(&mut self) -> bool {
        self.backoff.may_try()
    }

    /// Whether the next sixteen rays are to be tested together.
    pub(super) fn may_list_together(&mut self) -> bool {
        self.backoff_together.may_try()
    }

    /// Lists up to sixteen rays, and appends the visits of the nearest instances to `visits`. Returns those that meet too many boxes, a bit
    /// each. `first_ray` is added to the index of the ray of a visit.
    #[inline(always)]
    pub(super) fn list<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        rays: &[RayToList<'_>],
        (first_ray, visits): (u32, &mut Vec<Visit>),
    ) -> u32 {
        let failed = self.tests.run(s, top, rays);
        for (lane, ray) in rays.iter().enumerate() {
            if failed >> lane & 1 != 0 {
                continue;
            }
            let list = &self.tests.lists[lane];
            let bits = ((1u64 << self.tests.counts[lane]) - 1) as u32;
            let depths = s.load(list.keys.first_chunk().expect("of this length"));
            let codes = s.load_u(list.codes.first_chunk().expect("of this length"));
            let nearest = self.push(s, (ray.index, ray.slabs.scale), (bits, depths, codes));
            if bits != 0 {
                let instance = self.codes[nearest] & !INSTANCE;
                visits.push(Visit { ray: first_ray + ray.index, instance });
            }
        }
        self.backoff.record(failed.count_ones() as usize <= MAX_FAILED);
        failed
    }

    /// Lists those of up to sixteen rays that f32 prepares, as [`Self::list`]. Returns them, a bit each: none if they reach too many boxes to be
    /// tested together.
    #[inline(always)]
    pub(super) fn list_together<S: Simd>(
        &mut self,
        s: S,
        rays: &RaysTogether<'_>,
        (first_ray, visits): (u32, &mut Vec<Visit>),
    ) -> u32 {
        s.call(ListTogether { lists: self, rays, first_ray, visits })
    }

    /// Stores the lists of rays that were tested together; `at` holds their indices.
    #[inline(always)]
    fn store_together<S: Simd>(
        &mut self,
        s: S,
        met: &MetByLanes<S>,
        at: &[u32; LANES],
        (first_ray, visits): (u32, &mut Vec<Visit>),
    ) {
        let mut code = [0; LANES];
        s.store_u(met.code, &mut code);
        if met.several != 0 {
            let codes = s.load_u(&met.codes);
            let (mut of_ray, mut scale) = ([[0.0; LANES]; LANES], [0.0; LANES]);
            for (to, depths) in of_ray.iter_mut().zip(s.transpose(met.depths)) {
                s.store(depths, to);
            }
            s.store(met.scale, &mut scale);
            let mut rays = met.several;
            while rays != 0 {
                let lane = rays.trailing_zeros() as usize % LANES;
                rays &= rays - 1;
                let depths = s.load(&of_ray[lane]);
                let bits = s.mask_bits(s.lt(depths, s.splat(f32::INFINITY)));
                // What is not met is not stored, but may be sorted.
                let depths = s.min(s.max(depths, s.splat(LEAST_KEY)), s.splat(f32::MAX));
                let nearest = self.push(s, (at[lane], scale[lane]), (bits, depths, codes));
                code[lane] = self.codes[nearest];
            }
        }
        let mut count = visits.len();
        visits.resize(count + LANES, Visit { ray: 0, instance: 0 });
        let (mut rays, mut instances) = ([0; LANES], [0; LANES]);
        s.compress(met.any, s.add_u(s.load_u(at), s.splat_u(first_ray)), &mut rays);
        s.compress(met.any, s.load_u(&code), &mut instances);
        for (to, (ray, code)) in visits[count..].iter_mut().zip(rays.iter().zip(instances)) {
            *to = Visit { ray: *ray, instance: code & !INSTANCE };
        }
        count += met.any.count_ones() as usize;
        visits.truncate(count);
    }

    /// Stores the list of a ray, given its index in the chunk and the depth of t = 1, and the instances that it meets: their bits, and depths
    /// and codes in the lanes. Returns the index of the nearest, to be visited at once; the list has no others.
    #[inline(always)]
    fn push<S: Simd>(
        &mut self,
        s: S,
        (ray, scale): (u32, f32),
        (bits, depths, instances): (u32, S::F, S::U),
    ) -> usize {
        self.keys[self.len] = f32::NAN;
        let first = self.len + 1;
        let codes = self.codes[first..].first_chunk_mut().expect("there is room for all lists");
        let keys = self.keys[first..].first_chunk_mut().expect("there is room for all lists");
        let count = s.compress_far_to_near(bits, depths, instances, codes, keys);
        let nearest = self.len + count;
        self.len = nearest + 1;
        if count > 1 {
            self.rays[ray as usize] = ListedRay { scale, next: (nearest - 1) as u32 };
            self.active.push(ray);
        }
        nearest
    }

    /// Advances each active ray to the next instance whose box it may intersect, as
    /// [`RayTraversals::advance`](super::traverse::RayTraversals::advance).
    #[inline(always)]
    pub(super) fn advance(&mut self, progress: Progress<'_>, (first_ray, visits): (u32, &mut Vec<Visit>)) {
        let ListedRays { codes, keys, rays, active, .. } = self;
        let (mut count, mut kept) = (visits.len(), 0);
        visits.resize(count + active.len(), Visit { ray: 0, instance: 0 });
        for i in 0..active.len() {
            let index = active[i];
            let ray = &mut rays[index as usize];
            let next = ray.next as usize;
            // The list holds nothing beyond the ray's own range.
            let farthest = key_limit(limit(ray.scale, progress.tmax(index as usize)));
            // There are no branches, because which rays continue is not predictable.
            let goes_on = usize::from(keys[next] <= farthest);
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

/// [`ListedRays::list_together`] with its arguments. A function of its own, so that the kernel has room for rays that are listed one by one.
struct ListTogether<'a> {
    lists: &'a mut ListedRays,
    rays: &'a RaysTogether<'a>,
    first_ray: u32,
    visits: &'a mut Vec<Visit>,
}

impl<S: Simd> Part<S> for ListTogether<'_> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let ListTogether { lists, rays, first_ray, visits } = self;
        let met = MetByLanes::of(s, rays);
        lists.backoff_together.record(met.as_ref().is_some_and(|met| met.is_worthwhile));
        met.map_or(0, |met| {
            lists.store_together(s, &met, rays.at, (first_ray, visits));
            met.tested
        })
    }
}

impl Default for Tests {
    fn default() -> Tests {
        Tests {
            nodes: [0; MAX_TESTS + LANES],
            lanes: [0; MAX_TESTS + LANES],
            lists: [Unsorted { codes: [0; 2 * LANES], keys: [0.0; 2 * LANES] }; LANES],
            counts: [0; LANES],
        }
    }
}

impl Tests {
    /// Stores the instances whose boxes up to sixteen rays may intersect. Returns the rays that meet too many boxes, a bit each.
    ///
    /// The tests of all rays are one list, to which each adds those of the children that are nodes, so that they follow each other
    /// without waiting for what is not predictable: how many nodes a ray reaches.
    #[inline(always)]
    fn run<S: Simd>(&mut self, s: S, top: &TopLevel, rays: &[RayToList<'_>]) -> u32 {
        let Tests { nodes, lanes, lists, counts } = self;
        *counts = [0; LANES];
        let (mut next, mut end) = (0, rays.len());
        for (lane, to) in lanes[..end].iter_mut().enumerate() {
            (*to, nodes[lane]) = (lane as u8, 0);
        }
        let mut failed = 0;
        while next < end {
            let lane = usize::from(lanes[next]) % LANES;
            let node = top.node(nodes[next]);
            next += 1;
            let ray = &rays[lane];
            let (bits, depth) = ray.slabs.children(s, node, ray.last);
            let child = s.load_u(&node.child);
            // With coordinates near the limit of f32 the test accepts all boxes, also of empty children, so these are excluded here.
            let allowed = s.lt_u(child, s.splat_u(BOTTOM));
            let met = bits & s.mask_bits(allowed);
            let inner = met & s.mask_bits(s.lt_u(child, s.splat_u(INSTANCE)));
            let to: &mut [u32; LANES] = nodes[end..].first_chunk_mut().expect("there is room for a node");
            let added = s.compress(inner, child, to);
            let to: &mut [u8; LANES] = lanes[end..].first_chunk_mut().expect("there is room for a node");
            *to = [lane as u8; LANES];
            end += added;
            let instances = met & !inner;
            let (list, count) = (&mut lists[lane], usize::from(counts[lane]));
            let to = list.codes[count..].first_chunk_mut().expect("there is room for a node");
            s.compress(instances, child, to);
            let to = list.keys[count..].first_chunk_mut().expect("there is room for a node");
            let count = count + s.compress_f(instances, s.max(depth, s.splat(LEAST_KEY)), to);
            failed |= u32::from(count > MAX_LISTED) << lane;
            counts[lane] = count.min(MAX_LISTED) as u8;
            if end > MAX_TESTS {
                failed |= 1 << lane;
                end -= added;
            }
        }
        failed
    }
}

#[cfg(test)]
#[path = "listed_rays_tests.rs"]
mod tests;
