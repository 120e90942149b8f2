//! Triangles that let rays pass: queries go on behind hits on transparent parts.
//!
//! The nearest hit is found as in scenes where every triangle is opaque. Where it lies on a
//! transparent part, the ray is searched again by the walk of [`mod@crate::hits`], which passes
//! over such hits. Nothing else changes: a nearest hit that is opaque is the nearest opaque hit,
//! and a ray without any hit has no opaque hit either. So scenes without opacity pay for one test
//! in each call, and rays that reach no holes pay for looking up the opacity of their hit.

use crate::rays::Hit;
use crate::scene::Scene;
use bth_format::layout::Opacity;

impl Scene {
    /// The opacity of the triangle where a hit lies: [`Opacity::Opaque`] for triangles about which
    /// the file says nothing. A hit of a query is never transparent; where it is unknown, a filter
    /// ([`Accept::filter`](crate::Accept::filter)) may decide, and without one it counts.
    ///
    /// # Panics
    /// If `hit` is not from this scene.
    pub fn opacity(&self, hit: &Hit) -> Opacity {
        self.view(self.object_of(hit.primitive.instance)).opacity_at(hit.primitive.triangle, hit.u, hit.v)
    }
}
