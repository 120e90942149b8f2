//! Crossings of surfaces: how often a ray passes through the triangles of a scene.
//!
//! [`mod@crate::intersect::crossing`] is the rule that decides. `points/winding.rs` counts the
//! crossings of rays along an axis faster.

use crate::bvh::enumerate::enumerate;
use crate::enumerate::enumerate_instances;
use crate::intersect::crossing::{crossing, crossing_from_start};
use crate::intersect::start::{ExactStart, start_on};
use crate::intersect::start_point::StartPoint;
use crate::query::{Receiver, TriangleRef};
use crate::rays::Ray;
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;

/// Passages of a ray through triangles, counted by the rule of [`Scene::crossings`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Crossings {
    /// Number of crossings in the ray's range.
    pub count: u32,
    /// Crossings from the back of a triangle to its front minus crossings from the front to the
    /// back. The front is the side from which the vertices are seen counterclockwise, in the space
    /// of the object.
    pub winding: i32,
}

/// Counts the crossings of a ray in object space.
struct CrossingCounter<'a> {
    ray: Ray,
    /// Where it starts, if that is on a triangle of the object.
    start: Option<(&'a StartPoint, &'a ExactStart)>,
    found: Crossings,
}

impl Receiver for CrossingCounter<'_> {
    fn receive(&mut self, _triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        let sign = match self.start {
            None => crossing(&self.ray, corners),
            Some((point, start)) => crossing_from_start(&self.ray, point, start, corners),
        };
        self.found.count += sign.unsigned_abs();
        self.found.winding += sign;
        false
    }
    fn limit(&self) -> f64 {
        f64::INFINITY
    }
}

/// Counts the crossings of a ray in all instances.
pub(super) fn count_crossings(scene: &Scene, world_ray: WorldRay<'_>) -> Crossings {
    let mut total = Crossings::default();
    enumerate_instances(scene, world_ray.ray, &mut |entered| {
        let ray = entered.object_ray(world_ray).with_exact_range(world_ray.ray);
        let start = world_ray.start_in(entered.instance);
        let exact_start = start.and_then(|start| start_on(entered.object, start));
        let start_pair = start.zip(exact_start.as_ref());
        let mut counter = CrossingCounter { ray, start: start_pair, found: Crossings::default() };
        enumerate(entered.object, (&ray, start), &mut counter);
        total.count += counter.found.count;
        total.winding += counter.found.winding;
        Some(f32::INFINITY)
    });
    total
}
