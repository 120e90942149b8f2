//! Traversal of an object's BVH by the rays of a batch, interleaved: rays are prepared sixteen at a
//! time, enter the pool as slots become free, and their answers are stored as they finish.

use super::deferred::DeferredHits;
use super::leaf::{LeafOutcome, RayProgress, decide};
use super::ray_pool::{POOL_SIZE, PoolRays, PoolSlot, RareSteps, RayPool, has_rare_steps};
use super::ray_state::RayState;
use super::stack::Stacks;
use crate::intersect::exact_ray::ExactRay;
use crate::intersect::prepare::Prepared;
use crate::query::Goal;
use crate::query::sink::Sink;
use crate::rays::Ray;
use crate::shortcuts::{ENTRY_RAYS, FindEntryNode, SpecialLeaf, entry_run};
use crate::simd::{CacheLevel, Kernel, LANES, Scalar, Simd};
use bth_format::layout::{Child, NONE, WIDTH, WideNode};
use bth_format::object::ObjectBounds;
use bth_format::object::ObjectView;

/// The kernel that traverses a batch and stores its answers.
pub(crate) struct Interleaved<'a, 's, G: Goal> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    /// Indices in the batch of the rays to trace, in this order; all rays if absent.
    pub(crate) order: Option<&'a [u32]>,
    pub(crate) stacks: &'a mut Stacks,
    pub(crate) sink: &'a mut Sink<'s>,
    pub(crate) goal: G,
    /// True if runs of coherent rays begin at entry nodes. It pays in
    /// [large](super::nodes::is_large) objects only.
    pub(crate) entry_nodes: bool,
}

/// Supplies rays to the pool. Sixteen at a time are prepared and tested against the boxes of the
/// root's children or, if they are coherent, of their entry node's.
#[repr(C, align(64))]
struct RaySource<'a> {
    prepared: Prepared,
    /// For each lane the depths at which its ray enters the children.
    enter: [[f32; LANES]; LANES],
    /// For each lane a bit for each child that its ray may hit.
    children: [u32; LANES],
    /// Codes of the children, unless the root is a leaf.
    codes: [u32; LANES],
    /// The entry node of the next rays, as long as fewer than this many of the batch have been
    /// prepared.
    entered: usize,
    /// True if entry nodes are searched.
    searches: bool,
    entry_node: WideNode,
    /// For each lane the index of its ray in the batch.
    ray: [u32; LANES],
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    order: Option<&'a [u32]>,
    /// Child code at which rays start.
    root: u32,
    bounds: ObjectBounds,
    /// Lanes whose rays may hit a child of the root; the first `filled` are valid.
    lane: [u8; LANES],
    filled: usize,
    /// How many of those lanes have been started.
    used: usize,
    /// How many rays of the batch have been prepared.
    taken: usize,
}

impl<G: Goal> Kernel for Interleaved<'_, '_, G> {
    type Output = ();
    const SCALAR: bool = false;
    const QUADS: bool = G::QUADS;
    const LONG_VECTORS: bool = G::LONG_VECTORS;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Interleaved { object, rays, order, stacks, sink, goal, entry_nodes } = self;
        let lines = sink.lines();
        let mut source = RaySource {
            object,
            rays,
            order,
            root: object.header.root,
            bounds: object.bounds,
            prepared: Prepared::new(),
            ray: [0; LANES],
            children: [0; LANES],
            codes: [NONE; LANES],
            entry_node: WideNode { bounds: [[[0.0; WIDTH]; 2]; 3], child: [NONE; WIDTH] },
            entered: 0,
            searches: entry_nodes,
            enter: [[0.0; LANES]; LANES],
            lane: [0; LANES],
            filled: 0,
            used: 0,
            taken: 0,
        };
        let mut deferred = DeferredHits::new();
        let mut slots = [PoolSlot::vacant(goal); POOL_SIZE];
        let mut pool = RayPool::new(object, &mut slots, stacks, goal);
        let has_rare_steps = has_rare_steps(object);
        while !pool.is_empty() {
            if has_rare_steps {
                s.call(RareSteps(&mut pool, object));
            } else {
                pool.inner_steps(s, object, CacheLevel::First);
            }
            for i in 0..pool.take_bottom() {
                if let Some(slot) = pool.finished(i) {
                    deferred.add(s, object, rays, pool.state(slot), sink);
                    source.start(s, slot, &mut pool);
                }
            }
            pool.leaf_steps(s, PoolRays { object, rays, lines }, |leaf, state| {
                let ray = state.ray();
                let ray = ExactRay::new(&rays[ray], lines.of(ray));
                enter_special_leaf(object, leaf, ray, state)
            });
        }
        // An any-hit query has no pending hits.
        if !goal.is_any() {
            deferred.flush(s, object, rays, sink);
        }
    }
}

impl RaySource<'_> {
    /// Starts the next ray that can hit anything in a slot, if there is one.
    #[inline(always)]
    fn start<S: Simd, G: Goal>(&mut self, s: S, slot: usize, pool: &mut RayPool<'_, G>) {
        loop {
            while self.used == self.filled {
                if !self.refill(s) {
                    return;
                }
            }
            let lane = usize::from(self.lane[self.used]) % LANES;
            self.used += 1;
            let index = self.ray[lane];
            let prepared = self.prepared.prepared(lane);
            let state = pool.state(slot);
            if let Some(prepared) = prepared {
                state.start(prepared);
            } else {
                let ray = (index, &self.rays[index as usize]);
                if !state.start_unprepared(self.object, ray) {
                    continue;
                }
            }
            if prepared.is_some() && self.root & Child::LEAF_BIT == 0 {
                pool.start_among(s, slot, &self.codes, (self.children[lane], s.load(&self.enter[lane])));
            } else {
                pool.start(slot, self.root);
            }
            return;
        }
    }

    /// Prepares up to sixteen of the next rays. Returns false if no ray is left.
    #[inline(always)]
    fn refill<S: Simd>(&mut self, s: S) -> bool {
        let order = self.order;
        let total = order.map_or(self.rays.len(), <[u32]>::len);
        let count = (total - self.taken).min(LANES);
        for i in 0..count {
            let next = self.taken + i;
            self.ray[i] = order.map_or(next as u32, |order| order[next]);
        }
        self.find_entry_node(s);
        self.taken += count;
        (self.used, self.filled) = (0, 0);
        if count == 0 {
            return false;
        }
        self.prepared.fill(s, &self.bounds, self.rays, &self.ray, count);
        let root = if self.root & Child::LEAF_BIT != 0 {
            None
        } else if self.taken <= self.entered {
            Some(&self.entry_node)
        } else {
            Some(self.object.node(self.root))
        };
        if let Some(root) = root {
            self.codes = root.child;
        }
        for lane in 0..count {
            let mut may_hit = true;
            if let (Some(prepared), Some(root)) = (self.prepared.prepared(lane), root) {
                let (bits, enter) = prepared.slabs.children(s, root, prepared.slabs.last);
                s.store(enter, &mut self.enter[lane % LANES]);
                self.children[lane % LANES] = bits;
                may_hit = bits != 0;
            }
            // There is no branch, because in many batches part of the rays miss the whole object.
            self.lane[self.filled % LANES] = lane as u8;
            self.filled += usize::from(may_hit);
        }
        true
    }

    /// Searches the entry node of the next rays, where those before had another. They must follow
    /// one another in the batch.
    #[inline(always)]
    fn find_entry_node<S: Simd>(&mut self, s: S) {
        // Not with 128 bits, whose code is long, nor in scalar code.
        if !S::INLINES_PARTS || !self.taken.is_multiple_of(ENTRY_RAYS) || !self.searches {
            return;
        }
        let first = self.ray[0] as usize;
        let Some(rays) = entry_run(self.rays, self.order, self.taken, first) else { return };
        let (node_base, root, bounds) = (self.object.node_base(), self.root, &self.bounds);
        if s.call(FindEntryNode { node_base, root, bounds, rays, node: &mut self.entry_node }) {
            self.entered = self.taken + ENTRY_RAYS;
        }
    }
}

/// Enters a special leaf.
#[cold]
#[inline(never)]
fn enter_special_leaf<G: Goal>(
    object: &ObjectView<'_>,
    leaf: SpecialLeaf,
    ray: ExactRay<'_>,
    state: &mut RayState<G>,
) -> LeafOutcome {
    decide(Scalar, object, ray, &object.bounds, state, (NONE, 0));
    if leaf.enter(object, ray, state.query(ray.ray), &mut ()) {
        LeafOutcome::Done
    } else {
        state.update_from_query(ray.ray, object.bounds.origin_error)
    }
}
