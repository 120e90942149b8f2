//! A camera inside the model, for rooms: of a number of candidate eyes, the one that sees the most
//! surface, farthest away and in most detail.

use super::bounds::SceneBounds;
use super::projection::{Camera, half_extent, up_vector};
use crate::args::{Args, Axis};
use crate::sampling::{Sampler, fibonacci_sphere};
use bth::Scene;
use bth::rays::{Hit, Ray};
use glam::DVec3;
use rayon::prelude::*;

/// Candidate eyes.
const CANDIDATES: u32 = 96;
/// Directions in which rays leave a candidate.
const DIRECTIONS: u32 = 1024;
/// Vertical field of view, degrees.
const INTERIOR_FOV: f64 = 70.0;

/// The nearest hit in one direction from a candidate eye.
struct Probe {
    direction: DVec3,
    /// Infinite where nothing is hit.
    distance: f64,
    triangle: u32,
}

/// The camera inside the model.
pub(super) fn interior_camera(scene: &Scene, bounds: &SceneBounds, args: &Args) -> Camera {
    let eyes: Vec<DVec3> = (0..CANDIDATES).map(|i| candidate(bounds, args.up(), i)).collect();
    let probes: Vec<Vec<Probe>> = eyes.par_iter().map(|eye| probe(scene, *eye)).collect();
    let scores: Vec<f64> = probes.iter().map(|probes| score(probes, bounds.diagonal())).collect();
    let best = (0..eyes.len()).max_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap_or(0);
    let vertical = up_vector(args.up());
    let forward = best_direction(&probes[best], vertical, bounds.diagonal());
    Camera::look_along(eyes[best], forward, vertical, half_extent(args, INTERIOR_FOV) / args.zoom)
}

/// A point in the middle eight tenths of the bounds, in height between a quarter and six tenths, as
/// of a standing person.
fn candidate(bounds: &SceneBounds, up: Axis, index: u32) -> DVec3 {
    let sampler = Sampler::new(0, 0);
    let flat = sampler.point(0, index) * 0.8 + 0.1;
    let high = sampler.point(1, index).x * 0.35 + 0.25;
    let at = match up {
        Axis::Y => DVec3::new(flat.x, high, flat.y),
        Axis::Z => DVec3::new(flat.x, flat.y, high),
    };
    bounds.lower + (bounds.upper - bounds.lower) * at
}

/// The nearest hits in directions spread evenly around an eye.
fn probe(scene: &Scene, eye: DVec3) -> Vec<Probe> {
    let origin = eye.as_vec3().to_array();
    let directions: Vec<DVec3> = fibonacci_sphere(DIRECTIONS).collect();
    let ray = |d: &DVec3| Ray::new(origin, d.as_vec3().to_array());
    let rays: Vec<Ray> = directions.iter().map(ray).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(&rays).nearest(&mut hits);
    let result = |(direction, hit): (DVec3, &Hit)| Probe {
        direction,
        distance: f64::from(hit.t),
        triangle: hit.primitive.triangle,
    };
    directions.into_iter().zip(&hits).map(result).collect()
}

/// Distinct triangles per hit: low before bare walls, high before furniture.
fn detail<'a>(probes: impl Iterator<Item = &'a Probe>) -> f64 {
    let mut triangles: Vec<u32> = probes.filter(|s| s.distance.is_finite()).map(|s| s.triangle).collect();
    let total = triangles.len().max(1) as f64;
    triangles.sort_unstable();
    triangles.dedup();
    triangles.len() as f64 / total
}

/// Product of mean distance and detail, reduced by the share of directions in which nothing is hit,
/// and where the nearest twentieth of the hits is closer than a twentieth of the diagonal.
fn score(probes: &[Probe], diagonal: f64) -> f64 {
    let mut hit: Vec<f64> = probes.iter().map(|s| s.distance).filter(|t| t.is_finite()).collect();
    if hit.is_empty() {
        return 0.0;
    }
    hit.sort_by(f64::total_cmp);
    let share = hit.len() as f64 / probes.len() as f64;
    let mean = hit.iter().sum::<f64>() / hit.len() as f64 / diagonal;
    let close = (hit[hit.len() / 20] / (0.05 * diagonal)).min(1.0);
    share.powi(4) * mean * close * (0.1 + detail(probes.iter()))
}

/// The direction, slightly below the horizon, whose cone of view has the largest product of mean
/// distance and detail.
fn best_direction(probes: &[Probe], vertical: DVec3, diagonal: f64) -> DVec3 {
    let (side, front) = vertical.any_orthonormal_pair();
    let value = |forward: DVec3| {
        let cone = || probes.iter().filter(|s| s.direction.dot(forward) > 0.75);
        let (sum, n) = cone().fold((0.0, 0), |(sum, n), s| (sum + s.distance.min(0.3 * diagonal), n + 1));
        sum / f64::from(n.max(1)) * (0.1 + detail(cone()))
    };
    let directions = (0..32).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / 32.0;
        (side * angle.cos() + front * angle.sin() - vertical * 0.15).normalize()
    });
    directions.max_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(side)
}
