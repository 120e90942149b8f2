//! The `obvhs` crate: CWBVH and BVH2, both with its best preset. Triangles are stored in the order of the
//! leaves in the crate's own precomputed form, as its examples do.

use crate::model::Model;
use crate::tracer::{Batch, Contender, Tracer};
use anyhow::Result;
use bth::rays::{Hit, PrimitiveRef, Ray};
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::RayHit;
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::time::{Duration, Instant};

/// The operations that both structures have.
trait Bvh: Send + Sync {
    fn triangles(&self) -> &[u32];
    fn bytes_of_nodes(&self) -> usize;
    fn nearest(&self, ray: obvhs::ray::Ray, hit: &mut RayHit, triangles: &[RtTriangle]);
    fn any(&self, ray: obvhs::ray::Ray, triangles: &[RtTriangle]) -> bool;
}

macro_rules! bvh {
    ($bvh:ty) => {
        impl Bvh for $bvh {
            fn triangles(&self) -> &[u32] {
                &self.primitive_indices
            }
            fn bytes_of_nodes(&self) -> usize {
                size_of_val(self.nodes.as_slice())
            }
            #[inline(always)]
            fn nearest(&self, ray: obvhs::ray::Ray, hit: &mut RayHit, triangles: &[RtTriangle]) {
                self.ray_traverse(ray, hit, |ray, i| triangles[i].intersect(ray));
            }
            #[inline(always)]
            fn any(&self, ray: obvhs::ray::Ray, triangles: &[RtTriangle]) -> bool {
                !self.ray_traverse_miss(ray, |ray, i| triangles[i].intersect(ray))
            }
        }
    };
}
bvh!(CwBvh);
bvh!(Bvh2);

struct Obvhs<B> {
    bvh: B,
    triangles: Vec<RtTriangle>,
}

pub(super) fn cwbvh(model: &Model, name: &str) -> Result<Contender> {
    contender(model, name, build_cwbvh_from_tris)
}

pub(super) fn bvh2(model: &Model, name: &str) -> Result<Contender> {
    contender(model, name, build_bvh2_from_tris)
}

fn contender<B: Bvh + 'static>(
    model: &Model,
    name: &str,
    build: fn(&[Triangle], BvhBuildParams, &mut Duration) -> B,
) -> Result<Contender> {
    let corners = |t: u32| model.mesh.corners(t).map(Vec3A::from_array);
    let source: Vec<Triangle> = (0..u32::try_from(model.triangles())?)
        .map(corners)
        .map(|[v0, v1, v2]| Triangle { v0, v1, v2 })
        .collect();
    let start = Instant::now();
    let bvh = build(&source, BvhBuildParams::very_slow_build(), &mut Duration::default());
    let triangles: Vec<RtTriangle> =
        bvh.triangles().iter().map(|t| RtTriangle::from(&source[*t as usize])).collect();
    let build_s = start.elapsed().as_secs_f64();
    let bytes = bvh.bytes_of_nodes() + size_of_val(bvh.triangles()) + size_of_val(triangles.as_slice());
    let tracer = Box::new(Obvhs { bvh, triangles });
    Ok(Contender { name: name.to_owned(), ours: false, tracer, build_s, bytes: Some(bytes as u64) })
}

#[inline(always)]
fn converted(ray: &Ray) -> obvhs::ray::Ray {
    obvhs::ray::Ray::new(Vec3A::from_array(ray.origin), Vec3A::from_array(ray.direction), ray.tmin, ray.tmax)
}

impl<B: Bvh> Tracer for Obvhs<B> {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (ray, hit) in batch.rays.iter().zip(hits) {
            let (ray, mut found) = (converted(ray), RayHit::none());
            self.bvh.nearest(ray, &mut found, &self.triangles);
            *hit = match self.triangles.get(found.primitive_id as usize) {
                None => Hit::MISS,
                Some(triangle) => {
                    let weights = triangle.compute_barycentric(&ray);
                    let triangle = self.bvh.triangles()[found.primitive_id as usize];
                    let primitive = PrimitiveRef { instance: 0, triangle };
                    Hit { t: found.t, u: weights.x, v: weights.y, primitive }
                }
            };
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        for (ray, found) in batch.rays.iter().zip(found) {
            *found = self.bvh.any(converted(ray), &self.triangles);
        }
    }
}
