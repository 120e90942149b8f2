//! Mode path: diffuse path tracing with sun, sky and the scene's lights. Each bounce of all samples of a tile is one batch of
//! rays, each with the primitive on which it starts.

use super::context::{Counters, FrameContext, Sample};
use super::lights::Lights;
use super::occlusion_rays::{OcclusionRays, Origin};
use super::surface_colors::instance_color;
use crate::output::reinhard;
use crate::sampling::cosine_hemisphere;
use bth::rays::{Hit, PrimitiveRef, Ray};
use glam::{DVec2, DVec3, Vec3};

/// Albedo of the first instance.
const FIRST_ALBEDO: Vec3 = Vec3::new(0.68, 0.66, 0.63);
/// Dimension pairs of sample points for each bounce, after the one of the camera.
const DIMENSIONS: u64 = 4;

/// A path that has not ended.
struct PathState {
    /// Index of its sample.
    sample: usize,
    /// Product of the albedos along the path.
    throughput: Vec3,
    origin: DVec3,
    direction: DVec3,
    /// The primitive on which the next ray starts.
    from: PrimitiveRef,
}

/// The colours (linear) of a batch of samples.
pub(super) fn shade(
    frame: &FrameContext<'_>,
    lights: &Lights,
    samples: &[Sample],
    hits: &[Hit],
    counters: &mut Counters,
) -> Vec<Vec3> {
    let mut colors = vec![Vec3::ZERO; samples.len()];
    let start = |(sample, s): (usize, &Sample)| PathState {
        sample,
        throughput: Vec3::ONE,
        origin: s.ray.origin,
        direction: s.ray.direction,
        from: PrimitiveRef::NONE,
    };
    let mut paths: Vec<PathState> = samples.iter().enumerate().map(start).collect();
    let mut hits = hits.to_vec();
    for bounce in 0..=frame.args.bounces {
        let mut shadow_rays = OcclusionRays::default();
        let mut contributions = Vec::new();
        let mut next = Vec::new();
        for (path, hit) in paths.iter().zip(&hits) {
            if !hit.is_hit() {
                colors[path.sample] += path.throughput * lights.sky(path.direction);
                continue;
            }
            let Sample { sampler, index, .. } = samples[path.sample];
            let sample =
                |dimension: u64| sampler.point(DIMENSIONS * u64::from(bounce) + 1 + dimension, index);
            let point = path.origin + path.direction * f64::from(hit.t);
            let normal = frame.geometry.geometric_normal(hit.primitive, -path.direction);
            let shading = frame.geometry.shading_normal(hit, normal);
            let throughput = path.throughput * albedo(hit.primitive);
            let origin = Origin::above(point, normal, hit.primitive, frame.bounds.diagonal());
            for light in lights.samples(origin.point, sample(0), sample(1)) {
                // The cosine at the shading normal, faded to 0 where the light goes below the geometric surface.
                let cosine = shading.dot(light.direction).min(normal.dot(light.direction) * 1e3);
                if cosine > 0.0 {
                    shadow_rays.push(origin, light.direction, light.distance);
                    contributions.push((path.sample, throughput * light.light * cosine as f32));
                }
            }
            if bounce < frame.args.bounces {
                let direction = scattered(shading, normal, sample(2));
                next.push(PathState {
                    sample: path.sample,
                    throughput,
                    origin: origin.point,
                    direction,
                    from: hit.primitive,
                });
            }
        }
        counters.any_rays += shadow_rays.len() as u64;
        for (&(sample, light), blocked) in contributions.iter().zip(shadow_rays.trace(frame.scene)) {
            colors[sample] += if blocked { Vec3::ZERO } else { light };
        }
        let ray = |path: &PathState| Ray {
            origin: path.origin.as_vec3().to_array(),
            tmin: 0.0,
            direction: path.direction.as_vec3().to_array(),
            tmax: f32::INFINITY,
        };
        let rays: Vec<Ray> = next.iter().map(ray).collect();
        let from: Vec<PrimitiveRef> = next.iter().map(|path| path.from).collect();
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        frame.scene.batch(&rays).from(&from[..]).nearest(&mut hits);
        counters.nearest_rays += rays.len() as u64;
        paths = next;
    }
    colors.into_iter().map(reinhard).collect()
}

/// A cosine-distributed direction around the shading normal, on the side of the geometric one.
fn scattered(shading: DVec3, normal: DVec3, point: DVec2) -> DVec3 {
    let direction = cosine_hemisphere(shading, point);
    let depth = direction.dot(normal);
    // A direction below the geometric surface is mirrored at it.
    if depth >= 0.0 { direction } else { direction - normal * (2.0 * depth) }
}

/// The albedo of a hit. Instances differ in hue, so that they can be told apart; the first is neutral.
fn albedo(primitive: PrimitiveRef) -> Vec3 {
    match primitive.instance {
        0 => FIRST_ALBEDO,
        instance => FIRST_ALBEDO.lerp(instance_color(instance), 0.4),
    }
}
