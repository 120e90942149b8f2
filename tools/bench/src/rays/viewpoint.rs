//! Chooses the place of the camera: around the model, within it, or close to its surface.

use super::camera::{Camera, ray};
use super::directions::{cosine_weighted, on_sphere, perpendicular};
use super::finder::{Finder, LIFT};
use crate::model::Bounds;
use bth::rays::{Hit, Ray};
use bth_random::Rng;
use glam::DVec3;

/// The place of a model's cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum View {
    /// Around the model.
    Outside,
    /// Within the model, as is right for rooms and caves: from outside only their walls are
    /// visible.
    Inside,
}

/// A camera, its rays and what they hit.
pub(super) struct CameraHits {
    pub(super) camera: Camera,
    pub(super) rays: Vec<Ray>,
    pub(super) hits: Vec<Hit>,
}

fn trace_camera(finder: &Finder<'_>, camera: Camera) -> CameraHits {
    let rays = camera.rays();
    let hits = finder.nearest(&rays);
    CameraHits { camera, rays, hits }
}

/// The three-quarter views from outside, in the order in which they are tried.
const SIDES: [DVec3; 4] = [
    DVec3::new(0.8, 0.5, 1.0),
    DVec3::new(1.0, 0.5, -0.8),
    DVec3::new(-0.8, 0.5, -1.0),
    DVec3::new(-1.0, 0.5, 0.8),
];

/// A camera that frames the whole model. Where most of the visible surface lies in the faces of the
/// bounding box, secondary rays leave the box at once and measure nothing; then the next side is
/// tried.
pub(super) fn outside(finder: &Finder<'_>, bounds: &Bounds, size: (u32, u32)) -> CameraHits {
    let points: Vec<DVec3> = finder.model.mesh.positions.iter().map(|p| crate::model::position(*p)).collect();
    let (middle, diagonal) = (bounds.center(), bounds.diagonal());
    let look = |from: DVec3| trace_camera(finder, Camera::framing(&points, middle, diagonal, from, size));
    let mut first = None;
    for from in SIDES {
        let seen = look(from);
        let hit = seen.rays.iter().zip(&seen.hits).filter(|(_, h)| h.is_hit());
        let starts: Vec<bool> = hit.map(|(r, h)| bounds.holds(finder.beside(r, h).0)).collect();
        if 2 * starts.iter().filter(|holds| **holds).count() > starts.len() {
            return seen;
        }
        first.get_or_insert(seen);
    }
    first.expect("there are sides")
}

/// A camera within the model. Of 64 random points in the box it takes the one from which most
/// directions hit something, far away on average; it looks in the direction of the farthest hit.
pub(super) fn inside(finder: &Finder<'_>, bounds: &Bounds, size: (u32, u32)) -> CameraHits {
    const POINTS: usize = 64;
    const DIRECTIONS: usize = 256;
    let mut rng = Rng::new(6);
    let extent = bounds.upper - bounds.lower;
    let mut inner = || 0.1 + 0.8 * rng.unit_f64();
    let eyes: Vec<DVec3> =
        (0..POINTS).map(|_| bounds.lower + extent * DVec3::new(inner(), inner(), inner())).collect();
    let directions: Vec<DVec3> = (0..DIRECTIONS).map(|_| on_sphere(&mut rng)).collect();

    let mut best = (f64::NEG_INFINITY, DVec3::ZERO, DVec3::Z);
    for eye in eyes {
        let rays: Vec<Ray> = directions.iter().map(|d| ray(eye, *d, f64::INFINITY)).collect();
        let reach = |h: &Hit| if h.is_hit() { f64::from(h.t) } else { 0.0 };
        let reaches: Vec<f64> = finder.nearest(&rays).iter().map(reach).collect();
        let hit = reaches.iter().filter(|t| **t > 0.0).count() as f64 / DIRECTIONS as f64;
        let mean = reaches.iter().sum::<f64>() / DIRECTIONS as f64;
        let farthest = (0..DIRECTIONS).max_by(|i, j| reaches[*i].total_cmp(&reaches[*j])).unwrap_or(0);
        // `>=` takes the last of equal points, which matters only where nothing is hit at all.
        if hit * hit * mean >= best.0 {
            best = (hit * hit * mean, eye, directions[farthest]);
        }
    }
    let (_, eye, direction) = best;
    let camera = Camera { eye, target: eye + direction, tangent: 35f64.to_radians().tan(), size };
    trace_camera(finder, camera)
}

/// A camera just above the surface point that is nearest to the middle of the picture.
pub(super) fn close_up(finder: &Finder<'_>, diagonal: f64, seen: &CameraHits) -> Camera {
    let (front, ..) = seen.camera.axes();
    let central = |i: &usize| front.dot(crate::model::position(seen.rays[*i].direction));
    let hit = (0..seen.hits.len()).filter(|i| seen.hits[*i].is_hit());
    let Some(middle) = hit.max_by(|i, j| central(i).total_cmp(&central(j))) else { return seen.camera };
    let (point, normal) = finder.beside(&seen.rays[middle], &seen.hits[middle]);
    let (side, _) = perpendicular(normal);
    Camera {
        eye: point + (normal * 0.6 + side * 0.8) * (0.04 * diagonal),
        target: point,
        tangent: 30f64.to_radians().tan(),
        ..seen.camera
    }
}

/// Samples of [`automatic`].
const SKY_SAMPLES: usize = 4096;
/// The camera is in the model if less than this share of the rays from its triangles' fronts leave
/// it.
const OPEN: f64 = 0.08;

/// Decides by the share of cosine-weighted rays from the fronts of random triangles that hit
/// nothing: few in rooms and caves, most on objects. Triangles count equally, so that furniture
/// outweighs the walls around it.
pub(super) fn automatic(finder: &Finder<'_>, diagonal: f64) -> View {
    let mut rng = Rng::new(7);
    let count = finder.model.triangles();
    let mut rays = Vec::with_capacity(SKY_SAMPLES);
    for _ in 0..SKY_SAMPLES {
        let triangle = ((rng.unit_f64() * count as f64) as usize).min(count - 1) as u32;
        let normal = finder.model.normal(triangle);
        if normal != DVec3::ZERO {
            let [a, b, c] = finder.model.corners(triangle);
            let point = (a + b + c) / 3.0 + normal * (LIFT * diagonal);
            rays.push(ray(point, cosine_weighted(&mut rng, normal), f64::INFINITY));
        }
    }
    let open = finder.nearest(&rays).iter().filter(|h| !h.is_hit()).count();
    let is_room = (open as f64) < OPEN * rays.len().max(1) as f64;
    if is_room { View::Inside } else { View::Outside }
}
