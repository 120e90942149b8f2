//! Rays for tests, including those for which ray tracers tend to miss hits.

use crate::structures::bits;
use bth::rays::{Hit, PrimitiveRef, Ray, Start, StartRay};
use bth::{Scene, TraceRay};
use bth_random::Rng;
use std::fmt::{Debug, Display};

fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// Rays of every kind: through the model, exactly through vertices and edge midpoints, along axes
/// and in the planes of faces, from vertices, with ranges that end about hits, with tiny and huge
/// directions.
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
                // Scaled by powers of two, so that exactly aimed rays stay exact; long ones stay
                // finite.
                6 => ray.direction = ray.direction.map(|d| d * 2f32.powi(-20)),
                7 => ray.direction = ray.direction.map(|d| d * 2f32.powi(20)),
                _ => {}
            }
            ray
        })
        .collect()
}

/// Rays that start where others hit, in any direction; where one misses, and for some others, at
/// any point of any triangle, also of ones that do not exist.
pub fn onward(hits: &[Hit], triangles: usize, seed: u64) -> Vec<StartRay> {
    let mut rng = Rng::new(seed);
    let mut from = |hit: &Hit| {
        let direction = [(); 3].map(|()| rng.unit_f32() - 0.5);
        if hit.is_hit() && rng.below(8) > 0 {
            return StartRay::from_hit(hit, direction);
        }
        let triangle = rng.below(triangles as u64 + 3) as u32;
        let (u, v) = (0.5 * rng.unit_f32(), 0.5 * rng.unit_f32());
        Start { primitive: PrimitiveRef { instance: 0, triangle }, u, v }.ray(direction)
    };
    hits.iter().map(&mut from).collect()
}

/// Weights of points of a triangle: corners; points of edges, some with a sum that rounds to above
/// 1; and others.
pub fn weights(rng: &mut Rng) -> [f32; 2] {
    let w = rng.unit_f32();
    match rng.below(10) {
        0 => [0.0, 0.0],
        1 => [1.0, 0.0],
        2 => [0.0, 1.0],
        3 => [w, 0.0],
        4 => [0.0, w],
        5 => [w, 1.0 - w],
        6 => {
            // Up to the largest sum.
            let v = 1.0 - w + (1 + rng.below(4)) as f32 / (1 << 24) as f32;
            [w, if w + v <= 1.0 + 1.0 / (1 << 22) as f32 { v } else { 1.0 - w }]
        }
        7 => [[0.5, 0.5], [0.5, 0.0], [0.0, 0.5], [0.25, 0.25]][rng.below(4) as usize],
        _ => [w * 0.5, rng.unit_f32() * 0.5],
    }
}

/// The point with these weights, rounded.
fn point_of([a, b, c]: [[f32; 3]; 3], [u, v]: [f32; 2]) -> [f32; 3] {
    let (u, v) = (f64::from(u), f64::from(v));
    [0, 1, 2].map(|k| {
        let [a, b, c] = [a[k], b[k], c[k]].map(f64::from);
        (a + u * (b - a) + v * (c - a)) as f32
    })
}

/// Rays from starts of every kind on an object's triangles: in faces, on edges and at corners,
/// along edges, in the plane, to vertices, along axes and anywhere, with tiny and huge directions;
/// some of them short.
pub fn starts(corners: &[[[f32; 3]; 3]], count: usize, seed: u64) -> Vec<StartRay> {
    let mut rng = Rng::new(seed);
    let any = |rng: &mut Rng| rng.below(corners.len() as u64) as usize;
    let ray = |_| {
        let triangle = any(&mut rng);
        let of @ [a, b, c] = corners[triangle];
        let [u, v] = weights(&mut rng);
        let start = Start { primitive: PrimitiveRef { instance: 0, triangle: triangle as u32 }, u, v };
        let (from, other) = (point_of(of, [u, v]), corners[any(&mut rng)]);
        let size = max_norm(sub(b, a)).max(max_norm(sub(c, a)));
        let anywhere = rng.point_in_ball().map(|x| x as f32 * size);
        let mut direction = match rng.below(10) {
            0 => sub(b, a),
            1 => sub(c, b),
            2 => sub(of[rng.below(3) as usize], from),
            3 => sub(point_of(of, weights(&mut rng)), from),
            4 => sub(other[0], from),
            5 => sub(point_of(other, weights(&mut rng)), from),
            6 => {
                let mut axis = [0.0, -0.0, 0.0];
                axis[rng.below(3) as usize] = if rng.below(2) == 0 { size } else { -size };
                axis
            }
            _ => anywhere,
        };
        if direction == [0.0; 3] {
            direction = anywhere;
        }
        let scale = [1.0, 1.0, -1.0, 2f32.powi(-20), 2f32.powi(20)][rng.below(5) as usize];
        let tmax = [f32::INFINITY, 1.0 / scale.abs(), 0.1 / scale.abs()][rng.below(3) as usize];
        start.ray(direction.map(|d| d * scale)).with_tmax(tmax)
    };
    (0..count).map(ray).collect()
}

/// Groups of 64 rays that go in packets: from one triangle each, in nearly one direction, most of
/// them short.
pub fn coherent_starts(corners: &[[[f32; 3]; 3]], groups: usize, seed: u64) -> Vec<StartRay> {
    let mut rng = Rng::new(seed);
    let group = |_| {
        let triangle = rng.below(corners.len() as u64) as usize;
        let [a, b, c] = corners[triangle];
        let size = max_norm(sub(b, a)).max(max_norm(sub(c, a)));
        let [u, v] = weights(&mut rng);
        let toward = rng.unit_vector().map(|x| x as f32 * size);
        let tmax = [f32::INFINITY, 4.0, 1.0, 0.25][rng.below(4) as usize];
        let spread = [0.0, 0.01, 0.1][rng.below(3) as usize];
        let rays: Vec<StartRay> = (0..64)
            .map(|_| {
                let shrink = 1.0 - spread * rng.unit_f32();
                let primitive = PrimitiveRef { instance: 0, triangle: triangle as u32 };
                let direction = toward.map(|x| x + spread * size * (rng.unit_f32() - 0.5));
                Start { primitive, u: u * shrink, v: v * shrink }.ray(direction).with_tmax(tmax)
            })
            .collect();
        rays
    };
    (0..groups).flat_map(group).collect()
}

fn max_norm(v: [f32; 3]) -> f32 {
    v.iter().fold(0.0, |most: f32, x| most.max(x.abs()))
}

/// Checks that a batch has these nearest hits, to the bit, and any hit where there is one.
pub fn check_batch<R: TraceRay + Debug>(scene: &Scene, rays: &[R], expected: &[Hit], context: impl Display) {
    let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    scene.batch(rays).nearest(&mut hits);
    scene.batch(rays).any(&mut found);
    for (i, ray) in rays.iter().enumerate() {
        assert_eq!(
            bits(&hits[i]),
            bits(&expected[i]),
            "{context}: {ray:?}: {:?}, not {:?}",
            hits[i],
            expected[i]
        );
        assert_eq!(found[i], expected[i].is_hit(), "any hit, {context}: {ray:?}");
    }
}

/// The nearest hits of rays, each traced alone.
pub fn alone<R: TraceRay>(scene: &Scene, rays: &[R]) -> Vec<Hit> {
    rays.iter().map(|ray| scene.nearest(ray).unwrap_or(Hit::MISS)).collect()
}
