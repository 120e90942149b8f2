//! The rays of a packet with their queries, and the decisions in f64 about what the f32 tests of a
//! packet leave open.

use super::entry::GROUPS;
use super::hit_cache::{HitCache, UNCACHED};
use super::ray_group::RayGroup;
use super::single_rays::SingleRays;
use crate::bvh::candidate::{Candidate, Settle};
use crate::intersect::boxes::{lower_depth, upper_depth};
use crate::intersect::exact_ray::{ExactRay, Lines};
use crate::query::{Goal, RayQuery};
use crate::rays::Ray;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// The rays of a packet with their queries and decided hits.
pub(crate) struct PacketRays<'a, G: Goal> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) rays: &'a [Ray],
    pub(crate) goal: G,
    /// Queries of the rays whose bit is set in `queried`.
    pub(crate) queries: &'a mut [RayQuery<G>],
    /// A bit for each ray with a decision in f64.
    pub(crate) queried: u64,
    /// The rays as prepared single rays.
    pub(crate) single_rays: &'a mut SingleRays,
    pub(crate) hit_cache: &'a mut HitCache,
    /// A bit for each ray whose query is not complete.
    pub(crate) alive: u64,
    pub(crate) lines: Lines<'a>,
    /// True if rays may start on triangles.
    pub(crate) have_starts: bool,
    /// For each ray the child code of the leaf that holds the triangle on which it starts, and the
    /// slot there; not set without starts.
    pub(crate) own: &'a mut [[[u32; LANES]; 2]; GROUPS],
}

/// The uncached pending hits of a group; see [`RayGroup::leaf`] and [`RayGroup::triangle`].
struct UncachedHits {
    leaf: [u32; LANES],
    triangle: [u32; LANES],
}

impl UncachedHits {
    #[inline(always)]
    fn of<S: Simd>(s: S, group: &RayGroup<S>) -> Self {
        let mut hits = UncachedHits { leaf: [0; LANES], triangle: [0; LANES] };
        s.store_u(group.leaf, &mut hits.leaf);
        s.store_u(group.triangle, &mut hits.triangle);
        hits
    }

    /// The pending hit of a lane as a candidate; `pending` is the lane's [`RayGroup::pending`].
    #[inline(always)]
    fn candidate(&self, hit_cache: &HitCache, pending: u32, lane: usize) -> Candidate {
        match pending {
            NONE => Candidate::NONE,
            UNCACHED => Candidate { leaf: self.leaf[lane], triangle: self.triangle[lane] },
            cached => hit_cache.candidate(cached),
        }
    }
}

/// Decides a candidate for the rays of lanes, and before it their pending hits, as a part of
/// kernels. It is rare, so they call it on every instruction set.
pub(super) struct SettleLanes<'p, 'a, S: Simd, G: Goal> {
    pub(super) rays: &'p mut PacketRays<'a, G>,
    pub(super) group: &'p mut RayGroup<S>,
    /// Index of the group.
    pub(super) at: usize,
    pub(super) candidate: Candidate,
    /// A bit each.
    pub(super) lanes: u32,
}

impl<S: Simd, G: Goal> Part<S> for SettleLanes<'_, '_, S, G> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let SettleLanes { rays, group, at, candidate, mut lanes } = self;
        let mut pending = [0; LANES];
        s.store_u(group.pending, &mut pending);
        let uncached = UncachedHits::of(s, group);
        let (mut scale, mut limit, mut nearest) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        s.store(group.scale, &mut scale);
        s.store(group.limit, &mut limit);
        s.store(group.nearest, &mut nearest);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let ray = at * LANES + lane;
            let pending_hit = uncached.candidate(rays.hit_cache, pending[lane], lane);
            if rays.settle_one(s, ray, pending_hit, (candidate.leaf, 1 << candidate.triangle)) {
                rays.alive &= !(1 << ray);
            } else if let Some(t) = rays.queries[ray].found_bounds() {
                let off = f64::from(rays.object.bounds.origin_error);
                let [near, far] = t.map(|t| t * f64::from(scale[lane]));
                nearest[lane] = lower_depth(near - off);
                limit[lane] = limit[lane].min(upper_depth(far + off));
            }
            pending[lane] = NONE;
        }
        group.pending = s.load_u(&pending);
        group.limit = s.load(&limit);
        group.nearest = s.load(&nearest);
    }
}

impl<G: Goal> PacketRays<'_, G> {
    /// Decides the pending hits of the rays of lanes.
    #[inline(always)]
    pub(super) fn settle_last<S: Simd>(&mut self, s: S, group: &RayGroup<S>, at: usize, mut lanes: u32) {
        let mut pending = [0; LANES];
        s.store_u(group.pending, &mut pending);
        let uncached = UncachedHits::of(s, group);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let pending_hit = uncached.candidate(self.hit_cache, pending[lane], lane);
            self.settle_one(s, at * LANES + lane, pending_hit, (NONE, 0));
        }
    }

    /// Offers candidates of a ray to its query; see [`Settle`].
    #[inline(always)]
    pub(super) fn settle_one<S: Simd>(
        &mut self,
        s: S,
        ray: usize,
        pending: Candidate,
        of_leaf: (u32, u32),
    ) -> bool {
        if self.queried >> ray & 1 == 0 {
            self.queries[ray] = RayQuery::new(self.goal, &self.rays[ray]);
            self.queried |= 1 << ray;
        }
        let exact_ray = ExactRay::new(&self.rays[ray], self.lines.of(ray));
        let (object, query) = (self.object, &mut self.queries[ray]);
        s.call(Settle { object, ray: exact_ray, pending, of_leaf, query })
    }

    /// The rays of a group that start in a leaf, one bit per ray.
    #[inline(always)]
    pub(super) fn starting_in<S: Simd>(&self, s: S, at: usize, leaf: u32) -> u32 {
        if !self.have_starts {
            return 0;
        }
        s.mask_bits(s.eq_u(s.load_u(&self.own[at % GROUPS][0]), s.splat_u(leaf)))
    }

    /// The rays of a group whose triangle has this slot in its leaf, one bit per ray.
    #[inline(always)]
    pub(super) fn starting_at<S: Simd>(&self, s: S, at: usize, slot: u32) -> u32 {
        s.mask_bits(s.eq_u(s.load_u(&self.own[at % GROUPS][1]), s.splat_u(slot)))
    }
}
