//! What the triangles of a leaf mean to one ray, for rays alone and for interleaved ones.
//!
//! f32 lanes leave out the triangles that are certainly missed ([`TriangleFilter::candidates`](crate::intersect::filter::TriangleFilter)). Of the others
//! one that is certainly hit, and certainly nearer than all before, only becomes the pending hit: it is computed when the ray
//! has ended, since most rays meet several hits, each nearer than the last. What f32 leaves open is decided at once, in f64 or
//! exactly ([`settle`]). Packets take the same decisions with a ray in each lane (`packets::leaf`).

use crate::bvh::candidate::{Candidate, settle};
use crate::intersect::filter::{Certain, TriangleBlock};
use crate::intersect::prepare::PreparedRay;
use crate::query::Query;
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::object::ObjectView;

/// What a leaf made of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LeafOutcome {
    /// Nothing nearer than before was found.
    Nothing,
    /// Another node or leaf stands in the place of the leaf, and is to be entered at once.
    Replaced,
    /// A nearer hit than before was found: entries of the stack that lie farther off need not be entered.
    Nearer,
    /// The query has what it wants.
    Done,
}

/// What a traversal keeps of a ray while it goes through leaves.
pub(crate) trait Progress<Q: Query> {
    fn prepared(&self) -> &PreparedRay;
    /// The depth beyond which nothing matters any more.
    fn last(&self) -> f32;
    fn set_last(&mut self, last: f32);
    /// Lower bound of the depth of the nearest hit so far.
    fn nearest(&self) -> f32;
    fn set_nearest(&mut self, nearest: f32);
    /// The nearest hit so far, if it is certain and still to be computed, else [`Candidate::NONE`].
    fn pending(&self) -> Candidate;
    fn set_pending(&mut self, pending: Candidate);
    /// The query; `ray` is what it is made of if that has not happened yet.
    fn query(&mut self, ray: &Ray) -> &mut Q;
    /// Notes that something is certainly hit, which is all that an any-hit query wants.
    fn accept(&mut self);

    /// Takes over what the query has found, and tells whether that is nearer than before.
    #[inline(always)]
    fn take_over(&mut self, ray: &Ray) -> LeafOutcome {
        // Any hit ends the query, and until then nothing changes.
        if Q::ANY {
            return LeafOutcome::Nothing;
        }
        let (before, query) = (self.last(), *self.query(ray));
        self.set_last(self.prepared().slabs.limit(query.limit()));
        self.set_nearest(self.prepared().slabs.nearest(query.found_bounds()));
        if self.last() < before { LeafOutcome::Nearer } else { LeafOutcome::Nothing }
    }
}

/// Tests the triangles of a leaf, which has this code. The ray itself is looked up only where f32 does not decide.
#[inline(always)]
pub(crate) fn enter_leaf<'r, S: Simd, Q: Query, B: TriangleBlock>(
    s: S,
    object: &ObjectView<'_>,
    ray: impl FnOnce() -> &'r Ray,
    progress: &mut impl Progress<Q>,
    (block, code): (&B, u32),
) -> LeafOutcome {
    let prepared = progress.prepared();
    let found = prepared.filter.candidates(s, block, prepared.slabs.first, progress.last());
    if found.maybe == 0 {
        return LeafOutcome::Nothing;
    }
    if Q::ANY {
        if found.sure != 0 {
            progress.accept();
            return LeafOutcome::Done;
        }
        return decide(object, ray(), progress, code, found.maybe);
    }
    let (maybe, certain) = found.nearest_candidates(s);
    if let Some(Certain { triangle, near, far }) = certain
        && far < progress.nearest()
    {
        let place = (block.first() as usize).wrapping_add(triangle);
        s.prefetch(object.triangle_ids.as_ptr().wrapping_add(place));
        progress.set_nearest(near);
        progress.set_pending(Candidate { leaf: code, triangle: triangle as u32 });
        let nearer = far < progress.last();
        progress.set_last(if nearer { far } else { progress.last() });
        return if nearer { LeafOutcome::Nearer } else { LeafOutcome::Nothing };
    }
    decide(object, ray(), progress, code, maybe)
}

/// Decides these triangles of a leaf, a bit each, and with them the pending hit.
#[inline(always)]
pub(crate) fn decide<Q: Query>(
    object: &ObjectView<'_>,
    ray: &Ray,
    progress: &mut impl Progress<Q>,
    code: u32,
    maybe: u32,
) -> LeafOutcome {
    let pending = progress.pending();
    progress.set_pending(Candidate::NONE);
    if settle(object, ray, pending, (code, maybe), progress.query(ray)) {
        return LeafOutcome::Done;
    }
    progress.take_over(ray)
}
