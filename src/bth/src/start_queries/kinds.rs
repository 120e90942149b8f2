//! What kinds of rays are traced: those with an origin, and those that start on a surface.

// `sealed::Traced` is out of reach for other crates, so its types may be private.
#![allow(private_interfaces)]

use self::sealed::Traced;
use crate::rays::{Hit, Ray, StartRay};
use crate::scene::Scene;
use crate::starts::world_ray::PlacedRay;

/// A ray that can be traced: a [`Ray`], or a [`StartRay`].
pub trait TraceRay: sealed::Traced {}

impl TraceRay for Ray {}
impl TraceRay for StartRay {}

pub(crate) mod sealed {
    use super::{Hit, PlacedRay, Scene};

    /// How rays of a kind are traced.
    pub trait Traced: Copy + Sync {
        /// Stores the nearest hit of a ray, or [`Hit::MISS`].
        fn store_nearest(&self, scene: &Scene, hit: &mut Hit);
        /// Whether a ray hits anything.
        fn any(&self, scene: &Scene) -> bool;
        /// Stores the nearest hit of each ray, or [`Hit::MISS`].
        fn nearest_of(scene: &Scene, rays: &[Self], hits: &mut [Hit]);
        /// Stores for each ray whether it hits anything.
        fn any_of(scene: &Scene, rays: &[Self], found: &mut [bool]);
        /// The ray in the world; `None` if it has no place there.
        fn placed(&self, scene: &Scene) -> Option<PlacedRay>;
    }
}

impl Traced for Ray {
    #[inline(always)]
    fn store_nearest(&self, scene: &Scene, hit: &mut Hit) {
        scene.nearest_of_ray(self, hit);
    }
    #[inline(always)]
    fn any(&self, scene: &Scene) -> bool {
        scene.any_of_ray(self)
    }
    fn nearest_of(scene: &Scene, rays: &[Ray], hits: &mut [Hit]) {
        scene.nearest_hits_of(rays, hits);
    }
    fn any_of(scene: &Scene, rays: &[Ray], found: &mut [bool]) {
        scene.any_hits_of(rays, found);
    }
    fn placed(&self, _scene: &Scene) -> Option<PlacedRay> {
        Some(PlacedRay { ray: *self, start: None })
    }
}

impl Traced for StartRay {
    #[inline(always)]
    fn store_nearest(&self, scene: &Scene, hit: &mut Hit) {
        scene.nearest_of_start(self, hit);
    }
    #[inline(always)]
    fn any(&self, scene: &Scene) -> bool {
        scene.any_of_start(self)
    }
    fn nearest_of(scene: &Scene, rays: &[StartRay], hits: &mut [Hit]) {
        scene.nearest_of_starts(rays, hits);
    }
    fn any_of(scene: &Scene, rays: &[StartRay], found: &mut [bool]) {
        scene.any_of_starts(rays, found);
    }
    fn placed(&self, scene: &Scene) -> Option<PlacedRay> {
        scene.place(self)
    }
}
