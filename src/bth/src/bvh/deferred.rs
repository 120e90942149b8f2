//! Deferred evaluation of hits: t, u and v of finished rays whose nearest triangle is certain, for
//! sixteen rays at a time.

use super::leaf::RayProgress;
use super::ray_state::RayState;
use crate::bvh::candidate::{Candidate, Settle};
use crate::bvh::nodes::{Leaf, LeafMemory, leaf};
use crate::intersect::exact_lanes::{ExactCorners, Intersections, Pairs};
use crate::intersect::exact_ray::{ExactRay, LineLanes};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::prepare::gather_rays;
use crate::query::sink::Sink;
use crate::query::{Goal, NearestHit, RayQuery};
use crate::rays::Ray;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::{NONE, WIDTH};
use bth_format::object::ObjectView;

/// Up to sixteen finished rays whose pending hit is not yet computed.
pub(crate) struct DeferredHits {
    count: usize,
    /// Indices of the rays in the batch.
    ray: [u32; LANES],
    candidate: [Candidate; LANES],
    /// Indices of the hit triangles in the object's leaf order.
    index: [u32; LANES],
    pairs: Pairs,
    intersections: Intersections,
}

/// Computes the pending hits of all rays that were added and stores their answers, as a part of
/// kernels.
struct Flush<'a, 's> {
    deferred: &'a mut DeferredHits,
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    sink: &'a mut Sink<'s>,
}

impl<S: Simd> Part<S> for Flush<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let Flush { deferred, object, rays, sink } = self;
        let count = std::mem::take(&mut deferred.count).min(LANES);
        let all = ((1u64 << count) - 1) as u32;
        // Gathering all rays here was measured to take half the time of storing each when it is
        // added.
        let [ox, oy, oz, _, dx, dy, dz, _] = gather_rays(s, s.mask(all), rays, s.load_u(&deferred.ray));
        let (origin, direction) = ([ox, oy, oz], [dx, dy, dz]);
        for k in 0..3 {
            s.store(origin[k], &mut deferred.pairs.origin[k]);
            s.store(direction[k], &mut deferred.pairs.direction[k]);
        }
        let (lines, intersections) = (sink.lines(), &mut deferred.intersections);
        if lines.are_rays() {
            intersections.compute(s, all, &deferred.pairs);
        } else {
            let mut of_lanes = LineLanes::NONE;
            lines.lanes(&deferred.ray[..count], rays, &mut of_lanes);
            if object.exact.is_empty() {
                intersections.compute_lines(s, all, &of_lanes, &deferred.pairs.corner);
            } else {
                let ids = deferred.index.map(|index| object.triangle_ids[index as usize]);
                let triangles = ExactCorners::of(&object.exact, &ids, all);
                intersections.compute_lines(s, all, &of_lanes, &triangles);
            }
        }
        for lane in 0..LANES {
            if intersections.certain >> lane & 1 != 0 {
                let (t, u, v) = (intersections.t[lane], intersections.u[lane], intersections.v[lane]);
                sink.hit(
                    deferred.ray[lane] as usize,
                    object.triangle_ids[deferred.index[lane] as usize],
                    t,
                    u,
                    v,
                );
            }
        }
        let mut rest = all & !intersections.certain;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            rest &= rest - 1;
            let index = deferred.ray[lane] as usize;
            let ray = ExactRay::new(&rays[index], lines.of(index));
            let mut query = RayQuery::new(NearestHit, ray.ray);
            let (pending, of_leaf) = (deferred.candidate[lane], (NONE, 0));
            s.call(Settle { object, ray, pending, of_leaf, query: &mut query });
            sink.query(deferred.ray[lane] as usize, &query);
        }
    }
}

impl DeferredHits {
    pub(crate) fn new() -> Self {
        DeferredHits {
            count: 0,
            ray: [0; LANES],
            candidate: [Candidate::NONE; LANES],
            index: [0; LANES],
            pairs: Pairs::NONE,
            intersections: Intersections::NONE,
        }
    }

    /// Adds a finished ray, or stores its answer at once if it has no pending hit.
    #[inline(always)]
    pub(crate) fn add<S: Simd, G: Goal>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        state: &RayState<G>,
        sink: &mut Sink<'_>,
    ) {
        let (ray, candidate) = (state.ray(), state.pending());
        if state.goal().is_any() || candidate.leaf == NONE {
            return state.report(sink);
        }
        let lane = self.count % LANES;
        let mut memory = LeafMemory::default();
        match leaf(s, object, object.node_base(), candidate.leaf, &mut memory) {
            Leaf::Indexed(leaf) => self.store_triangle(lane, leaf, candidate.triangle),
            Leaf::Raw(leaf) => self.store_triangle(lane, leaf, candidate.triangle),
            Leaf::Special(_) | Leaf::None => return,
        }
        self.ray[lane] = ray as u32;
        self.candidate[lane] = candidate;
        self.count = lane + 1;
        if self.count == LANES {
            self.flush(s, object, rays, sink);
        }
    }

    /// Stores the index and the corners of a triangle in a lane.
    #[inline(always)]
    fn store_triangle<B: TriangleBlock>(&mut self, lane: usize, block: &B, triangle: u32) {
        self.index[lane] = block.first() + triangle;
        for c in 0..3 {
            for k in 0..3 {
                let x = block.coordinate(triangle as usize % WIDTH, c, k);
                self.pairs.corner[c][k][lane] = x;
            }
        }
    }

    /// Computes the pending hits of all rays that were added, and stores their answers.
    #[inline(always)]
    pub(crate) fn flush<S: Simd>(
        &mut self,
        s: S,
        object: &ObjectView<'_>,
        rays: &[Ray],
        sink: &mut Sink<'_>,
    ) {
        if self.count == 0 {
            return;
        }
        Flush { deferred: self, object, rays, sink }.inline_or_call(s);
    }
}
