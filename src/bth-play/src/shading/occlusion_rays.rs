//! Shadow and ambient-occlusion rays: any-hit rays of a batch of samples, traced together, each with the primitive on which
//! it starts.

use super::chance::Chance;
use super::context::FrameContext;
use super::visibility;
use bth::rays::{PrimitiveRef, Ray};
use glam::DVec3;

/// Distance from the primitive at which secondary rays start, relative to the diagonal of the scene: well above the
/// rounding of a hit point, and too small to be seen.
const OFFSET: f64 = 2e-5;

/// Where secondary rays start.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin {
    /// World space, already moved off the primitive.
    pub(crate) point: DVec3,
    /// The primitive that it lies on, or none.
    pub(crate) primitive: PrimitiveRef,
}

impl Origin {
    /// Just above a primitive, on the side of the normal.
    pub(crate) fn above(point: DVec3, normal: DVec3, primitive: PrimitiveRef, diagonal: f64) -> Self {
        // Far from the origin of the world the spacing of f32 numbers exceeds the relative offset.
        let offset = (OFFSET * diagonal).max(point.abs().max_element() * f64::from(f32::EPSILON) * 4.0);
        Self { point: point + normal * offset, primitive }
    }
}

/// A batch of any-hit rays.
#[derive(Debug, Default)]
pub(crate) struct OcclusionRays {
    rays: Vec<Ray>,
    from: Vec<PrimitiveRef>,
    chances: Vec<Chance>,
}

impl OcclusionRays {
    /// Adds a ray of a length, in world units, along a unit direction.
    pub(crate) fn push(&mut self, origin: Origin, direction: DVec3, length: f64, chance: Chance) {
        let direction = direction.as_vec3().to_array();
        let point = origin.point.as_vec3().to_array();
        self.rays.push(Ray { origin: point, tmin: 0.0, direction, tmax: length as f32 });
        self.from.push(origin.primitive);
        self.chances.push(chance);
    }

    /// Number of rays.
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether each ray is blocked.
    pub(crate) fn trace(&self, frame: &FrameContext<'_>) -> Vec<bool> {
        let mut blocked = vec![false; self.rays.len()];
        visibility::any(frame, (&self.rays, &self.from), &self.chances, &mut blocked);
        blocked
    }
}
