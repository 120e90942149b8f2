//! The CWBVH of the crate `obvhs`, with its best preset. Triangles are stored in the order of the
//! leaves in the crate's own precomputed form, as its examples do.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::Result;
use bth::rays::{Hit, PrimitiveRef, Ray};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::time::{Duration, Instant};

struct Obvhs {
    bvh: CwBvh,
    triangles: Vec<RtTriangle>,
}

pub(super) fn contender(model: &Model, name: &str) -> Result<Contender> {
    let corners = |t: u32| model.mesh.corners(t).map(Vec3A::from_array);
    let source: Vec<Triangle> = (0..u32::try_from(model.triangles())?)
        .map(corners)
        .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
        .collect();
    let start = Instant::now();
    let bvh = build_cwbvh_from_tris(&source, BvhBuildParams::very_slow_build(), &mut Duration::default());
    let triangles: Vec<RtTriangle> =
        bvh.primitive_indices.iter().map(|t| RtTriangle::from(&source[*t as usize])).collect();
    let build_s = start.elapsed().as_secs_f64();
    let bytes =
        size_of_val(&bvh.nodes[..]) + size_of_val(&bvh.primitive_indices[..]) + size_of_val(&triangles[..]);
    Ok(Contender::rival(name, Obvhs { bvh, triangles }, build_s, Some(bytes as u64)))
}

#[inline(always)]
fn converted(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(Vec3A::from_array(ray.origin), Vec3A::from_array(ray.direction), ray.tmin, ray.tmax)
}

impl Tracer for Obvhs {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (ray, hit) in batch.rays.iter().zip(hits) {
            let (ray, mut found) = (converted(ray), RayHit::none());
            self.bvh.ray_traverse(ray, &mut found, |ray, i| self.triangles[i].intersect(ray));
            *hit = match self.triangles.get(found.primitive_id as usize) {
                None => Hit::MISS,
                Some(triangle) => {
                    let weights = triangle.compute_barycentric(&ray);
                    let triangle = self.bvh.primitive_indices[found.primitive_id as usize];
                    let primitive = PrimitiveRef { instance: 0, triangle };
                    Hit { t: found.t, u: weights.x, v: weights.y, primitive }
                }
            };
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        for (ray, found) in batch.rays.iter().zip(found) {
            let ray = converted(ray);
            *found = !self.bvh.ray_traverse_miss(ray, |ray, i| self.triangles[i].intersect(ray));
        }
    }
}
