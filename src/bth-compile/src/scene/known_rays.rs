//! The objects and triangles that the rays of a scene hit (`--for-scene`): rays from its cameras at
//! some of its frames, bounces from what they hit, and rays from there to its lights.

use crate::error::{Error, Place, Result};
use crate::sampling::{KnownRays, SampleRay};
use crate::vectors::{double_area, uniform_direction, unit};
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::{Camera, Light};
use bth_random::Rng;
use glam::DVec3;
use std::path::Path;

/// Largest number of frames, which are spread evenly over the range, and columns and rows of the
/// grid of camera rays at each frame.
const FRAMES: i64 = 8;
const GRID: [u32; 2] = [96, 54];
/// Bounces after a camera ray.
const BOUNCES: usize = 2;
/// Offset of ray origins from the surface that they start on, relative to the magnitude of the
/// coordinates there.
const VISIBILITY_LIFT: f64 = 1e-5;

type Rows = [[f64; 4]; 3];

/// The rays that start on or hit each object of the scene, in the space of the object.
///
/// # Errors
/// `BTH-I062` when the scene has no camera.
pub(super) fn known_rays(scene: &mut Scene, name: &Path) -> Result<Vec<KnownRays>> {
    let mut known = vec![KnownRays::default(); scene.object_count() as usize];
    let Some(view) = scene.description() else { return Ok(known) };
    let (first, last) = (view.scene[0].first_frame, view.scene[0].last_frame);
    let (cameras, lights) = (view.cameras.to_vec(), view.lights.to_vec());
    let count = (i64::from(last) - i64::from(first)).clamp(0, FRAMES - 1);
    let mut random = Rng::new(51);
    for k in 0..=count {
        let frame = i64::from(first) + (i64::from(last) - i64::from(first)) * k / count.max(1);
        // A frame at which a node has no usable transform is skipped.
        if scene.set_frame(i32::try_from(frame).unwrap_or(first)).is_err() {
            continue;
        }
        for camera in &cameras {
            follow(scene, camera_rays(scene, camera, &mut random), &lights, &mut random, &mut known);
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
    Ok(known)
}

/// The linear part of a row.
fn linear([x, y, z, _]: [f64; 4]) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A transformed point.
fn point(rows: &Rows, p: DVec3) -> DVec3 {
    rows.map(|row| linear(row).dot(p) + row[3]).into()
}

/// A transformed vector.
fn vector(rows: &Rows, v: DVec3) -> DVec3 {
    rows.map(|row| linear(row).dot(v)).into()
}

/// The inverse of the linear part; `None` if it is singular.
fn inverse(rows: &Rows) -> Option<[DVec3; 3]> {
    let [a, b, c] = rows.map(linear);
    let (bc, ca, ab) = (b.cross(c), c.cross(a), a.cross(b));
    let determinant = a.dot(bc);
    let inverse = [0, 1, 2].map(|k| DVec3::new(bc[k], ca[k], ab[k]) / determinant);
    inverse.iter().all(|row| row.is_finite()).then_some(inverse)
}

/// Jittered rays of a camera, world space.
fn camera_rays(scene: &Scene, camera: &Camera, random: &mut Rng) -> Vec<Ray> {
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
            let u = half * aspect * at(x, GRID[0], random.unit_f64());
            let v = half * at(y, GRID[1], random.unit_f64());
            let (origin, direction) = match camera.projection {
                0 => (DVec3::ZERO, DVec3::new(u, v, -1.0)),
                _ => (DVec3::new(u, v, 0.0), DVec3::NEG_Z),
            };
            rays.extend(ray(point(&rows, origin), vector(&rows, direction), f64::INFINITY));
        }
    }
    rays
}

/// A ray of unit direction in single precision; `None` when it has a coordinate that is not finite.
fn ray(origin: DVec3, direction: DVec3, tmax: f64) -> Option<Ray> {
    let direction = unit(direction);
    let finite = direction.is_finite() && origin.is_finite();
    let single = |v: DVec3| v.to_array().map(|x| x as f32);
    finite.then(|| Ray { origin: single(origin), tmin: 0.0, direction: single(direction), tmax: tmax as f32 })
}

/// Traces camera rays, their bounces and the shadow rays, and records each at the objects that it
/// starts on and hits.
fn follow(scene: &Scene, camera_rays: Vec<Ray>, lights: &[Light], random: &mut Rng, known: &mut [KnownRays]) {
    let mut rays: Vec<(Ray, PrimitiveRef)> =
        camera_rays.into_iter().map(|ray| (ray, PrimitiveRef::NONE)).collect();
    for bounce in 0..=BOUNCES {
        let only: Vec<Ray> = rays.iter().map(|r| r.0).collect();
        let mut hits = vec![Hit::MISS; only.len()];
        scene.batch(&only).nearest(&mut hits);
        let mut next = Vec::new();
        for ((ray, from), hit) in rays.iter().zip(&hits) {
            record(scene, ray, *from, hit, known);
            let Some((start, normal)) = start(scene, ray, hit) else { continue };
            for light in lights {
                let (rows, shines) = scene.node(light.node);
                let towards = match light.kind {
                    0 => vector(&rows, DVec3::Z),
                    _ => DVec3::from(rows.map(|row| row[3])) - start,
                };
                let far = if light.kind == 0 { f64::INFINITY } else { towards.length() };
                if shines && towards.dot(normal) > 0.0 {
                    let shadow = self::ray(start, towards, far);
                    shadow.iter().for_each(|ray| record(scene, ray, hit.primitive, &Hit::MISS, known));
                }
            }
            if bounce < BOUNCES {
                let bounced = self::ray(start, normal + uniform_direction(random), f64::INFINITY);
                next.extend(bounced.map(|ray| (ray, hit.primitive)));
            }
        }
        rays = next;
    }
}

/// Origin of the rays that follow a hit, offset from the surface, and the normal on that side;
/// world space.
fn start(scene: &Scene, ray: &Ray, hit: &Hit) -> Option<(DVec3, DVec3)> {
    if !hit.is_hit() {
        return None;
    }
    let PrimitiveRef { instance, triangle } = hit.primitive;
    let object = scene.object(scene.object_of(instance));
    let corners =
        object.triangles.get(triangle as usize)?.map(|v| object.positions[v as usize].map(f64::from));
    let n = unit(double_area(corners.map(|p| point(&scene.instance(instance).to_world, p.into()))));
    let [origin, direction] = [ray.origin, ray.direction].map(|v| DVec3::from(v.map(f64::from)));
    let n = if n.dot(direction) > 0.0 { -n } else { n };
    let at = origin + f64::from(hit.t) * direction;
    let size = at.to_array().iter().fold(0.0f64, |m, x| m.max(x.abs())).max(f64::from(hit.t));
    let start = at + VISIBILITY_LIFT * size * n;
    (n.is_finite() && start.is_finite()).then_some((start, n))
}

/// Records a ray at the object that it starts on and at the one that it hits.
fn record(scene: &Scene, ray: &Ray, from: PrimitiveRef, hit: &Hit, known: &mut [KnownRays]) {
    if from != PrimitiveRef::NONE
        && let Some(sample) = local(scene, ray, from.instance, Some(from.triangle))
    {
        known[scene.object_of(from.instance) as usize].surface.push(sample);
    }
    // A ray from elsewhere is recorded only at the object that it hits, not at objects that it
    // misses.
    if hit.is_hit()
        && hit.primitive.instance != from.instance
        && let Some(sample) = local(scene, ray, hit.primitive.instance, None)
    {
        known[scene.object_of(hit.primitive.instance) as usize].outside.push(sample);
    }
}

/// A ray in the space of an instance's object.
fn local(scene: &Scene, ray: &Ray, instance: u32, from: Option<u32>) -> Option<SampleRay> {
    let rows = scene.instance(instance).to_world;
    let inverse = inverse(&rows)?;
    let [origin, direction] = [ray.origin, ray.direction].map(|v| DVec3::from(v.map(f64::from)));
    let origin = origin - DVec3::from(rows.map(|row| row[3]));
    let origin = DVec3::from(inverse.map(|row| row.dot(origin)));
    let direction = DVec3::from(inverse.map(|row| row.dot(direction)));
    let length = direction.length();
    let direction = direction / length;
    let tmax = f64::from(ray.tmax) * length;
    let finite = origin.is_finite() && direction.is_finite();
    finite.then(|| SampleRay { origin: origin.into(), direction: direction.into(), tmax, from })
}
