//! The exact answers to a set of rays.

use crate::rays::RaySet;
use crate::structures::SceneTracer;
use crate::tracer::Tracer;
use anyhow::{Result, ensure};
use bth::rays::{Hit, Ray};
use bth_oracle::Intersection;
use rayon::prelude::*;

/// Triangles as they are stored in a compiled file, and the scene that finds the nearest one.
pub(super) struct Geometry {
    scene: SceneTracer,
    /// Ids of the triangles that can be hit, ascending.
    ids: Vec<u32>,
    /// Corners of these triangles.
    corners: Vec<[[f32; 3]; 3]>,
}

/// The exact nearest hit of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exact {
    /// As our runtime reports it.
    pub(super) hit: Hit,
    /// t before it is rounded to f32; infinite for a miss.
    pub(super) t: f64,
}

impl Geometry {
    /// The triangles of a compiled plain BVH.
    pub(super) fn new(bytes: &[u8]) -> Result<Geometry> {
        let scene = bth::from_bytes(bytes)?;
        let triangles = bth_oracle::triangles(&scene.object(0));
        let scene = SceneTracer(scene);
        let (ids, corners) = triangles.into_iter().map(|t| (t.id, t.corners)).unzip();
        Ok(Geometry { scene, ids, corners })
    }

    /// The intersection of a ray's line and a triangle.
    pub(super) fn crossing(&self, ray: &Ray, triangle: u32) -> Option<Intersection> {
        let row = self.ids.binary_search(&triangle).ok()?;
        bth_oracle::intersection(ray, self.corners[row])
    }

    /// The exact answers to a set. Our BVH finds them, as testing every triangle against every ray
    /// would take days; one in `one_in` rays is tested against every triangle in exact arithmetic.
    pub(super) fn answers(&self, set: &RaySet, one_in: usize) -> Result<Vec<Exact>> {
        let mut hits = vec![Hit::MISS; set.rays.len()];
        self.scene.nearest(set.batch(), &mut hits);
        let wrong = (0..set.rays.len()).into_par_iter().step_by(one_in.max(1)).find_any(|&i| {
            let (ray, hit) = (&set.rays[i], &hits[i]);
            let Some(truth) = bth_oracle::nearest(&self.corners, ray) else { return hit.is_hit() };
            // Of several triangles whose t rounds to the same number, any may be the answer.
            let t = truth.t_f64() as f32;
            let named = self.crossing(ray, hit.primitive.triangle);
            hit.t != t || named.is_none_or(|at| bth_oracle::to_f64(&at.t) as f32 != t)
        });
        ensure!(
            wrong.is_none(),
            "{}: our answer to ray {} is not the exact one",
            set.name,
            wrong.unwrap_or_default()
        );
        let exact = |(ray, hit): (&Ray, &Hit)| {
            let at = self.crossing(ray, hit.primitive.triangle);
            Exact { hit: *hit, t: at.map_or(f64::INFINITY, |at| bth_oracle::to_f64(&at.t)) }
        };
        Ok(set.rays.par_iter().zip(&hits).map(exact).collect())
    }
}
