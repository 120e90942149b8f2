//! A camera within the model, for rooms: of a number of points, the one that sees most surface,
//! farthest away and in most detail.

use crate::args::{Args, Axis};
use crate::camera::{self, Camera};
use crate::sampling::{Sampler, sphere};
use crate::stage::Space;
use bth::Scene;
use bth::rays::{Hit, Ray};
use glam::DVec3;
use rayon::prelude::*;

const CANDIDATES: u32 = 96;
const DIRECTIONS: u32 = 1024;
/// Vertical field of view, degrees.
const FOV: f64 = 70.0;

/// What stands in one direction from a candidate.
struct Sight {
    direction: DVec3,
    /// Infinite into the open.
    distance: f64,
    triangle: u32,
}

/// The camera within the model.
pub(crate) fn camera(scene: &Scene, space: &Space, args: &Args) -> Camera {
    let eyes: Vec<DVec3> = (0..CANDIDATES).map(|i| candidate(space, args.up, i)).collect();
    let seen: Vec<Vec<Sight>> = eyes.par_iter().map(|eye| look_around(scene, *eye)).collect();
    let scores: Vec<f64> = seen.iter().map(|sights| score(sights, space.diagonal())).collect();
    let best = (0..eyes.len()).max_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap_or(0);
    let vertical = camera::vertical(args.up);
    let forward = richest_view(&seen[best], vertical, space.diagonal());
    Camera::looking(eyes[best], forward, vertical, camera::extent(args, FOV) / args.zoom)
}

/// A point of the middle of the bounds, low enough for a standing person.
fn candidate(space: &Space, up: Axis, index: u32) -> DVec3 {
    let sampler = Sampler::new(0, 0);
    let flat = sampler.point(0, index) * 0.8 + 0.1;
    let high = sampler.point(1, index).x * 0.35 + 0.25;
    let at = match up {
        Axis::Y => DVec3::new(flat.x, high, flat.y),
        Axis::Z => DVec3::new(flat.x, flat.y, high),
    };
    space.lower + (space.upper - space.lower) * at
}

fn look_around(scene: &Scene, eye: DVec3) -> Vec<Sight> {
    let origin = eye.as_vec3().to_array();
    let directions: Vec<DVec3> = sphere(DIRECTIONS).collect();
    let ray = |d: &DVec3| Ray { origin, tmin: 0.0, direction: d.as_vec3().to_array(), tmax: f32::INFINITY };
    let rays: Vec<Ray> = directions.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.nearest_batch(&rays, None, &mut hits);
    let sight = |(direction, hit): (DVec3, &Hit)| Sight {
        direction,
        distance: f64::from(hit.t),
        triangle: hit.surface.triangle,
    };
    directions.into_iter().zip(&hits).map(sight).collect()
}

/// Share of the sights that show a triangle of their own: bare walls have few, furniture many.
fn detail<'a>(sights: impl Iterator<Item = &'a Sight>) -> f64 {
    let mut triangles: Vec<u32> = sights.filter(|s| s.distance.is_finite()).map(|s| s.triangle).collect();
    let total = triangles.len().max(1) as f64;
    triangles.sort_unstable();
    triangles.dedup();
    triangles.len() as f64 / total
}

/// Mean distance and detail, discounted by the share of directions into the open and by what stands
/// close before the eye.
fn score(sights: &[Sight], diagonal: f64) -> f64 {
    let mut hit: Vec<f64> = sights.iter().map(|s| s.distance).filter(|t| t.is_finite()).collect();
    if hit.is_empty() {
        return 0.0;
    }
    hit.sort_by(f64::total_cmp);
    let share = hit.len() as f64 / sights.len() as f64;
    let mean = hit.iter().sum::<f64>() / hit.len() as f64 / diagonal;
    let close = (hit[hit.len() / 20] / (0.05 * diagonal)).min(1.0);
    share.powi(4) * mean * close * (0.1 + detail(sights.iter()))
}

/// The slightly lowered horizontal direction around which one sees most detail and depth.
fn richest_view(sights: &[Sight], vertical: DVec3, diagonal: f64) -> DVec3 {
    let (side, front) = vertical.any_orthonormal_pair();
    let value = |forward: DVec3| {
        let cone = || sights.iter().filter(|s| s.direction.dot(forward) > 0.75);
        let (sum, n) = cone().fold((0.0, 0), |(sum, n), s| (sum + s.distance.min(0.3 * diagonal), n + 1));
        sum / f64::from(n.max(1)) * (0.1 + detail(cone()))
    };
    let views = (0..32).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 32.0;
        (side * angle.cos() + front * angle.sin() - vertical * 0.15).normalize()
    });
    views.max_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(side)
}
