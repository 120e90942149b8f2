//! A camera within the model, for rooms: of a number of points, the one that sees most surface,
//! farthest away.

use crate::args::{Args, Axis};
use crate::camera::{self, Camera};
use crate::sampling::{Sampler, sphere};
use crate::surface::Shape;
use bth::Scene;
use bth::rays::{Hit, Ray};
use glam::DVec3;
use rayon::prelude::*;

const CANDIDATES: u32 = 96;
const DIRECTIONS: u32 = 512;
/// Vertical field of view, degrees.
const FOV: f64 = 70.0;

/// The camera within the model.
pub(crate) fn camera(scene: &Scene, shape: &Shape<'_>, args: &Args) -> Camera {
    let directions: Vec<DVec3> = sphere(DIRECTIONS).collect();
    let eyes: Vec<DVec3> = (0..CANDIDATES).map(|i| candidate(shape, args.up, i)).collect();
    let seen: Vec<Vec<f64>> = eyes.par_iter().map(|eye| distances(scene, *eye, &directions)).collect();
    let best = (0..eyes.len())
        .max_by(|a, b| score(&seen[*a], shape).total_cmp(&score(&seen[*b], shape)))
        .unwrap_or(0);
    let vertical = camera::vertical(args.up);
    let forward = farthest_view(&directions, &seen[best], vertical, shape.diagonal());
    Camera::looking(eyes[best], forward, vertical, camera::extent(args, FOV) / args.zoom)
}

/// A point of the middle of the bounds, low enough for a standing person.
fn candidate(shape: &Shape<'_>, up: Axis, index: u32) -> DVec3 {
    let sampler = Sampler::new(0, 0);
    let flat = sampler.point(0, index) * 0.8 + 0.1;
    let high = sampler.point(1, index).x * 0.35 + 0.25;
    let at = match up {
        Axis::Y => DVec3::new(flat.x, high, flat.y),
        Axis::Z => DVec3::new(flat.x, flat.y, high),
    };
    shape.lower + (shape.upper - shape.lower) * at
}

/// How far one sees in each direction; infinite into the open.
fn distances(scene: &Scene, eye: DVec3, directions: &[DVec3]) -> Vec<f64> {
    let origin = eye.as_vec3().to_array();
    let rays: Vec<Ray> = directions
        .iter()
        .map(|d| Ray { origin, tmin: 0.0, direction: d.as_vec3().to_array(), tmax: f32::INFINITY })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.nearest_batch(&rays, None, &mut hits);
    hits.iter().map(|h| f64::from(h.t)).collect()
}

/// Mean distance, discounted by the share of directions into the open and by what stands close before the eye.
fn score(distances: &[f64], shape: &Shape<'_>) -> f64 {
    let mut hit: Vec<f64> = distances.iter().copied().filter(|t| t.is_finite()).collect();
    if hit.is_empty() {
        return 0.0;
    }
    hit.sort_by(f64::total_cmp);
    let share = hit.len() as f64 / distances.len() as f64;
    let mean = hit.iter().sum::<f64>() / hit.len() as f64 / shape.diagonal();
    let close = (hit[hit.len() / 20] / (0.05 * shape.diagonal())).min(1.0);
    share.powi(4) * mean * close
}

/// The slightly lowered horizontal direction around which one sees farthest.
fn farthest_view(directions: &[DVec3], distances: &[f64], vertical: DVec3, diagonal: f64) -> DVec3 {
    let (side, front) = vertical.any_orthonormal_pair();
    let depth = |forward: DVec3| {
        let near = directions.iter().zip(distances).filter(|(d, _)| d.dot(forward) > 0.75);
        let (sum, n) = near.fold((0.0, 0), |(sum, n), (_, t)| (sum + t.min(0.2 * diagonal), n + 1));
        sum / f64::from(n.max(1))
    };
    let views = (0..32).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 32.0;
        (side * angle.cos() + front * angle.sin() - vertical * 0.12).normalize()
    });
    views.max_by(|a, b| depth(*a).total_cmp(&depth(*b))).unwrap_or(side)
}
