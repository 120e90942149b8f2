//! Intersection of one ray with the triangles of a leaf, for single and for interleaved rays.
//!
//! The conservative f32 filter ([`TriangleFilter`](crate::intersect::filter::TriangleFilter))
//! excludes the triangles that are certainly missed. A triangle that is certainly hit, and
//! certainly nearer than all hits before, becomes the pending hit: its t, u and v are computed when
//! the traversal has ended, since most rays find several hits, each nearer than the one before. The
//! other triangles are decided at once, in f64 or exactly ([`Settle`]). Packets take the same
//! decisions with one ray in each lane (`bvh/packet/leaf.rs`), and share [`Settle`].

use crate::bvh::candidate::{Candidate, Settle};
use crate::intersect::exact_quad::rounded_intersection;
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::filter::{Candidates, Certain, TriangleBlock};
use crate::intersect::prepare::PreparedRay;
use crate::query::{Goal, RayQuery, TriangleRef};
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::object::{ObjectBounds, ObjectView};

/// Result of a leaf for a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafOutcome {
    /// Nothing nearer than before was found.
    Nothing,
    /// A nearer hit than before was found: stack entries beyond it can be dropped.
    Nearer,
    /// The query is complete.
    Done,
}

/// State of a ray that leaves read and update.
pub(crate) trait RayProgress<G: Goal> {
    fn goal(&self) -> G;
    fn prepared(&self) -> &PreparedRay;
    /// Upper limit of the depths of hits that can still change the result.
    fn last(&self) -> f32;
    fn set_last(&mut self, last: f32);
    /// Lower bound of the depth of the nearest hit so far.
    fn nearest(&self) -> f32;
    fn set_nearest(&mut self, nearest: f32);
    /// The nearest hit so far if its t, u and v are not yet computed, else [`Candidate::NONE`].
    fn pending(&self) -> Candidate;
    fn set_pending(&mut self, pending: Candidate);
    /// The query, which is constructed from `ray` at the first call.
    fn query(&mut self, ray: &Ray) -> &mut RayQuery<G>;
    /// Records that some triangle is certainly hit, which completes an any-hit query.
    fn accept(&mut self);

    /// Updates the limits of depth from the hits that the query holds: [`LeafOutcome::Nearer`] if
    /// they shrank. `origin_error` is taken from the
    /// [bounds](bth_format::object::ObjectBounds::origin_error) for which the ray was prepared.
    #[inline(always)]
    fn update_from_query(&mut self, ray: &Ray, origin_error: f32) -> LeafOutcome {
        // The limits of an any-hit query do not change before its first hit, which ends it.
        if self.goal().is_any() {
            return LeafOutcome::Nothing;
        }
        let (before, query) = (self.last(), *self.query(ray));
        let slabs = self.prepared().slabs;
        self.set_last(slabs.limit(query.limit(), origin_error));
        self.set_nearest(slabs.nearest(query.found_bounds(), origin_error));
        if self.last() < before { LeafOutcome::Nearer } else { LeafOutcome::Nothing }
    }
}

/// A leaf of triangles and its child code.
pub(crate) struct CodedLeaf<'a, B> {
    pub(crate) block: &'a B,
    pub(crate) code: u32,
}

/// Intersects a ray with the triangles of a leaf. `bounds` are those for which the ray was
/// prepared.
#[inline(always)]
pub(crate) fn enter_leaf<S: Simd, G: Goal, B: TriangleBlock>(
    s: S,
    object: &ObjectView<'_>,
    goal: G,
    bounds: &ObjectBounds,
    ray: ExactRay<'_>,
    progress: &mut impl RayProgress<G>,
    CodedLeaf { block, code }: CodedLeaf<'_, B>,
) -> LeafOutcome {
    let prepared = progress.prepared();
    let (first, last) = (prepared.slabs.first, progress.last());
    let own = ray.own_triangle(code);
    let found = prepared.filter.candidates(s, (block, own), first, last, bounds);
    if found.maybe == 0 {
        return LeafOutcome::Nothing;
    }
    if G::HAS_CONDITIONS {
        // Not the nearest of them alone, which may not count.
        return offer_each(s, object, bounds, ray, progress, CodedLeaf { block, code }, found);
    }
    if goal.is_any() {
        if found.sure != 0 {
            progress.accept();
            return LeafOutcome::Done;
        }
        return decide(s, object, ray, bounds, progress, (code, found.maybe));
    }
    let (maybe, certain) = found.nearest_candidates(s);
    if let Some(Certain { triangle, near, far }) = certain
        && far < progress.nearest()
    {
        let index = (block.first() as usize).wrapping_add(triangle);
        s.prefetch(object.triangle_ids.as_ptr().wrapping_add(index));
        progress.set_nearest(near);
        progress.set_pending(Candidate { leaf: code, triangle: triangle as u32 });
        let nearer = far < progress.last();
        progress.set_last(if nearer { far } else { progress.last() });
        return if nearer { LeafOutcome::Nearer } else { LeafOutcome::Nothing };
    }
    decide(s, object, ray, bounds, progress, (code, maybe))
}

/// Offers the triangles of a leaf that may be hit to a query with conditions, which need t, u and
/// v.
#[inline(always)]
fn offer_each<S: Simd, G: Goal, B: TriangleBlock>(
    s: S,
    object: &ObjectView<'_>,
    bounds: &ObjectBounds,
    ray: ExactRay<'_>,
    progress: &mut impl RayProgress<G>,
    CodedLeaf { block, code }: CodedLeaf<'_, B>,
    found: Candidates<S>,
) -> LeafOutcome {
    let mut open = found.maybe;
    if let LineSource::Ray = ray.line {
        let (Ray { origin, direction, .. }, norm) = (*ray.ray, progress.prepared().slabs.scale);
        let mut sure = found.sure;
        while sure != 0 {
            let i = sure.trailing_zeros() as usize;
            sure &= sure - 1;
            let rounded = rounded_intersection(s.doubles(), (origin, direction), block.corners(i), norm);
            if !rounded.is_accurate {
                continue;
            }
            open &= !(1 << i);
            let triangle = TriangleRef::index(block.first().wrapping_add(i as u32), object.triangle_ids);
            if progress.query(ray.ray).offer(triangle, rounded.intersection()) {
                return LeafOutcome::Done;
            }
        }
    }
    if open != 0 {
        return decide(s, object, ray, bounds, progress, (code, open));
    }
    progress.update_from_query(ray.ray, bounds.origin_error)
}

/// Decides the triangles of a leaf, given as its child code and their bits, and before them the
/// pending hit.
#[inline(always)]
pub(crate) fn decide<S: Simd, G: Goal>(
    s: S,
    object: &ObjectView<'_>,
    ray: ExactRay<'_>,
    bounds: &ObjectBounds,
    progress: &mut impl RayProgress<G>,
    triangles: (u32, u32),
) -> LeafOutcome {
    let pending = progress.pending();
    progress.set_pending(Candidate::NONE);
    let query = progress.query(ray.ray);
    if s.call(Settle { object, ray, pending, of_leaf: triangles, query }) {
        return LeafOutcome::Done;
    }
    progress.update_from_query(ray.ray, bounds.origin_error)
}
