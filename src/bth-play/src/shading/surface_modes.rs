//! Modes whose colours depend on the first hit alone: normals, instances, ambient occlusion and
//! steps.

use super::context::{FrameContext, Sample};
use super::visibility::OcclusionRays;
use crate::sampling::cosine_hemisphere;
use bth::Scene;
use bth::rays::{Hit, Ray, StartRay};
use glam::{DVec4, Vec3};

/// Shading normals as colours: -1 to 1 of each component becomes 0 to 1.
pub(super) fn normals(frame: &FrameContext<'_>, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
    let color = |(sample, hit): (&Sample, &Hit)| {
        if !hit.is_hit() {
            return Vec3::splat(0.09);
        }
        let normal = frame.geometry.shading_normal(hit, frame.point_and_normal(sample, hit).1);
        (normal * 0.5 + 0.5).as_vec3()
    };
    samples.iter().zip(hits).map(color).collect()
}

/// Each instance in a different colour, darker where the surface turns away from the camera.
pub(super) fn instances(frame: &FrameContext<'_>, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
    let color = |(sample, hit): (&Sample, &Hit)| {
        if !hit.is_hit() {
            return Vec3::splat(0.02);
        }
        let (_, normal) = frame.point_and_normal(sample, hit);
        let facing = normal.dot(-sample.ray.direction) as f32;
        instance_color(hit.primitive.instance) * (0.25 + 0.75 * facing)
    };
    samples.iter().zip(hits).map(color).collect()
}

/// The linear colour of an instance. The hues of successive numbers are far apart (multiples of the
/// golden ratio).
pub(super) fn instance_color(number: u32) -> Vec3 {
    let angle = (f64::from(number) * 0.618_033_988_749_895).fract() as f32 * std::f32::consts::TAU;
    let third = std::f32::consts::TAU / 3.0;
    let wave = |shift: f32| (0.5 + 0.5 * (angle - shift).cos()).powf(1.5);
    Vec3::new(wave(0.0), wave(third), wave(2.0 * third)) * 0.8 + 0.06
}

/// Ambient-occlusion rays per sample.
const RAYS: u32 = 4;
/// Dark enough to contrast with open surfaces, which are white.
const BACKGROUND: Vec3 = Vec3::splat(0.14);

/// Returns the share of the hemisphere above each hit that is open, as grey.
pub(super) fn ambient_occlusion(
    frame: &FrameContext<'_>,
    samples: &[Sample],
    hits: &[Hit],
    any_rays: &mut u64,
) -> Vec<Vec3> {
    let mut rays = OcclusionRays::new();
    for (sample, hit) in samples.iter().zip(hits).filter(|(_, hit)| hit.is_hit()) {
        let (_, normal) = frame.point_and_normal(sample, hit);
        for ray in 0..RAYS {
            let at = sample.sampler.point(1, sample.index * RAYS + ray);
            let chance = sample.chance(1 + u64::from(ray));
            let direction = cosine_hemisphere(normal, at).as_vec3().to_array();
            let ray = StartRay::from_hit(hit, direction).with_tmax(frame.occlusion_distance as f32);
            rays.push(ray, chance);
        }
    }
    *any_rays += rays.len() as u64;
    let blocked = rays.trace(frame);
    let mut of_hits = blocked.chunks(RAYS as usize);
    let color = |hit: &Hit| {
        if !hit.is_hit() {
            return BACKGROUND;
        }
        let open = of_hits.next().map_or(0, |chunk| chunk.iter().filter(|b| !**b).count());
        Vec3::splat(0.9 * open as f32 / RAYS as f32)
    };
    hits.iter().map(color).collect()
}

/// The steps of each ray, nodes, leaves and tetrahedra together, as the first component of its
/// colour.
pub(super) fn steps(scene: &Scene, rays: &[Ray], total: &mut DVec4) -> Vec<Vec3> {
    let count = |ray: &Ray| {
        let (_, steps) = scene.nearest_counted(ray);
        *total += DVec4::from_array([steps.nodes, steps.leaves, steps.triangles, steps.cells].map(f64::from));
        Vec3::X * (steps.nodes + steps.leaves + steps.cells) as f32
    };
    rays.iter().map(count).collect()
}
