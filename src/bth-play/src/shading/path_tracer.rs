//! Mode path: diffuse path tracing with the scene's lights, sun and sky, or surroundings. Each
//! bounce of all samples of a tile is one batch of rays, which start at the hits of the last one.

use super::context::{Counters, FrameContext, Sample};
use super::lights::{LightSample, Lights};
use super::surface_modes::instance_color;
use super::visibility;
use super::visibility::OcclusionRays;
use crate::materials::Look;
use crate::sampling::cosine_hemisphere;
use bth::rays::{Hit, PrimitiveRef, Start, StartRay};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Albedo of what has no material.
const CLAY_ALBEDO: Vec3 = Vec3::new(0.68, 0.66, 0.63);
/// Dimension pairs of sample points for each bounce, after the one of the camera.
const DIMENSIONS: u64 = 4;
/// Numbers of rays for each bounce, for [`Sample::chance`].
const RAYS: u64 = 1 << 20;

/// A path that has not ended.
struct PathState {
    /// Index of its sample.
    sample: usize,
    /// Product of the albedos along the path.
    throughput: Vec3,
    /// Where its next ray starts: the point, and the same as a point of a triangle.
    origin: DVec3,
    start: Start,
    direction: DVec3,
    /// Density with which its direction was chosen, with regard to solid angle; `None` for rays of
    /// the camera.
    density: Option<f64>,
}

/// The colours (linear) of a batch of samples.
pub(super) fn shade(
    frame: &FrameContext<'_>,
    lights: &Lights<'_>,
    samples: &[Sample],
    hits: &[Hit],
    counters: &mut Counters,
) -> Vec<Vec3> {
    let mut colors = vec![Vec3::ZERO; samples.len()];
    let start = |(sample, s): (usize, &Sample)| PathState {
        sample,
        throughput: Vec3::ONE,
        origin: s.ray.origin,
        start: Start::NONE,
        direction: s.ray.direction,
        density: None,
    };
    let mut paths: Vec<PathState> = samples.iter().enumerate().map(start).collect();
    let mut hits = hits.to_vec();
    for number in 0..=frame.args.bounces() {
        let mut bounce = Bounce::new(frame, lights, samples, number);
        for (path, hit) in paths.iter().zip(&hits) {
            colors[path.sample] += path.throughput * bounce.meet(path, hit);
        }
        let Bounce { shadow_rays, contributions, next, .. } = bounce;
        counters.any_rays += shadow_rays.len() as u64;
        for (&(sample, light), blocked) in contributions.iter().zip(shadow_rays.trace(frame)) {
            colors[sample] += if blocked { Vec3::ZERO } else { light };
        }
        hits = trace(frame, &next, samples, number);
        counters.nearest_rays += hits.len() as u64;
        paths = next;
    }
    colors
}

/// Traces the paths of a batch after bounce `number`. Returns their hits.
fn trace(frame: &FrameContext<'_>, paths: &[PathState], samples: &[Sample], number: u32) -> Vec<Hit> {
    let ray = |path: &PathState| path.start.ray(path.direction.as_vec3().to_array());
    let rays: Vec<StartRay> = paths.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    let chance = |row: usize| samples[paths[row].sample].chance(RAYS * (u64::from(number) + 1));
    visibility::nearest(frame, &rays, None, chance, &mut hits);
    hits
}

/// The work of one bounce of a batch.
struct Bounce<'a> {
    frame: &'a FrameContext<'a>,
    lights: &'a Lights<'a>,
    samples: &'a [Sample],
    number: u32,
    shadow_rays: OcclusionRays<StartRay>,
    /// For each shadow ray its sample, and the light that it brings if it is not blocked.
    contributions: Vec<(usize, Vec3)>,
    /// Paths that go on.
    next: Vec<PathState>,
}

impl<'a> Bounce<'a> {
    fn new(frame: &'a FrameContext<'a>, lights: &'a Lights<'a>, samples: &'a [Sample], number: u32) -> Self {
        let (shadow_rays, contributions) = (OcclusionRays::new(), Vec::new());
        Self { frame, lights, samples, number, shadow_rays, contributions, next: Vec::new() }
    }

    /// Adds the shadow rays and the next ray of a path that hits a surface. Returns the radiance
    /// that it finds there, or in the surroundings.
    fn meet(&mut self, path: &PathState, hit: &Hit) -> Vec3 {
        let Self { frame, lights, number, .. } = *self;
        if !hit.is_hit() {
            return lights.sky(path.direction) * share(path.density, lights.density(path.direction));
        }
        let surface = Surface::of(frame, hit);
        if surface.albedo == Vec3::ZERO {
            return surface.emitted;
        }
        let Sample { sampler, index, .. } = self.samples[path.sample];
        let sample = |dimension: u64| sampler.point(DIMENSIONS * u64::from(number) + 1 + dimension, index);
        let point = path.origin + path.direction * f64::from(hit.t);
        let normal = frame.geometry.geometric_normal(hit.primitive, -path.direction);
        let shading = frame.geometry.shading_normal(hit, normal);
        let throughput = path.throughput * surface.albedo;
        let last = number == frame.args.bounces();
        let surroundings = lights.surroundings(sample(3)).map(|(light, density)| {
            // A path that goes on may find the surroundings by itself.
            let scattered = if last { 0.0 } else { shading.dot(light.direction).max(0.0) / PI };
            LightSample { light: light.light * share(Some(density), scattered), ..light }
        });
        let of_scene = lights.samples(point, sample(0), sample(1));
        for (ray, light) in of_scene.chain(surroundings).enumerate() {
            // The cosine at the shading normal, faded to 0 where the light goes below the geometric
            // surface.
            let cosine = shading.dot(light.direction).min(normal.dot(light.direction) * 1e3);
            if cosine > 0.0 {
                let chance = self.samples[path.sample].chance(RAYS * u64::from(number) + 1 + ray as u64);
                let direction = light.direction.as_vec3().to_array();
                let ray = StartRay::from_hit(hit, direction).with_tmax(light.distance as f32);
                self.shadow_rays.push(ray, chance);
                self.contributions.push((path.sample, throughput * light.light * cosine as f32));
            }
        }
        if !last {
            let direction = scattered(shading, normal, sample(2));
            let density = Some(shading.dot(direction).max(0.0) / PI);
            let (sample, origin, start) = (path.sample, point, hit.start());
            self.next.push(PathState { sample, throughput, origin, start, direction, density });
        }
        surface.emitted
    }
}

/// A cosine-distributed direction around the shading normal, on the side of the geometric one.
fn scattered(shading: DVec3, normal: DVec3, point: DVec2) -> DVec3 {
    let direction = cosine_hemisphere(shading, point);
    let depth = direction.dot(normal);
    // A direction below the geometric surface is mirrored at it.
    if depth >= 0.0 { direction } else { direction - normal * (2.0 * depth) }
}

/// The share of light from the surroundings that is taken of a direction chosen with a density, if
/// another way to choose it has the density `other` (the balance heuristic; Veach and Guibas,
/// "Optimally combining sampling techniques for Monte Carlo rendering", 1995). All of it where
/// there is no choice.
fn share(chosen: Option<f64>, other: f64) -> f32 {
    match chosen {
        Some(chosen) if other > 0.0 => (chosen / (chosen + other)) as f32,
        _ => 1.0,
    }
}

/// How a path hits a surface.
struct Surface {
    /// Radiance, towards wherever the path comes from.
    emitted: Vec3,
    /// Share of light that is scattered.
    albedo: Vec3,
}

impl Surface {
    fn of(frame: &FrameContext<'_>, hit: &Hit) -> Self {
        let (emitted, albedo) =
            match frame.materials.look(frame.scene, frame.geometry.object(hit.primitive), hit) {
                Some(Look { base_color, emissive, unlit: true }) => (base_color + emissive, Vec3::ZERO),
                // More than all light is never scattered.
                Some(Look { base_color, emissive, .. }) => (emissive, base_color.min(Vec3::ONE)),
                None if frame.materials.is_empty() => (Vec3::ZERO, instance_albedo(hit.primitive)),
                None => (Vec3::ZERO, CLAY_ALBEDO),
            };
        Self { emitted, albedo }
    }
}

/// The albedo of an instance in a file without materials. Instances differ in hue, so that they can
/// be told apart; the first is neutral.
fn instance_albedo(primitive: PrimitiveRef) -> Vec3 {
    match primitive.instance {
        0 => CLAY_ALBEDO,
        instance => CLAY_ALBEDO.lerp(instance_color(instance), 0.4),
    }
}
