//! Triangles that let rays pass: queries go on behind hits on transparent parts.
//!
//! The nearest hit is found as in scenes where every triangle is opaque. Where it lies on a transparent part, the ray is searched
//! again by the walk of [`mod@crate::hits`], which passes over such hits. Nothing else changes: a hit that is not transparent is the
//! nearest of those that are not, and a ray without any hit has none of them. So scenes without opacity pay for one test in each
//! call, and rays that meet no holes pay for looking up the opacity of their hit.

use crate::hits::Accept;
use crate::rays::{Hit, Ray};
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;
use bth_format::layout::Opacity;

impl Scene {
    /// The opacity of the triangle where a hit lies: [`Opacity::Opaque`] for triangles about which the file says nothing. A hit of
    /// a query is never transparent; where it is unknown, a filter ([`Accept::filter`]) may decide, and without one it counts.
    ///
    /// # Panics
    /// If `hit` is not from this scene.
    pub fn opacity(&self, hit: &Hit) -> Opacity {
        self.view(self.object_of(hit.primitive.instance)).opacity_at(hit.primitive.triangle, hit.u, hit.v)
    }

    /// As `nearest_hits_of`, for a scene with triangles that let rays pass.
    #[cold]
    #[inline(never)]
    pub(crate) fn nearest_not_transparent(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.nearest_of_all(rays, hits);
        for (ray, hit) in rays.iter().zip(hits) {
            self.go_on(WorldRay::plain(ray), hit);
        }
    }

    /// As `any_hits_of`, for a scene with triangles that let rays pass.
    #[cold]
    #[inline(never)]
    pub(crate) fn any_not_transparent(&self, rays: &[Ray], found: &mut [bool]) {
        self.any_of_all(rays, found);
        for (ray, found) in rays.iter().zip(found) {
            *found = *found && self.hits_what_is_not_transparent(WorldRay::plain(ray));
        }
    }

    /// Whether a ray hits anything that is not transparent.
    pub(crate) fn hits_what_is_not_transparent(&self, ray: WorldRay<'_>) -> bool {
        self.search_any(ray, &Accept::default())
    }

    /// Replaces a ray's nearest hit by its nearest one that is not transparent.
    pub(crate) fn go_on(&self, ray: WorldRay<'_>, hit: &mut Hit) {
        if hit.is_hit() && self.opacity(hit) == Opacity::Transparent {
            *hit = self.search_nearest(ray, &Accept::default()).unwrap_or(Hit::MISS);
        }
    }
}
