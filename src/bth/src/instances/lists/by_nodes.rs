//! The instances whose boxes rays may enter, by tests of each ray against the nodes that it
//! reaches.

use super::{InstanceLanes, MAX_LISTED, MIN_KEY};
use crate::bvh::ray_state::key_limit;
use crate::bvh::single_stack::SingleStack;
use crate::bvh::stack::BOTTOM;
use crate::instances::box_tests::entered;
use crate::instances::top_level::TopLevel;
use crate::instances::top_nodes::INSTANCE;
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::query::NearestHit;
use crate::simd::{LANES, Simd};
use bth_format::layout::{NONE, WIDTH};

/// Max number of tests of sixteen rays against nodes.
const MAX_TESTS: usize = 16 * LANES;

/// A ray that is to be listed. Its tmin is not negative.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayToList<'a> {
    /// Its index in the chunk.
    pub(super) index: u32,
    /// Its constants for box tests.
    pub(super) slabs: &'a RaySlabs,
    /// Max depth of hits.
    pub(super) last: f32,
}

impl RayToList<'_> {
    pub(super) const NONE: Self = RayToList { index: NONE, slabs: &RaySlabs::NONE, last: 0.0 };
}

/// The instances that a ray may enter, unsorted, with room for the children of one more node.
#[derive(Clone, Copy, Debug)]
struct UnsortedList {
    codes: [u32; 2 * LANES],
    keys: [f32; 2 * LANES],
}

impl UnsortedList {
    /// Adds instances of a node behind the first `count`. Returns the number of all.
    #[inline(always)]
    fn add<S: Simd>(&mut self, s: S, count: usize, instances: u32, depth: S::F, child: S::U) -> usize {
        let to = self.codes[count..].first_chunk_mut().expect("there is room for a node");
        s.compress(instances, child, to);
        let to = self.keys[count..].first_chunk_mut().expect("there is room for a node");
        count + s.compress_f(instances, s.max(depth, s.splat(MIN_KEY)), to)
    }

    /// Keeps the nearest [`MAX_LISTED`] of `count` instances. Returns the largest key that is kept.
    ///
    /// Of two halves, one sorted from far to near and the other from near to far, the nearer of
    /// each pair are the nearest of all (Batcher, "Sorting Networks and their Applications", 1968).
    #[inline(always)]
    fn keep_nearest<S: Simd>(&mut self, s: S, count: usize) -> f32 {
        let mut halves = [([0; LANES], [0.0; LANES]); 2];
        for (half, (codes, keys)) in halves.iter_mut().enumerate() {
            let used = (count - half * LANES).min(LANES);
            let key = self.keys[half * LANES..].first_chunk().expect("of this length");
            let code = self.codes[half * LANES..].first_chunk().expect("of this length");
            s.compress_far_to_near(((1u64 << used) - 1) as u32, s.load(key), s.load_u(code), codes, keys);
        }
        let [(codes, keys), (more_codes, more_keys)] = &mut halves;
        let more = count - LANES;
        for i in 0..more {
            let from = (more - 1 - i) % LANES;
            if more_keys[from] < keys[i % LANES] {
                (codes[i % LANES], keys[i % LANES]) = (more_codes[from], more_keys[from]);
            }
        }
        self.codes[..LANES].copy_from_slice(codes);
        self.keys[..LANES].copy_from_slice(keys);
        keys.iter().fold(0.0, |most: f32, key| if *key > most { *key } else { most })
    }
}

/// The tests of sixteen rays against nodes, and the instances found.
#[derive(Debug)]
pub(super) struct NodeTests {
    /// The nodes to be tested, and for each the lane of the ray, with room for the children of one
    /// more node.
    nodes: [u32; MAX_TESTS + LANES],
    lanes: [u8; MAX_TESTS + LANES],
    /// By lane.
    lists: [UnsortedList; LANES],
    counts: [u8; LANES],
}

impl Default for NodeTests {
    fn default() -> NodeTests {
        NodeTests {
            nodes: [0; MAX_TESTS + LANES],
            lanes: [0; MAX_TESTS + LANES],
            lists: [UnsortedList { codes: [0; 2 * LANES], keys: [0.0; 2 * LANES] }; LANES],
            counts: [0; LANES],
        }
    }
}

impl NodeTests {
    /// Finds the instances whose boxes up to sixteen rays may enter. Returns one bit per ray that
    /// reaches too many boxes.
    ///
    /// The tests of all rays are in one queue, so that the processor need not predict how many
    /// nodes each ray reaches.
    #[inline(always)]
    pub(super) fn run<S: Simd>(&mut self, s: S, top: &TopLevel, rays: &[RayToList<'_>]) -> u32 {
        let NodeTests { nodes, lanes, lists, counts } = self;
        *counts = [0; LANES];
        let (tree, mut next, mut end) = (top.nodes(), 0, rays.len());
        for (lane, to) in lanes[..end].iter_mut().enumerate() {
            (*to, nodes[lane]) = (lane as u8, 0);
        }
        let mut failed = 0;
        while next < end {
            let lane = usize::from(lanes[next]) % LANES;
            let node = tree.node(nodes[next]);
            next += 1;
            let ray = &rays[lane];
            let (bits, depth) = ray.slabs.children(s, node, ray.last);
            let child = s.load_u(&node.child);
            // With coordinates near the limit of f32 the test accepts all boxes, even of empty
            // slots.
            let allowed = s.lt_u(child, s.splat_u(BOTTOM));
            let met = bits & s.mask_bits(allowed);
            let inner = met & s.mask_bits(s.lt_u(child, s.splat_u(INSTANCE)));
            let to: &mut [u32; LANES] = nodes[end..].first_chunk_mut().expect("there is room for a node");
            let added = s.compress(inner, child, to);
            let to: &mut [u8; LANES] = lanes[end..].first_chunk_mut().expect("there is room for a node");
            *to = [lane as u8; LANES];
            end += added;
            let count = lists[lane].add(s, usize::from(counts[lane]), met & !inner, depth, child);
            failed |= u32::from(count > MAX_LISTED) << lane;
            counts[lane] = count.min(MAX_LISTED) as u8;
            if end > MAX_TESTS {
                failed |= 1 << lane;
                end -= added;
            }
        }
        failed
    }

    /// Finds the nearest instances whose boxes one ray may enter, nearer nodes first, as the list
    /// of a lane. Returns the key from which on instances may be missing; infinity if none is. It
    /// takes longer than [`Self::run`] does for a ray that reaches few boxes.
    #[inline(always)]
    pub(super) fn run_one<S: Simd>(&mut self, s: S, top: &TopLevel, ray: &RayToList<'_>, lane: usize) -> f32 {
        let planes = RaySlabLanes::new(s, ray.slabs);
        let (nodes, mut stack, mut code) = (top.nodes(), SingleStack::new(), 0);
        let mut stack = stack.start(code);
        let (mut count, mut last, mut missing) = (0, ray.last, f32::INFINITY);
        // The bottom of the stack is no node.
        while code & INSTANCE == 0 {
            let node = nodes.node(code);
            let (met, depth) = entered(s, &planes, node, last);
            let child = s.load_u(&node.child);
            let inner = met & s.mask_bits(s.lt_u(child, s.splat_u(INSTANCE)));
            count = self.lists[lane].add(s, count, met & !inner, depth, child);
            if count > MAX_LISTED {
                missing = self.lists[lane].keep_nearest(s, count);
                last = if missing < last { missing } else { last };
                count = MAX_LISTED;
            }
            if inner == 0 {
                code = stack.pop(key_limit(last), NearestHit);
                continue;
            }
            let free = stack.free_entries();
            let (count, nearest) = s.sort_far_to_near(inner, depth, child, free.codes, free.keys);
            code = node.child[nearest % WIDTH];
            free.push(count);
        }
        self.counts[lane] = count as u8;
        missing
    }

    /// The instances of a lane: their bits, and depths and codes.
    #[inline(always)]
    pub(super) fn found<S: Simd>(&self, s: S, lane: usize) -> InstanceLanes<S> {
        let list = &self.lists[lane];
        InstanceLanes {
            bits: ((1u64 << self.counts[lane]) - 1) as u32,
            depths: s.load(list.keys.first_chunk().expect("of this length")),
            codes: s.load_u(list.codes.first_chunk().expect("of this length")),
        }
    }
}
