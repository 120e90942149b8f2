//! State of one of several interleaved rays in the wide BVH, with the step through a node. The step
//! through a leaf is [`enter_leaf`](super::leaf::enter_leaf); the order in which rays step is
//! decided by [`ray_pool`](super::ray_pool).

use super::leaf::RayProgress;
use crate::bvh::candidate::Candidate;
use crate::intersect::prepare::{HitProgress, PreparedRay};
use crate::query::sink::Sink;
use crate::query::{Goal, RayQuery};
use crate::rays::Ray;
use crate::simd::{Scalar, Simd};
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectView;
use zerocopy::FromZeros;

/// Relative amount by which a key of the stack may exceed the depth at which the ray enters the
/// child: sorting replaces the four lowest bits of the f32 by the index of the child. A denormal
/// key exceeds the depth by less than the smallest normal number.
const KEY_SLACK: f32 = 1.0 / (1 << 19) as f32;

/// The largest key of stack entries that can hold hits up to the depth `last`.
#[inline(always)]
pub(crate) fn key_limit(last: f32) -> f32 {
    // The sum comes first, so that the product is not a denormal number, which takes processors a
    // hundred cycles: `last` is next to 0 where a ray hits the triangle that its origin lies on.
    last + (last.abs() + f32::MIN_POSITIVE / KEY_SLACK) * KEY_SLACK
}

/// State of a ray that is being traced.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct RayState<G> {
    /// The prepared ray, with the hits found so far in `progress` and the limit of depth in
    /// `slabs.last`.
    prepared: PreparedRay,
    /// Valid if [`HitProgress::BY_QUERY`] is set; its goal always is. Most rays never need a
    /// decision in f64, and their query is never written.
    query: RayQuery<G>,
}

impl<G: Goal> RayState<G> {
    /// Like [`Self::start`], for a ray with index `index` that f32 lanes could not prepare. Returns
    /// false if the ray cannot hit anything ([`PreparedRay::in_f64`]).
    #[cold]
    #[inline(never)]
    pub(crate) fn start_unprepared(&mut self, object: &ObjectView<'_>, (index, ray): (u32, &Ray)) -> bool {
        let prepared =
            PreparedRay::of(Scalar, &object.bounds, ray).or_else(|| PreparedRay::in_f64(&object.bounds, ray));
        prepared.map(|prepared| self.start(&PreparedRay { ray: index, ..prepared })).is_some()
    }

    /// State without a ray.
    pub(crate) fn vacant(query: RayQuery<G>) -> Self {
        RayState {
            prepared: PreparedRay { progress: HitProgress::NOTHING, ..PreparedRay::new_zeroed() },
            query,
        }
    }

    /// Begins a prepared ray.
    #[inline(always)]
    pub(crate) fn start(&mut self, prepared: &PreparedRay) {
        self.prepared = *prepared;
    }

    fn set_query(&mut self, query: RayQuery<G>) {
        (self.query, self.prepared.progress.decided) = (query, HitProgress::BY_QUERY);
    }

    /// Index of the ray in the batch.
    #[inline(always)]
    pub(crate) fn ray(&self) -> usize {
        self.prepared.ray as usize
    }

    /// Stores the answer of the ray, which must have no pending hit.
    #[inline(always)]
    pub(crate) fn report(&self, sink: &mut Sink<'_>) {
        match self.prepared.progress.decided {
            HitProgress::UNDECIDED => {}
            HitProgress::ACCEPTED => sink.accepted(self.ray()),
            _ => sink.query(self.ray(), &self.query),
        }
    }

    /// The largest key of stack entries that can still change the result.
    #[inline(always)]
    pub(crate) fn key_limit(&self) -> f32 {
        key_limit(self.prepared.slabs.last)
    }

    /// Writes codes and keys of the children whose box the ray may hit, the nearest last; returns
    /// their number.
    #[inline(always)]
    pub(crate) fn enter_node<S: Simd>(
        &self,
        s: S,
        goal: G,
        node: &WideNode,
        entries: (&mut [u32; WIDTH], &mut [f32; WIDTH]),
    ) -> usize {
        let (bits, enter) = self.prepared.slabs.children(s, node, self.prepared.slabs.last);
        write_children(s, goal, &node.child, (bits, enter), entries)
    }
}

impl<G: Goal> RayProgress<G> for RayState<G> {
    #[inline(always)]
    fn goal(&self) -> G {
        self.query.goal()
    }
    #[inline(always)]
    fn prepared(&self) -> &PreparedRay {
        &self.prepared
    }
    #[inline(always)]
    fn last(&self) -> f32 {
        self.prepared.slabs.last
    }
    #[inline(always)]
    fn set_last(&mut self, last: f32) {
        self.prepared.slabs.last = last;
    }
    #[inline(always)]
    fn nearest(&self) -> f32 {
        self.prepared.progress.nearest
    }
    #[inline(always)]
    fn set_nearest(&mut self, nearest: f32) {
        self.prepared.progress.nearest = nearest;
    }
    #[inline(always)]
    fn pending(&self) -> Candidate {
        let HitProgress { leaf, triangle, .. } = self.prepared.progress;
        Candidate { leaf, triangle: triangle.into() }
    }
    #[inline(always)]
    fn set_pending(&mut self, pending: Candidate) {
        (self.prepared.progress.leaf, self.prepared.progress.triangle) =
            (pending.leaf, pending.triangle as u16);
    }
    #[inline(always)]
    fn query(&mut self, ray: &Ray) -> &mut RayQuery<G> {
        if self.prepared.progress.decided == HitProgress::UNDECIDED {
            self.set_query(RayQuery::new(self.query.goal(), ray));
        }
        &mut self.query
    }
    #[inline(always)]
    fn accept(&mut self) {
        self.prepared.progress.decided = HitProgress::ACCEPTED;
    }
}

/// Writes codes and keys of the children whose bit is set, the nearest last, given the codes of all
/// children and the depths at which the ray enters all children; returns their number. Any-hit
/// queries write no keys.
#[inline(always)]
pub(crate) fn write_children<S: Simd>(
    s: S,
    goal: impl Goal,
    child: &[u32; WIDTH],
    (bits, enter): (u32, S::F),
    (codes, keys): (&mut [u32; WIDTH], &mut [f32; WIDTH]),
) -> usize {
    let children = s.load_u(child);
    if goal.is_any() {
        s.compress(bits, children, codes)
    } else {
        s.compress_far_to_near(bits, enter, children, codes, keys)
    }
}
