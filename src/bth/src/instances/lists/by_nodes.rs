//! The instances whose boxes rays may enter, by tests of each ray against the nodes that it
//! reaches.

use super::{InstanceLanes, MAX_LISTED, MIN_KEY};
use crate::bvh::stack::BOTTOM;
use crate::instances::top_level::TopLevel;
use crate::instances::top_nodes::INSTANCE;
use crate::intersect::boxes::RaySlabs;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;

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
            let instances = met & !inner;
            let (list, count) = (&mut lists[lane], usize::from(counts[lane]));
            let to = list.codes[count..].first_chunk_mut().expect("there is room for a node");
            s.compress(instances, child, to);
            let to = list.keys[count..].first_chunk_mut().expect("there is room for a node");
            let count = count + s.compress_f(instances, s.max(depth, s.splat(MIN_KEY)), to);
            failed |= u32::from(count > MAX_LISTED) << lane;
            counts[lane] = count.min(MAX_LISTED) as u8;
            if end > MAX_TESTS {
                failed |= 1 << lane;
                end -= added;
            }
        }
        failed
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
