//! Rays that start on triangles: at corners, on edges, within, and off the surface.

use bth::rays::{self, PrimitiveRef, Ray, StartRay};
use bth_oracle::Triangle;
use bth_random::Rng;

/// How far origins lie off their triangle, relative to the ray's direction.
const OFF: [f32; 4] = [1e-3, 1e-5, 1e-7, -1e-6];
/// Ends of ranges, relative to the ray's direction.
const TMIN: [f32; 2] = [0.0, 1e-4];

/// A ray with the triangle on which it starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub(super) ray: Ray,
    /// The triangle on which it starts.
    pub(super) triangle: Triangle,
    /// True if it starts exactly at a corner of the triangle, and behind what it touches there.
    pub(super) is_at_corner: bool,
    /// Weights of the point on the triangle.
    uv: [f32; 2],
}

impl Start {
    /// The ray from the exact point of the triangle in an instance.
    pub(super) fn start_ray(&self, instance: u32) -> StartRay {
        let (primitive, [u, v]) = (PrimitiveRef { instance, triangle: self.triangle.id }, self.uv);
        rays::Start { primitive, u, v }.ray(self.ray.direction).with_tmax(self.ray.tmax)
    }
}

/// `count` rays, in part in any direction and in part to corners and edges of other triangles, in
/// part short. First come the rays from corners, then those from edges, and then the others.
pub(super) fn sample(triangles: &[Triangle], count: usize, seed: u64) -> Vec<Start> {
    let mut random = Rng::new(seed);
    let kind = |i: usize| match 4 * i / count {
        0 | 1 => StartKind::Corner,
        2 => StartKind::Edge,
        _ => StartKind::Within,
    };
    (0..count).filter_map(|i| start(triangles, kind(i), i, &mut random)).collect()
}

/// Where a ray starts.
#[derive(Clone, Copy, PartialEq)]
enum StartKind {
    Corner,
    Edge,
    /// Within the triangle, or off it by a share of the way.
    Within,
}

/// A ray; `None` where f32 has no number for it.
fn start(triangles: &[Triangle], kind: StartKind, i: usize, random: &mut Rng) -> Option<Start> {
    let any = |random: &mut Rng| triangles[random.below(triangles.len() as u64) as usize];
    let (triangle, target) = (any(random), any(random));
    let first = random.below(3) as usize;
    let [a, b, c] = [0, 1, 2].map(|k| triangle.corners[(first + k) % 3]);
    let (u, v) = match kind {
        StartKind::Corner => (0.0, 0.0),
        StartKind::Edge => (random.unit_f32(), 0.0),
        StartKind::Within => (0.5 * random.unit_f32(), 0.5 * random.unit_f32()),
    };
    let on_surface: [f32; 3] = std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
    let to = |p: [f32; 3]| -> [f32; 3] { std::array::from_fn(|k| p[k] - on_surface[k]) };
    let direction = match i % 8 {
        0 => to(target.corners[0]),
        1 => to([0, 1, 2].map(|k| 0.5 * target.corners[0][k] + 0.5 * target.corners[1][k])),
        _ => random.unit_vector().map(|x| x as f32),
    };
    let off = if kind == StartKind::Within { OFF[i / 8 % 4] } else { 0.0 };
    let origin = [0, 1, 2].map(|k| on_surface[k] + off * direction[k]);
    // Above zero, so that what is touched at the start does not count.
    let is_at_corner = kind == StartKind::Corner;
    let tmin = if is_at_corner { f32::MIN_POSITIVE } else { TMIN[i / 32 % 2] };
    let tmax = if i / 64 % 4 == 3 { 0.1 } else { f32::INFINITY };
    let ray = Ray { origin, tmin, direction, tmax };
    let numbers = origin.iter().chain(&direction);
    let is_usable = numbers.clone().all(|x| x.is_finite()) && direction != [0.0; 3];
    // The weights of the corners a, b and c.
    let mut weights = [0.0; 3];
    [0, 1, 2].into_iter().zip([1.0 - u - v, u, v]).for_each(|(k, w)| weights[(first + k) % 3] = w);
    let [_, u, v] = weights;
    is_usable.then_some(Start { ray, triangle, is_at_corner, uv: [u, v] })
}
