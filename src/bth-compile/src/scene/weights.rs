//! Which objects and triangles the rays of a scene meet (`--for-scene`): rays from its cameras at some of its frames,
//! bounces from what they hit, and rays from there to its lights.

use crate::costs::{RayRng, SampleRay, Weighting};
use crate::error::{Error, Place, Result};
use bth::Scene;
use bth::rays::{Hit, Ray, Surface};
use bth_format::layout::{Camera, Light};
use std::path::Path;

/// Frames at most, evenly over the range, and rays of a camera at each, in a grid of so many columns and rows.
const FRAMES: i64 = 8;
const GRID: [u32; 2] = [96, 54];
/// Bounces after a camera ray.
const BOUNCES: usize = 2;
/// By how much rays are lifted off the surface that they start on, relative to the size of the coordinates there.
const LIFT: f64 = 1e-5;

type Vector = [f64; 3];
type Rows = [[f64; 4]; 3];

/// The rays that concern each object of the scene, in its space.
///
/// # Errors
/// `BTH-I062` when the scene has no camera.
pub(super) fn weights(scene: &mut Scene, name: &Path) -> Result<Vec<Weighting>> {
    let mut weights = vec![Weighting::default(); scene.object_count() as usize];
    let Some(view) = scene.description() else { return Ok(weights) };
    let (first, last) = (view.scene[0].first_frame, view.scene[0].last_frame);
    let (cameras, lights) = (view.cameras.to_vec(), view.lights.to_vec());
    let count = (i64::from(last) - i64::from(first)).clamp(0, FRAMES - 1);
    let mut random = RayRng::new(51);
    for k in 0..=count {
        let frame = i64::from(first) + (i64::from(last) - i64::from(first)) * k / count.max(1);
        // A frame at which something cannot be placed shows nothing.
        if scene.set_frame(i32::try_from(frame).unwrap_or(first)).is_err() {
            continue;
        }
        for camera in &cameras {
            follow(scene, sights(scene, camera, &mut random), &lights, &mut random, &mut weights);
        }
    }
    if cameras.is_empty() {
        return Err(Error::Input {
            code: "BTH-I062",
            place: Place::File(name.to_owned()),
            message: "expected a camera, found none".to_owned(),
            hint: "add one to the manifest, or leave out --for-scene".to_owned(),
        });
    }
    Ok(weights)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: Vector) -> Vector {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

fn point(rows: &Rows, p: Vector) -> Vector {
    rows.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
}

fn vector(rows: &Rows, v: Vector) -> Vector {
    rows.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
}

/// The inverse of the linear part; `None` if there is none.
fn inverse(rows: &Rows) -> Option<[Vector; 3]> {
    let [a, b, c] = rows.map(|r| [r[0], r[1], r[2]]);
    let cross = |u: Vector, v: Vector| {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let determinant = dot(a, bc);
    let inverse = [0, 1, 2].map(|k| [bc[k], ca[k], ab[k]].map(|x| x / determinant));
    inverse.iter().flatten().all(|x| x.is_finite()).then_some(inverse)
}

/// Jittered rays of a camera, in the world.
fn sights(scene: &Scene, camera: &Camera, random: &mut RayRng) -> Vec<Ray> {
    let (rows, visible) = scene.node(camera.node);
    if !visible {
        return Vec::new();
    }
    let aspect = if camera.aspect > 0.0 { camera.aspect } else { 16.0 / 9.0 };
    let half = match camera.projection {
        0 => (0.5 * camera.size.to_radians()).tan(),
        _ => 0.5 * camera.size,
    };
    let mut rays = Vec::new();
    for y in 0..GRID[1] {
        for x in 0..GRID[0] {
            let at = |i: u32, of: u32, jitter: f64| 2.0 * (f64::from(i) + jitter) / f64::from(of) - 1.0;
            let u = half * aspect * at(x, GRID[0], random.unit());
            let v = half * at(y, GRID[1], random.unit());
            let (origin, direction) = match camera.projection {
                0 => ([0.0; 3], [u, v, -1.0]),
                _ => ([u, v, 0.0], [0.0, 0.0, -1.0]),
            };
            rays.extend(ray(point(&rows, origin), vector(&rows, direction), f64::INFINITY));
        }
    }
    rays
}

/// A ray of unit direction in single precision, if there is such a one.
fn ray(origin: Vector, direction: Vector, tmax: f64) -> Option<Ray> {
    let direction = unit(direction);
    let finite = direction.iter().chain(&origin).all(|x| x.is_finite());
    let single = |v: Vector| v.map(|x| x as f32);
    finite.then(|| Ray { origin: single(origin), tmin: 0.0, direction: single(direction), tmax: tmax as f32 })
}

/// Traces rays and what follows from them, and notes what they meet.
fn follow(scene: &Scene, sights: Vec<Ray>, lights: &[Light], random: &mut RayRng, weights: &mut [Weighting]) {
    let mut rays: Vec<(Ray, Surface)> = sights.into_iter().map(|ray| (ray, Surface::NONE)).collect();
    for bounce in 0..=BOUNCES {
        let only: Vec<Ray> = rays.iter().map(|r| r.0).collect();
        let mut hits = vec![Hit::MISS; only.len()];
        scene.nearest_batch(&only, None, &mut hits);
        let mut next = Vec::new();
        for ((ray, from), hit) in rays.iter().zip(&hits) {
            note(scene, ray, *from, hit, weights);
            let Some((start, normal)) = start(scene, ray, hit) else { continue };
            for light in lights {
                let (rows, shines) = scene.node(light.node);
                let towards = match light.kind {
                    0 => vector(&rows, [0.0, 0.0, 1.0]),
                    _ => [0, 1, 2].map(|k| rows[k][3] - start[k]),
                };
                let far = if light.kind == 0 { f64::INFINITY } else { dot(towards, towards).sqrt() };
                if shines && dot(towards, normal) > 0.0 {
                    let shadow = self::ray(start, towards, far);
                    shadow.iter().for_each(|ray| note(scene, ray, hit.surface, &Hit::MISS, weights));
                }
            }
            if bounce < BOUNCES {
                let s = random.sphere();
                next.extend(
                    self::ray(start, [0, 1, 2].map(|k| normal[k] + s[k]), f64::INFINITY)
                        .map(|ray| (ray, hit.surface)),
                );
            }
        }
        rays = next;
    }
}

/// Where a ray goes on from a hit: off the surface, with the normal to that side; world space.
fn start(scene: &Scene, ray: &Ray, hit: &Hit) -> Option<(Vector, Vector)> {
    if !hit.is_hit() {
        return None;
    }
    let Surface { instance, triangle } = hit.surface;
    let object = scene.object(scene.object_of(instance));
    let corners =
        object.triangles.get(triangle as usize)?.map(|v| object.positions[v as usize].map(f64::from));
    let [a, b, c] = corners.map(|p| point(&scene.instance(instance).to_world, p));
    let sub = |a: Vector, b: Vector| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let (u, v) = (sub(b, a), sub(c, a));
    let n = unit([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]);
    let (origin, direction) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
    let n = if dot(n, direction) > 0.0 { n.map(|x| -x) } else { n };
    let at = [0, 1, 2].map(|k| origin[k] + f64::from(hit.t) * direction[k]);
    let size = at.iter().fold(0.0f64, |m, x| m.max(x.abs())).max(f64::from(hit.t));
    let start = [0, 1, 2].map(|k| at[k] + LIFT * size * n[k]);
    n.iter().chain(&start).all(|x| x.is_finite()).then_some((start, n))
}

/// Notes a ray at the object that it starts on and at the one that it hits.
fn note(scene: &Scene, ray: &Ray, from: Surface, hit: &Hit, weights: &mut [Weighting]) {
    if from != Surface::NONE
        && let Some(sample) = local(scene, ray, from.instance, Some(from.triangle))
    {
        weights[scene.object_of(from.instance) as usize].surface.push(sample);
    }
    // Rays that come from elsewhere; those that pass an object by are left out.
    if hit.is_hit()
        && hit.surface.instance != from.instance
        && let Some(sample) = local(scene, ray, hit.surface.instance, None)
    {
        weights[scene.object_of(hit.surface.instance) as usize].outside.push(sample);
    }
}

/// A ray in the space of an instance's object.
fn local(scene: &Scene, ray: &Ray, instance: u32, from: Option<u32>) -> Option<SampleRay> {
    let rows = scene.instance(instance).to_world;
    let inverse = inverse(&rows)?;
    let origin = ray.origin.map(f64::from);
    let origin = [0, 1, 2].map(|k| origin[k] - rows[k][3]);
    let origin = inverse.map(|row| dot(row, origin));
    let direction = inverse.map(|row| dot(row, ray.direction.map(f64::from)));
    let length = dot(direction, direction).sqrt();
    let direction = direction.map(|x| x / length);
    let finite = origin.iter().chain(&direction).all(|x| x.is_finite());
    finite.then(|| SampleRay { origin, direction, tmax: f64::from(ray.tmax) * length, from })
}
