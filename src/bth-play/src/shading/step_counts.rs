//! Mode steps: how many traversal steps each camera ray takes.

use super::context::Steps;
use bth::Scene;
use bth::rays::Ray;
use glam::Vec3;

/// The steps of each ray, nodes, leaves and tetrahedra together, as the first component of its colour.
pub(super) fn shade(scene: &Scene, rays: &[Ray], total: &mut Steps) -> Vec<Vec3> {
    let count = |ray: &Ray| {
        let (_, steps) = scene.nearest_counted(ray);
        total.nodes += f64::from(steps.nodes);
        total.leaves += f64::from(steps.leaves);
        total.triangles += f64::from(steps.triangles);
        total.tets += f64::from(steps.tets);
        Vec3::X * (steps.nodes + steps.leaves + steps.tets) as f32
    };
    rays.iter().map(count).collect()
}
