//! The instances whose boxes a ray may enter, in the order of their depths.
//!
//! A ray is tested against all nodes that it reaches, in any order, and the instances that it
//! reaches are sorted. The stack of a traversal would first visit all instances in the nearest
//! node, also those that are farther than some in the next node.

use super::box_tests::{entered, limit};
use super::top_level::TopLevel;
use super::top_nodes::{INSTANCE, TopNodes};
use crate::bvh::ray_state::key_limit;
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::simd::{LANES, Simd};

/// The min key of a list. Negative depths, which rounding makes of zero, would not be sorted, and
/// keys near zero would be denormal, since their lowest bits are overwritten. It is still a lower
/// bound for the comparison with a limit, to which [`key_limit`] adds as much.
const MIN_KEY: f32 = f32::MIN_POSITIVE;

/// Max number of nodes that a ray is tested against.
const MAX_NODES: usize = 2 * LANES;

/// Receiver of instances: it returns the max t, rounded to f32, of hits that can still change the
/// result, or `None` to end.
pub(super) type InstanceReceiver<'a> = &'a mut dyn FnMut(u32) -> Option<f32>;

/// Up to sixteen instances.
pub(super) struct InstanceList {
    /// The codes of the instances, the nearest last.
    codes: [u32; LANES],
    /// Lower bounds of the depths at which the ray enters their boxes.
    keys: [f32; LANES],
    count: usize,
}

impl InstanceList {
    /// The instances that a ray may enter before the depth `last`; its tmin is not negative. `None`
    /// if these or their nodes are too many.
    #[inline(always)]
    pub(super) fn of<S: Simd>(s: S, top: &TopLevel, slabs: &RaySlabs, last: f32) -> Option<InstanceList> {
        let planes = RaySlabLanes::new(s, slabs);
        let tree = top.nodes();
        let root = Met::of(s, tree, 0, &planes, last);
        let mut list = InstanceList { codes: [0; LANES], keys: [0.0; LANES], count: 0 };
        if root.nodes == 0 {
            list.sort(s, root.instances, root.depths, root.codes);
            return Some(list);
        }
        let mut nodes = [0; MAX_NODES + LANES];
        let (mut codes, mut keys) = ([0; 2 * LANES], [0.0; 2 * LANES]);
        let (mut next, mut end, mut count) = (0, 0, 0);
        let mut met = root;
        loop {
            end += s.compress(met.nodes, met.codes, nodes[end..].first_chunk_mut()?);
            s.compress(met.instances, met.codes, codes[count..].first_chunk_mut()?);
            count += s.compress_f(met.instances, met.depths, keys[count..].first_chunk_mut()?);
            if count > LANES || end > MAX_NODES {
                return None;
            }
            if next == end {
                break;
            }
            met = Met::of(s, tree, nodes[next], &planes, last);
            next += 1;
        }
        let instances = ((1u64 << count) - 1) as u32;
        list.sort(s, instances, s.load(keys.first_chunk()?), s.load_u(codes.first_chunk()?));
        Some(list)
    }

    #[inline(always)]
    fn sort<S: Simd>(&mut self, s: S, instances: u32, depths: S::F, codes: S::U) {
        let depths = s.max(depths, s.splat(MIN_KEY));
        self.count = s.compress_far_to_near(instances, depths, codes, &mut self.codes, &mut self.keys);
    }

    /// Calls `visit` with the instances like [`World::enumerate`](super::World::enumerate). `scale`
    /// is the depth of t = 1.
    #[inline(always)]
    pub(super) fn visit(&self, scale: f32, mut tmax: f32, visit: InstanceReceiver<'_>) -> bool {
        let mut max_key = f32::INFINITY;
        for i in (0..self.count.min(LANES)).rev() {
            if self.keys[i] > max_key {
                return false;
            }
            match visit(self.codes[i] & !INSTANCE) {
                None => return true,
                Some(t) if t < tmax => (tmax, max_key) = (t, key_limit(limit(scale, t))),
                Some(_) => {}
            }
        }
        false
    }
}

/// The children of a node that a ray may enter.
struct Met<S: Simd> {
    /// The children that are nodes, one bit per child.
    nodes: u32,
    /// Those that are instances.
    instances: u32,
    /// Of all children the codes, and lower bounds of the depths at which the ray enters them.
    codes: S::U,
    depths: S::F,
}

impl<S: Simd> Met<S> {
    #[inline(always)]
    fn of(s: S, tree: TopNodes<'_>, code: u32, planes: &RaySlabLanes<S>, last: f32) -> Met<S> {
        let node = tree.node(code);
        let (entered, depths) = entered(s, planes, node, last);
        let codes = s.load_u(&node.child);
        let nodes = entered & s.mask_bits(s.lt_u(codes, s.splat_u(INSTANCE)));
        Met { nodes, instances: entered & !nodes, codes, depths }
    }
}
