//! The surface at a hit: its normals, and how it looks.

use super::bsdf::Bsdf;
use super::context::FrameContext;
use super::surface_modes::instance_color;
use crate::materials::Look;
use bth::rays::{Hit, PrimitiveRef};
use glam::{DVec3, Vec3};

/// Albedo of what has no material.
const CLAY: Vec3 = Vec3::new(0.56, 0.52, 0.47);
/// Albedo of the ground.
pub(super) const GROUND: Vec3 = Vec3::splat(0.58);

/// The surface at a hit, seen along a ray.
pub(super) struct Surface {
    /// Radiance, towards wherever the ray comes from.
    pub(super) emitted: Vec3,
    /// The share of light from all around that reaches it, by the material.
    pub(super) occlusion: f32,
    /// The normal of its triangle, on the side of the viewer.
    pub(super) geometric: DVec3,
    /// `None` where it scatters no light.
    pub(super) bsdf: Option<Bsdf>,
}

impl Surface {
    /// The surface at a hit of a ray in a unit direction.
    pub(super) fn of(frame: &FrameContext<'_>, hit: &Hit, direction: DVec3) -> Self {
        let geometric = frame.geometry.geometric_normal(hit.primitive, -direction);
        let look = frame.materials.look(frame.scene, frame.geometry.object(hit.primitive), hit);
        let look = look.unwrap_or_else(|| Look::matte(clay(frame, hit.primitive)));
        let Look { base_color, emissive, unlit, gloss, occlusion, .. } = look;
        if unlit {
            return Self { emitted: base_color + emissive, occlusion, geometric, bsdf: None };
        }
        let normal = frame.shading_normal(hit, geometric, &look);
        // More than all light is never scattered.
        let bsdf = Bsdf::new(normal, -direction, base_color.min(Vec3::ONE), gloss);
        let bsdf = (bsdf.albedo() != Vec3::ZERO).then_some(bsdf);
        Self { emitted: emissive, occlusion, geometric, bsdf }
    }

    /// The ground, where `share` of it is seen before a background.
    pub(super) fn ground(normal: DVec3, direction: DVec3, share: f32, background: Vec3) -> Self {
        let bsdf = Bsdf::new(normal, -direction, GROUND * share, None);
        Self { emitted: background * (1.0 - share), occlusion: 1.0, geometric: normal, bsdf: Some(bsdf) }
    }

    /// For a unit direction to a light the cosine with the normal and what softens the edge of the
    /// shadow where the triangle turns away, which smooth normals would make hard: Chiang, Li and
    /// Burley, "Taming the Shadow Terminator" (2019).
    pub(super) fn softened(geometric: DVec3, normal: DVec3, to_light: DVec3) -> f64 {
        let [flat, smooth, between] = [geometric.dot(to_light), normal.dot(to_light), geometric.dot(normal)];
        if flat <= 0.0 || smooth <= 0.0 || between <= 0.0 {
            return 0.0;
        }
        let share = (flat / (smooth * between)).min(1.0);
        share + share * share - share * share * share
    }
}

/// The albedo of what has no material. In a file without any, instances differ in hue, so that they
/// can be told apart; the first is neutral.
fn clay(frame: &FrameContext<'_>, primitive: PrimitiveRef) -> Vec3 {
    match primitive.instance {
        0 => CLAY,
        _ if !frame.materials.is_empty() => CLAY,
        instance => CLAY.lerp(instance_color(instance), 0.4) * 0.75,
    }
}
