//! Mode path: diffuse path tracing with sun, sky and the scene's lights. Each bounce of all samples of a tile
//! is one batch of rays that know the surface they start on.

use crate::frame::{Frame, Sample, hue};
use crate::lights::Lights;
use crate::occlusion::{Queue, Start};
use crate::sampling::cosine_hemisphere;
use bth::rays::{Hit, Ray, Surface};
use glam::{DVec2, DVec3, Vec3};

/// Reflected share of the light, of most surfaces.
const ALBEDO: Vec3 = Vec3::new(0.68, 0.66, 0.63);
/// Purposes of sample points: this many for each bounce, after those of the camera.
const PURPOSES: u64 = 4;

/// A path that goes on.
struct Path {
    /// Place of the sample.
    sample: usize,
    /// What light from here on is weighed with.
    weight: Vec3,
    origin: DVec3,
    direction: DVec3,
    from: Surface,
}

/// The colours (linear) of a batch of samples.
pub(crate) fn trace(
    frame: &Frame<'_>,
    lights: &Lights,
    samples: &[Sample],
    hits: &[Hit],
    counts: &mut (u64, u64),
) -> Vec<Vec3> {
    let mut colors = vec![Vec3::ZERO; samples.len()];
    let start = |(sample, s): (usize, &Sample)| Path {
        sample,
        weight: Vec3::ONE,
        origin: s.sight.origin,
        direction: s.sight.direction,
        from: Surface::NONE,
    };
    let mut paths: Vec<Path> = samples.iter().enumerate().map(start).collect();
    let mut hits = hits.to_vec();
    for bounce in 0..=frame.bounces() {
        let mut queue = Queue::default();
        let mut gains = Vec::new();
        let mut next = Vec::new();
        for (path, hit) in paths.iter().zip(&hits) {
            if !hit.is_hit() {
                colors[path.sample] += path.weight * lights.sky(path.direction);
                continue;
            }
            let Sample { sampler, index, .. } = samples[path.sample];
            let sample = |purpose: u64| sampler.point(PURPOSES * u64::from(bounce) + 1 + purpose, index);
            let point = path.origin + path.direction * f64::from(hit.t);
            let normal = frame.surfaces.geometric_normal(hit.surface, -path.direction);
            let shading = frame.surfaces.shading_normal(hit, normal);
            let weight = path.weight * albedo(hit.surface);
            let at = Start::above(point, normal, hit.surface, frame.space.diagonal());
            for ray in lights.samples(at.point, sample(0), sample(1)) {
                let facing = shading.dot(ray.direction).min(normal.dot(ray.direction) * 1e3);
                if facing > 0.0 {
                    queue.push(at, ray.direction, ray.distance);
                    gains.push((path.sample, weight * ray.light * facing as f32));
                }
            }
            if bounce < frame.bounces() {
                let direction = away(shading, normal, sample(2));
                next.push(Path {
                    sample: path.sample,
                    weight,
                    origin: at.point,
                    direction,
                    from: hit.surface,
                });
            }
        }
        counts.1 += queue.len() as u64;
        for (&(sample, light), blocked) in gains.iter().zip(queue.trace(frame.scene)) {
            colors[sample] += if blocked { Vec3::ZERO } else { light };
        }
        let ray = |path: &Path| Ray {
            origin: path.origin.as_vec3().to_array(),
            tmin: 0.0,
            direction: path.direction.as_vec3().to_array(),
            tmax: f32::INFINITY,
        };
        let rays: Vec<Ray> = next.iter().map(ray).collect();
        let from: Vec<Surface> = next.iter().map(|path| path.from).collect();
        hits.clear();
        hits.resize(rays.len(), Hit::MISS);
        frame.scene.nearest_batch(&rays, Some(&from), &mut hits);
        counts.0 += rays.len() as u64;
        paths = next;
    }
    colors.into_iter().map(tone).collect()
}

/// A direction about the shading normal, on the side of the geometric one.
fn away(shading: DVec3, normal: DVec3, point: DVec2) -> DVec3 {
    let direction = cosine_hemisphere(shading, point);
    let depth = direction.dot(normal);
    // Mirrored at the surface where it would lead below it.
    if depth >= 0.0 { direction } else { direction - normal * (2.0 * depth) }
}

/// Instances differ in hue, so that they stand apart; the first is plain.
fn albedo(surface: Surface) -> Vec3 {
    match surface.instance {
        0 => ALBEDO,
        instance => ALBEDO.lerp(hue(instance), 0.4),
    }
}

/// Rolls off bright values (Reinhard, extended, white at 4).
fn tone(color: Vec3) -> Vec3 {
    color * (Vec3::ONE + color / 16.0) / (Vec3::ONE + color)
}
