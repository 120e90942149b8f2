//! Queries that report hits under conditions ([`Accept`]): the nearest, any, the k nearest, all in
//! order, and their number; and crossings of surfaces ([`crossings`]).
//!
//! Each query enumerates the instances and the triangles that the conservative f32 tests do not
//! exclude ([`mod@search`]), nearer boxes first. It decides each exactly as the other queries do,
//! and keeps what its collector wants ([`collect`]). So results depend neither on the instruction
//! set nor on the acceleration structures, and t, u and v have the same bits in all queries.
//!
//! These queries trace one ray at a time. Where nothing is excluded, the queries without conditions
//! find the nearest hit and any hit.

mod accept;
mod collect;
mod crossings;
mod search;

pub use accept::{Accept, Cull, Filter};
pub use crossings::Crossings;

use self::collect::{AnyFound, FirstHit, FirstHits, FoundHit, HitCount};
use self::crossings::count_crossings;
use self::search::search;
use crate::masks::Masks;
use crate::rays::Hit;
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;
use crate::trace_ray::TraceRay;
use std::collections::BinaryHeap;

/// Queries for several hits, and with conditions. Hits are ordered by ascending t, then instance,
/// then triangle. Reported t are rounded to f32: among equal ones in one instance, the hit that is
/// nearer before rounding comes first. A closed triangle is hit at most once. A ray through an edge
/// or a vertex hits every triangle at it, so the number of hits on a closed surface may be odd.
impl Scene {
    /// The nearest hit of a ray in world space that is accepted. If everything is accepted, it is
    /// the result of [`Self::nearest`] to the bit.
    pub fn nearest_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> Option<Hit> {
        if self.accepts_everything(accept) {
            return self.nearest(ray);
        }
        self.search_nearest(ray.placed(self)?.world_ray(), accept)
    }

    /// Returns true if a ray in world space has a hit that is accepted.
    pub fn any_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> bool {
        if self.accepts_everything(accept) {
            return self.any(ray);
        }
        ray.placed(self).is_some_and(|placed| self.search_any(placed.world_ray(), accept))
    }

    /// Replaces `hits` by all hits of a ray in world space that are accepted, in order. The time
    /// grows with the number of triangles that the ray passes closely.
    ///
    /// ```
    /// use bth::Accept;
    /// use bth::rays::Ray;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
    /// let mut hits = Vec::new();
    /// scene.all_hits(&ray, &Accept::default(), &mut hits);
    /// assert_eq!(hits.iter().map(|hit| hit.t).collect::<Vec<_>>(), [1.0, 2.0]);
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn all_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        self.append_all(ray, accept, &mut Vec::new(), hits);
    }

    /// Replaces `hits` by the first `k` of the hits that [`Self::all_hits`] returns, or by all if
    /// there are fewer. Nothing beyond is searched.
    pub fn nearest_hits<R: TraceRay>(&self, ray: &R, k: usize, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        self.append_nearest(ray, k, accept, hits);
    }

    /// Counts the hits that [`Self::all_hits`] returns, and stores none.
    pub fn count_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> usize {
        let mut count = HitCount::default();
        if let Some(placed) = ray.placed(self) {
            search(self, placed.world_ray(), accept, &mut count);
        }
        count.0
    }

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

    /// Replaces `hits` by the hits of all rays ([`Self::all_hits`]), one ray after the other, and
    /// `offsets` by one more number than there are rays: the hits of ray i are
    /// `hits[offsets[i]..offsets[i + 1]]`.
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

    /// Does the same as [`Self::all_hits_batch`] with the `k` nearest hits of each ray
    /// ([`Self::nearest_hits`]).
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

    /// Counts the crossings of triangles by a ray in world space. Each passage through a closed
    /// surface counts once.
    ///
    /// Hits are not suited for this: a ray through an edge or a vertex hits all triangles at it,
    /// and a ray in the plane of a triangle does not hit it. Crossings are counted for the ray with
    /// its origin moved by (ε, ε², ε³) in the space of the object, for an infinitely small ε > 0.
    /// This exact rule never hits an edge, a vertex or a plane. So a line crosses a surface
    /// without boundary as often in as out. Of two ranges of t that share an end, `[a, b]` and `[b,
    /// c]`, each crossing is in exactly one: t is compared with the ends exactly, without rounding.
    /// A ray without a line (see [`Scene`]) has no crossings, nor does a ray whose range is empty
    /// or a single t.
    ///
    /// A [`StartRay`](crate::rays::StartRay) counts the crossings of the moved line with a t above
    /// 0 on the line through the start itself, and none of a triangle through the start.
    ///
    /// Each instance is counted in the space of its object, into which the ray is rounded as for
    /// other queries. A mirrored instance keeps its front and back.
    ///
    /// ```
    /// use bth::rays::Ray;
    ///
    /// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
    /// let scene = bth::from_bytes(CUBE)?;
    /// let ray = Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]);
    /// // An even number for a closed model and a ray from outside.
    /// assert_eq!(scene.crossings(&ray).count, 2);
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn crossings<R: TraceRay>(&self, ray: &R) -> Crossings {
        ray.placed(self).map_or_else(Crossings::default, |placed| count_crossings(self, placed.world_ray()))
    }

    /// Stores for each ray the result of [`Self::crossings`].
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn crossings_batch<R: TraceRay>(&self, rays: &[R], crossings: &mut [Crossings]) {
        store_each(rays, crossings, |ray| self.crossings(ray));
    }

    /// Sets the mask of an instance. A ray can hit the instance only if its [`Accept::mask`] and
    /// this mask have a bit in common. At first all bits are set. Queries without [`Accept`] ignore
    /// masks.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn set_instance_mask(&mut self, instance: u32, mask: u32) {
        let count = self.instance_count();
        assert!(instance < count, "expected an instance below {count}, found {instance}");
        self.masks_mut().set_instance(instance, mask);
    }

    /// Sets the mask of a group of triangles of an object, in all its instances. A ray must have a
    /// bit in common with the instance and a bit in common with the group.
    ///
    /// # Panics
    /// If there is no such object, or if it has no such group.
    pub fn set_group_mask(&mut self, object: u32, group: u32, mask: u32) {
        let count = self.group_count(object);
        assert!(group < count, "expected a group below {count}, found {group}");
        self.masks_mut().set_group(object, group, mask);
    }

    /// The mask of an instance; all bits are set unless [`Self::set_instance_mask`] was called.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn instance_mask(&self, instance: u32) -> u32 {
        let count = self.instance_count();
        assert!(instance < count, "expected an instance below {count}, found {instance}");
        self.masks().of_instance(instance)
    }

    /// The mask of a group of triangles of an object; all bits are set unless
    /// [`Self::set_group_mask`] was called.
    ///
    /// # Panics
    /// If there is no such object, or if it has no such group.
    pub fn group_mask(&self, object: u32, group: u32) -> u32 {
        let count = self.group_count(object);
        assert!(group < count, "expected a group below {count}, found {group}");
        self.masks().groups(object).map_or(u32::MAX, |groups| Masks::of_group(groups, group))
    }

    /// Number of groups of an object's triangles, at least 1.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn group_count(&self, object: u32) -> u32 {
        self.object(object).group_count()
    }

    /// Returns true if every hit is accepted.
    pub(crate) fn accepts_everything(&self, accept: &Accept<'_>) -> bool {
        let Accept { mask, cull, filter } = accept;
        self.masks().is_empty() && *mask != 0 && *cull == Cull::None && filter.is_none()
    }

    /// Finds the result of [`Self::nearest_accepted`], always by [`mod@search`].
    pub(crate) fn search_nearest(&self, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<Hit> {
        let mut first = FirstHit::default();
        search(self, ray, accept, &mut first);
        first.0.map(|found| found.hit)
    }

    /// Finds the result of [`Self::any_accepted`], always by [`mod@search`].
    pub(crate) fn search_any(&self, ray: WorldRay<'_>, accept: &Accept<'_>) -> bool {
        let mut any = AnyFound::default();
        search(self, ray, accept, &mut any);
        any.0
    }

    /// Appends all accepted hits of a ray to `hits`, in order. `found` is scratch memory.
    fn append_all<R: TraceRay>(
        &self,
        ray: &R,
        accept: &Accept<'_>,
        found: &mut Vec<FoundHit>,
        hits: &mut Vec<Hit>,
    ) {
        found.clear();
        if let Some(placed) = ray.placed(self) {
            search(self, placed.world_ray(), accept, found);
        }
        // The heap of `append_nearest` sorts these few hits, too, which saves the code of another
        // sort.
        *found = BinaryHeap::from(std::mem::take(found)).into_sorted_vec();
        hits.extend(found.iter().map(|found| found.hit));
    }

    /// Appends the `k` nearest accepted hits of a ray to `hits`, in order.
    fn append_nearest<R: TraceRay>(&self, ray: &R, k: usize, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        if let (1.., Some(placed)) = (k, ray.placed(self)) {
            let mut first = FirstHits { count: k, hits: BinaryHeap::new() };
            search(self, placed.world_ray(), accept, &mut first);
            hits.extend(first.hits.into_sorted_vec().iter().map(|found| found.hit));
        }
    }
}

/// Stores the result of a query for each ray.
fn store_each<R, T>(rays: &[R], results: &mut [T], query: impl Fn(&R) -> T) {
    assert_eq!(rays.len(), results.len(), "as many results as rays");
    for (ray, result) in rays.iter().zip(results) {
        *result = query(ray);
    }
}

/// Replaces `hits` by those that a query appends for each ray, and `offsets` by their first indices
/// and the number of all.
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
