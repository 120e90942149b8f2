//! Secondary any-hit rays of a batch: ambient occlusion and shadows, traced together, each told
//! the surface that it starts on.

use bth::Scene;
use bth::rays::{Ray, Surface};
use glam::DVec3;

/// Distance by which secondary rays start off their surface, relative to the model's diagonal:
/// well above the rounding of a hit point, well below anything seen.
const OFFSET: f64 = 2e-5;

/// A point that secondary rays start from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// World space, already off the surface.
    pub(crate) point: DVec3,
    /// The surface, or none.
    pub(crate) surface: Surface,
}

impl Start {
    /// Just above a surface, on the side of the normal.
    pub(crate) fn above(point: DVec3, normal: DVec3, surface: Surface, diagonal: f64) -> Self {
        // Far from the origin the spacing of f32 is what counts.
        let offset = (OFFSET * diagonal).max(point.abs().max_element() * f64::from(f32::EPSILON) * 4.0);
        Self { point: point + normal * offset, surface }
    }
}

/// Any-hit rays that wait to be traced.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    rays: Vec<Ray>,
    from: Vec<Surface>,
}

impl Queue {
    /// Adds a ray of a certain length in a direction.
    pub(crate) fn push(&mut self, start: Start, direction: DVec3, length: f64) {
        let (origin, direction) = (start.point.as_vec3().to_array(), direction.as_vec3().to_array());
        self.rays.push(Ray { origin, tmin: 0.0, direction, tmax: length as f32 });
        self.from.push(start.surface);
    }

    /// Number of rays.
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether each ray is blocked.
    pub(crate) fn trace(&self, scene: &Scene) -> Vec<bool> {
        let mut blocked = vec![false; self.rays.len()];
        scene.any_batch(&self.rays, Some(&self.from), &mut blocked);
        blocked
    }
}
