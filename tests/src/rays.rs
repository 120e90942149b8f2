//! Rays for tests, including those for which ray tracers tend to miss hits.

use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_random::Rng;

fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// Rays of every kind: through the model, exactly through vertices and edge midpoints, along axes and
/// in the planes of faces, from vertices, with ranges that end about hits, with tiny and huge directions.
pub fn assorted(corners: &[[[f32; 3]; 3]], count: usize, seed: u64) -> Vec<Ray> {
    let mut rng = Rng::new(seed);
    let bound = |pick: fn(f32, f32) -> f32, start: f32| {
        [0, 1, 2].map(|k| corners.iter().flatten().map(|p| p[k]).fold(start, pick))
    };
    let (lower, upper) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
    let extent = sub(upper, lower);
    let size = extent.into_iter().fold(0.0, f32::max);
    (0..count)
        .map(|i| {
            let corner = corners[rng.below(corners.len() as u64) as usize];
            let mut inside = |margin: f32| {
                [0, 1, 2].map(|k| {
                    lower[k] + extent[k] * 0.5 + (extent[k] + margin * size) * (rng.unit_f32() - 0.5)
                })
            };
            let target = match i % 3 {
                0 => corner[0],
                1 => [0, 1, 2].map(|k| 0.5 * (corner[0][k] + corner[1][k])),
                _ => inside(0.0),
            };
            let origin = match i % 5 {
                0 => inside(0.0),
                1 => corner[2],
                _ => inside(3.0),
            };
            let mut ray = Ray::new(origin, sub(target, origin));
            match i % 11 {
                0 | 1 => {
                    let k = rng.below(3) as usize;
                    ray.direction = [0.0, -0.0, 0.0];
                    ray.direction[k] = if rng.below(2) == 0 { 1.0 } else { -1.0 };
                    ray.origin = target;
                    ray.origin[k] -= ray.direction[k] * 3.0 * size;
                }
                2 => ray.direction = sub(corner[1], corner[0]),
                3 => ray.tmax = 1.0,
                4 => ray.tmin = 1.0,
                5 => ray.tmin = -1.0,
                // Scaled by powers of two, so that exactly aimed rays stay exact; long ones stay finite.
                6 => ray.direction = ray.direction.map(|d| d * 2f32.powi(-20)),
                7 => ray.direction = ray.direction.map(|d| d * 2f32.powi(20)),
                _ => {}
            }
            ray
        })
        .collect()
}

/// Rays that start where others hit, with the surface that they start on; and some with wild hints, wrong ones
/// and ones out of range.
pub fn onward(rays: &[Ray], hits: &[Hit], triangles: usize, seed: u64) -> Vec<(Ray, PrimitiveRef)> {
    let mut rng = Rng::new(seed);
    let mut from = |(ray, hit): (&Ray, &Hit)| {
        if !hit.is_hit() || rng.below(8) == 0 {
            let triangle = rng.below(triangles as u64 + 3) as u32;
            return (*ray, PrimitiveRef { instance: 0, triangle });
        }
        let back = hit.t * (1.0 - 1e-4 * rng.unit_f32());
        let origin = [0, 1, 2].map(|k| ray.origin[k] + ray.direction[k] * back);
        let direction = [(); 3].map(|()| rng.unit_f32() - 0.5);
        (Ray::new(origin, direction), hit.primitive)
    };
    rays.iter().zip(hits).map(&mut from).collect()
}
