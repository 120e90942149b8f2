//! Rays of a batch through the BVH of an object: taken in sixteen at a time, and handed on as they end.

use super::deferred::DeferredHits;
use super::leaf::{LeafOutcome, Progress, decide};
use super::nodes::Nodes;
use super::ray_pool::RayPool;
use super::ray_state::RayState;
use super::stack::{StackPosition, Stacks};
use crate::intersect::prepare::Prepared;
use crate::query::Query;
use crate::query::sink::Sink;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectBounds;
use bth_format::object::ObjectView;

/// The rays still to be traced.
pub(crate) struct RemainingRays<'a, Q> {
    /// Places in the batch of those to trace, or all.
    pub(crate) order: Option<&'a [u32]>,
    /// Queries of all rays of the batch, if they have been asked elsewhere already.
    pub(crate) queries: Option<&'a [Q]>,
    /// Per ray of the batch the tet leaf that it has walked already, or `NONE`.
    pub(crate) walked: Option<&'a [u32]>,
}

/// A batch on its way.
pub(crate) struct Interleaved<'a, 's, Q: Query> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    pub(crate) remaining: RemainingRays<'a, Q>,
    pub(crate) stacks: &'a mut Stacks,
    /// Where answers go.
    pub(crate) to: &'a mut Sink<'s, Q>,
}

/// The next rays, sixteen at a time: prepared, and tested against the boxes of the root's children.
#[repr(C, align(64))]
struct RaySource<'a, Q> {
    prepared: Prepared,
    /// Per lane the depths at which the ray enters the children of the root,
    enter: [[f32; LANES]; LANES],
    /// and which of them it may meet, a bit each.
    hit_cache: [u32; LANES],
    /// Places in the batch of those prepared.
    ray: [u32; LANES],
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    remaining: RemainingRays<'a, Q>,
    /// Where rays start.
    root: u32,
    bounds: ObjectBounds,
    /// Lanes of rays that meet any, and how many of these are gone.
    lane: [u8; LANES],
    filled: usize,
    used: usize,
    /// Rays taken before.
    before: usize,
}

impl<Q: Query> Interleaved<'_, '_, Q> {
    /// Traces all rays, and hands on their results. Tet leaves without a subtree are handed to `tets`, which returns whether
    /// the query has what it wants.
    #[inline(always)]
    pub(crate) fn run<S: Simd, N: Nodes>(
        self,
        s: S,
        nodes: N,
        mut tets: impl FnMut(u32, &Ray, &mut Q) -> bool,
    ) {
        let Interleaved { object, rays, remaining, stacks, to } = self;
        let walked = remaining.walked;
        let mut supply = RaySource {
            object,
            rays,
            remaining,
            root: root(object),
            bounds: object.bounds,
            prepared: Prepared::new(),
            ray: [0; LANES],
            hit_cache: [0; LANES],
            enter: [[0.0; LANES]; LANES],
            lane: [0; LANES],
            filled: 0,
            used: 0,
            before: 0,
        };
        let mut deferred = DeferredHits::new();
        let mut pool = RayPool::new(object, stacks);
        while !pool.is_empty() {
            pool.inner_steps(s, nodes, object);
            for i in 0..pool.take_ended() {
                if let Some(at) = pool.ended(i) {
                    deferred.add(s, object, rays, pool.state(at), to);
                    supply.start(s, nodes, at, &mut pool);
                }
            }
            pool.leaf_steps(s, nodes, (object, rays), |row, state, top, stacks| {
                let place = state.ray();
                if walked.is_some_and(|walked| walked[place] == row) {
                    return LeafOutcome::Nothing;
                }
                enter_tets(object, row, &rays[place], (state, top), stacks, &mut tets)
            });
        }
        deferred.flush(s, object, rays, to);
    }
}

impl<Q: Query> RaySource<'_, Q> {
    /// Puts the next ray that can hit anything into a slot, if there is one.
    #[inline(always)]
    fn start<S: Simd, N: Nodes>(&mut self, s: S, nodes: N, at: usize, pool: &mut RayPool<'_, Q>) {
        loop {
            while self.used == self.filled {
                if !self.refill(s, nodes) {
                    return;
                }
            }
            let lane = usize::from(self.lane[self.used]) % LANES;
            self.used += 1;
            let place = self.ray[lane];
            let query = self.remaining.queries.map(|queries| queries[place as usize]);
            let prepared = self.prepared.prepared(lane);
            let state = pool.state(at);
            if let Some(prepared) = prepared {
                state.start(prepared, query);
            } else {
                let ray = (place, &self.rays[place as usize]);
                if !state.start_unprepared(self.object, ray, query) {
                    continue;
                }
            }
            if query.is_some() {
                state.take_over(&self.rays[place as usize]);
            }
            if prepared.is_some() && self.root & Child::LEAF_BIT == 0 {
                let root = N::node(self.object.node_base(), self.root);
                pool.start_among(s, at, root, (self.hit_cache[lane], s.load(&self.enter[lane])));
            } else {
                pool.start(at, self.root);
            }
            return;
        }
    }

    /// Prepares the next sixteen rays; false if there are none.
    #[inline(always)]
    fn refill<S: Simd, N: Nodes>(&mut self, s: S, _nodes: N) -> bool {
        let order = self.remaining.order;
        let total = order.map_or(self.rays.len(), <[u32]>::len);
        let count = (total - self.before).min(LANES);
        for i in 0..count {
            let place = self.before + i;
            self.ray[i] = order.map_or(place as u32, |order| order[place]);
        }
        self.before += count;
        (self.used, self.filled) = (0, 0);
        if count == 0 {
            return false;
        }
        self.prepared.fill(s, &self.bounds, self.rays, &self.ray, count);
        let root = (self.root & Child::LEAF_BIT == 0).then(|| N::node(self.object.node_base(), self.root));
        for lane in 0..count {
            let mut meets = true;
            if let (Some(prepared), Some(root)) = (self.prepared.prepared(lane), root) {
                let (bits, enter) = prepared.slabs.children(s, root, prepared.slabs.last);
                s.store(enter, &mut self.enter[lane % LANES]);
                self.hit_cache[lane % LANES] = bits;
                meets = bits != 0;
            }
            // Without a branch: many rays of a batch may miss all that there is.
            self.lane[self.filled % LANES] = lane as u8;
            self.filled += usize::from(meets);
        }
        true
    }
}

/// Where rays start that need not enter tetrahedra.
fn root(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(row)) if object.tet_leaves[row as usize].subtree != NONE => {
            object.tet_leaves[row as usize].subtree
        }
        _ => object.header.root,
    }
}

#[cold]
#[inline(never)]
fn enter_tets<Q: Query>(
    object: &ObjectView<'_>,
    row: u32,
    ray: &Ray,
    (state, top): (&mut RayState<Q>, StackPosition),
    stacks: &mut Stacks,
    tets: &mut impl FnMut(u32, &Ray, &mut Q) -> bool,
) -> LeafOutcome {
    let subtree = object.tet_leaves[row as usize].subtree;
    if subtree != NONE {
        stacks.set_code(top, subtree);
        return LeafOutcome::Replaced;
    }
    decide(object, ray, state, NONE, 0);
    if tets(row, ray, state.query(ray)) { LeafOutcome::Done } else { state.take_over(ray) }
}
