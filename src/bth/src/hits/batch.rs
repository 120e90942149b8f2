//! Batches of the queries for several hits and with conditions. Results are those of the same queries of single rays, to the bit.

use super::accept::Accept;
use crate::rays::Hit;
use crate::scene::Scene;
use crate::start_queries::TraceRay;

/// Batches of queries. Rays are in world space.
impl Scene {
    /// Stores for each ray the result of [`Self::nearest_accepted`], or [`Hit::MISS`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn nearest_accepted_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, hits: &mut [Hit]) {
        if self.accepts_everything(accept) {
            return self.batch(rays).nearest(hits);
        }
        store_each(rays, hits, |ray| self.nearest_accepted(ray, accept).unwrap_or(Hit::MISS));
    }

    /// Stores for each ray the result of [`Self::any_accepted`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn any_accepted_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, found: &mut [bool]) {
        if self.accepts_everything(accept) {
            return self.batch(rays).any(found);
        }
        store_each(rays, found, |ray| self.any_accepted(ray, accept));
    }

    /// Stores for each ray the result of [`Self::count_hits`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn count_hits_batch<R: TraceRay>(&self, rays: &[R], accept: &Accept<'_>, counts: &mut [usize]) {
        store_each(rays, counts, |ray| self.count_hits(ray, accept));
    }

    /// Replaces `hits` by the hits of [`Self::all_hits`] of the first ray, of the second, and so on, and `offsets` by one more
    /// number than there are rays: the hits of ray i are `hits[offsets[i]..offsets[i + 1]]`.
    pub fn all_hits_batch<R: TraceRay>(
        &self,
        rays: &[R],
        accept: &Accept<'_>,
        offsets: &mut Vec<usize>,
        hits: &mut Vec<Hit>,
    ) {
        let mut found = Vec::new();
        append_each(rays, offsets, hits, |ray, hits| self.append_all(ray, accept, &mut found, hits));
    }

    /// As [`Self::all_hits_batch`], with the `k` nearest hits of each ray ([`Self::nearest_hits`]).
    pub fn nearest_hits_batch<R: TraceRay>(
        &self,
        rays: &[R],
        k: usize,
        accept: &Accept<'_>,
        offsets: &mut Vec<usize>,
        hits: &mut Vec<Hit>,
    ) {
        append_each(rays, offsets, hits, |ray, hits| self.append_nearest(ray, k, accept, hits));
    }
}

/// Stores the result of a query for each ray.
fn store_each<R, T>(rays: &[R], results: &mut [T], query: impl Fn(&R) -> T) {
    assert_eq!(rays.len(), results.len(), "as many results as rays");
    for (ray, result) in rays.iter().zip(results) {
        *result = query(ray);
    }
}

/// Replaces `hits` by those that a query appends for each ray, and `offsets` by their first indices and the number of all.
fn append_each<R>(
    rays: &[R],
    offsets: &mut Vec<usize>,
    hits: &mut Vec<Hit>,
    mut query: impl FnMut(&R, &mut Vec<Hit>),
) {
    hits.clear();
    offsets.clear();
    offsets.reserve(rays.len() + 1);
    offsets.push(0);
    for ray in rays {
        query(ray, hits);
        offsets.push(hits.len());
    }
}
