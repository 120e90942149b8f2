//! Crossings of surfaces: how often a ray passes through the triangles of a scene.
//!
//! [`mod@crate::intersect::crossing`] is the rule that decides. `points/winding.rs` counts the
//! crossings of rays along an axis faster.

use crate::bvh::enumerate::enumerate;
use crate::enumerate::enumerate_instances;
use crate::intersect::crossing::{crossing, crossing_from_start, crossing_in_world};
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::start::start_on;
use crate::query::{Receiver, TriangleRef};
use crate::rays::Ray;
use crate::scene::Scene;
use crate::starts::world_ray::WorldRay;
use bth_format::object::ObjectView;

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
    object: &'a ObjectView<'a>,
    ray: ExactRay<'a>,
    /// The range of t, in the units of the ray.
    range: [f64; 2],
    found: Crossings,
}

impl Receiver for CrossingCounter<'_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        let ExactRay { ray, line, .. } = self.ray;
        let sign = match line {
            LineSource::Ray => crossing(ray, corners),
            LineSource::Start(point) => start_on(self.object, point)
                .map_or(0, |start| crossing_from_start(ray, point, &start, corners)),
            LineSource::World(lines, ray) => {
                let corners = self.object.exact_corners(|| triangle.read(), corners);
                crossing_in_world((lines, ray), self.range, corners)
            }
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
    let (mut total, Ray { tmax, .. }) = (Crossings::default(), *world_ray.ray);
    enumerate_instances(scene, (world_ray.ray, &|| world_ray.rounded_line()), &mut |entered| {
        let of_instance = entered.ray(world_ray, tmax);
        let t_scale = f64::from(of_instance.t_scale());
        let mut counter = CrossingCounter {
            object: entered.object,
            ray: of_instance.exact(),
            range: world_ray.range().map(|t| t / t_scale),
            found: Crossings::default(),
        };
        enumerate(entered.object, counter.ray, &mut counter);
        total.count += counter.found.count;
        total.winding += counter.found.winding;
        Some(f32::INFINITY)
    });
    total
}
