//! Finds the hits that the secondary rays start from, with our own plain BVH: its answers are exact
//! and the same everywhere, so the rays are too.

use crate::model::{Model, position};
use crate::tracer::{BLOCK, Batch, spread};
use bth::Scene;
use bth::rays::{Hit, Ray};
use glam::DVec3;

/// Distance from the surface at which rays of the sets `-beside` start, relative to the model's
/// diagonal. On models far from the origin it is less than the resolution of f32.
pub const LIFT: f64 = 2e-5;

/// A model and the compiled scene of it.
pub struct Finder<'a> {
    pub(super) model: &'a Model,
    scene: &'a Scene,
    threads: usize,
    lift: f64,
}

impl<'a> Finder<'a> {
    /// For a model and its compiled scene; uses all processors.
    pub fn new(model: &'a Model, scene: &'a Scene) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
        Finder { model, scene, threads, lift: LIFT * model.bounds().diagonal() }
    }

    /// Nearest hits.
    pub(super) fn nearest(&self, rays: &[Ray]) -> Vec<Hit> {
        let mut hits = vec![Hit::MISS; rays.len()];
        let batch = Batch { rays, starts: None, coherent: false };
        spread(batch, &mut hits, (self.threads, 1), BLOCK, |b, h| self.scene.batch(b.rays).nearest(h));
        hits
    }

    /// Where a ray goes on from a hit: the point, and the same lifted off the surface to the ray's
    /// side; and the unit normal to that side. The point is computed in f64, and rounded once when
    /// a ray is made.
    pub(super) fn points(&self, ray: &Ray, hit: &Hit) -> ([DVec3; 2], DVec3) {
        let normal = self.model.normal(hit.primitive.triangle);
        let direction = position(ray.direction);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let point = position(ray.origin) + direction * f64::from(hit.t);
        ([point, point + normal * self.lift], normal)
    }

    /// The point lifted off the surface, and the normal.
    pub(super) fn beside(&self, ray: &Ray, hit: &Hit) -> (DVec3, DVec3) {
        let ([_, beside], normal) = self.points(ray, hit);
        (beside, normal)
    }
}
