//! Mode ao: the share of the hemisphere above each hit that is open.

use super::context::{FrameContext, Sample};
use super::occlusion_rays::OcclusionRays;
use crate::sampling::cosine_hemisphere;
use bth::rays::{Hit, StartRay};
use glam::Vec3;

/// Ambient-occlusion rays per sample.
const RAYS: u32 = 4;
/// Dark enough that open surfaces, which are white, stand out.
const BACKGROUND: Vec3 = Vec3::splat(0.14);

/// The colours of a batch of samples.
pub(super) fn shade(
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
