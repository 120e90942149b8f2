//! Queries that report hits under conditions ([`Accept`]): the nearest, any, the k nearest, all in order, and their number.
//!
//! Each query enumerates the instances and the triangles that the conservative f32 tests do not exclude ([`mod@search`]), nearer boxes
//! first, decides each exactly as the other queries do, and keeps what its collector wants ([`collect`]). Results therefore depend
//! neither on the instruction set nor on the acceleration structures, and t, u and v have the same bits in all queries.
//!
//! These queries are traced one ray at a time. Where nothing is excluded, the nearest hit and any hit are left to the queries
//! without conditions.

mod accept;
mod batch;
mod collect;
mod search;

pub use accept::{Accept, Cull, Filter};

use self::collect::{Any, Count, First, FirstOf, Found};
use self::search::search;
use crate::masks::Masks;
use crate::rays::Hit;
use crate::scene::Scene;
use crate::start_queries::TraceRay;
use crate::starts::world_ray::WorldRay;
use std::collections::BinaryHeap;

/// Queries for several hits, and with conditions. Hits are ordered by ascending t, then instance, then triangle. More precisely, as
/// t is rounded to f32 when it is reported: among hits of equal reported t in one instance, those that are nearer before that
/// rounding come first. A closed triangle is hit at most once. A ray through an edge or a vertex hits every triangle to which the
/// edge or vertex belongs, so the number of hits on a closed surface may be odd.
impl Scene {
    /// The nearest hit of a ray in world space that is accepted; among equal t as for [`Self::nearest`], whose result it has to
    /// the bit if everything is accepted.
    pub fn nearest_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> Option<Hit> {
        if self.accepts_everything(accept) {
            return self.nearest(ray);
        }
        self.search_nearest(ray.placed(self)?.world_ray(), accept)
    }

    /// Whether a ray in world space has a hit that is accepted.
    pub fn any_accepted<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> bool {
        if self.accepts_everything(accept) {
            return self.any(ray);
        }
        ray.placed(self).is_some_and(|placed| self.search_any(placed.world_ray(), accept))
    }

    /// Replaces `hits` by all hits of a ray in world space that are accepted, in order. The time grows with the number of triangles
    /// that the ray passes close by.
    ///
    /// ```no_run
    /// use bth::Accept;
    /// use bth::rays::Ray;
    ///
    /// let scene = bth::open("bunny.bth")?;
    /// let ray = Ray::new([0.0, 0.1, 1.0], [0.0, 0.0, -1.0]);
    /// let mut hits = Vec::new();
    /// scene.all_hits(&ray, &Accept::default(), &mut hits);
    /// for hit in &hits {
    ///     println!("triangle {} at t = {}", hit.primitive.triangle, hit.t);
    /// }
    /// # Ok::<(), bth::Error>(())
    /// ```
    pub fn all_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        self.append_all(ray, accept, &mut Vec::new(), hits);
    }

    /// Replaces `hits` by the first `k` of the hits that [`Self::all_hits`] returns, or by all if there are fewer. What lies
    /// beyond is not searched.
    pub fn nearest_hits<R: TraceRay>(&self, ray: &R, k: usize, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        hits.clear();
        self.append_nearest(ray, k, accept, hits);
    }

    /// Number of the hits that [`Self::all_hits`] returns. They are not stored.
    pub fn count_hits<R: TraceRay>(&self, ray: &R, accept: &Accept<'_>) -> usize {
        let mut count = Count::default();
        if let Some(placed) = ray.placed(self) {
            search(self, placed.world_ray(), accept, &mut count);
        }
        count.0
    }

    /// Sets the mask of an instance: a ray meets the instance only if its [`Accept::mask`] and this mask have a bit in common.
    /// Masks have all bits set unless this was called. Queries without [`Accept`] ignore them.
    ///
    /// # Panics
    /// If there is no such instance.
    pub fn set_instance_mask(&mut self, instance: u32, mask: u32) {
        let count = self.instance_count();
        assert!(instance < count, "expected an instance below {count}, found {instance}");
        self.masks_mut().set_instance(instance, mask);
    }

    /// As [`Self::set_instance_mask`], for a group of triangles of an object, in all its instances. A ray must have a bit in
    /// common with the instance and a bit in common with the group.
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

    /// The mask of a group of triangles of an object; all bits are set unless [`Self::set_group_mask`] was called.
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

    /// Whether every hit is accepted.
    pub(crate) fn accepts_everything(&self, accept: &Accept<'_>) -> bool {
        let Accept { mask, cull, filter } = accept;
        self.masks().is_empty() && *mask != 0 && *cull == Cull::None && filter.is_none()
    }

    /// As [`Self::nearest_accepted`], always by [`mod@search`].
    pub(crate) fn search_nearest(&self, ray: WorldRay<'_>, accept: &Accept<'_>) -> Option<Hit> {
        let mut first = First::default();
        search(self, ray, accept, &mut first);
        first.0.map(|found| found.hit)
    }

    /// As [`Self::any_accepted`], always by [`mod@search`].
    pub(crate) fn search_any(&self, ray: WorldRay<'_>, accept: &Accept<'_>) -> bool {
        let mut any = Any::default();
        search(self, ray, accept, &mut any);
        any.0
    }

    /// Appends all accepted hits of a ray to `hits`, in order. `found` is scratch memory.
    fn append_all<R: TraceRay>(
        &self,
        ray: &R,
        accept: &Accept<'_>,
        found: &mut Vec<Found>,
        hits: &mut Vec<Hit>,
    ) {
        found.clear();
        if let Some(placed) = ray.placed(self) {
            search(self, placed.world_ray(), accept, found);
        }
        // The heap of `append_nearest` sorts these few hits, too, so that there is no code of another sort for them.
        *found = BinaryHeap::from(std::mem::take(found)).into_sorted_vec();
        hits.extend(found.iter().map(|found| found.hit));
    }

    /// Appends the `k` nearest accepted hits of a ray to `hits`, in order.
    fn append_nearest<R: TraceRay>(&self, ray: &R, k: usize, accept: &Accept<'_>, hits: &mut Vec<Hit>) {
        if let (1.., Some(placed)) = (k, ray.placed(self)) {
            let mut first = FirstOf { count: k, hits: BinaryHeap::new() };
            search(self, placed.world_ray(), accept, &mut first);
            hits.extend(first.hits.into_sorted_vec().iter().map(|found| found.hit));
        }
    }
}
