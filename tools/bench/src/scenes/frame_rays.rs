//! The rays of a frame: the camera's, and the diffuse bounces after them.

use crate::model::position;
use crate::rays::{Camera, LIFT, cosine_weighted, ray};
use crate::tracer::Batch;
use anyhow::{Context, Result};
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_format::layout::NONE;
use bth_random::Rng;
use glam::DVec3;

/// Diffuse bounces after the camera rays: the default of `bth-play --mode path`.
pub(super) const BOUNCES: u32 = 4;
/// Answers of tracers that round are equal up to this relative difference of t.
const SAME: f32 = 1e-4;

/// Rays of one kind.
pub(super) struct FrameRaySet {
    pub(super) rays: Vec<Ray>,
    coherent: bool,
    /// The answers of our plain BVH.
    expected: Vec<Hit>,
}

impl FrameRaySet {
    fn of(scene: &Scene, rays: Vec<Ray>, coherent: bool) -> FrameRaySet {
        let mut expected = vec![Hit::MISS; rays.len()];
        scene.batch(&rays).nearest(&mut expected);
        FrameRaySet { rays, coherent, expected }
    }

    pub(super) fn batch(&self) -> Batch<'_> {
        Batch { rays: &self.rays, starts: None, coherent: self.coherent }
    }

    /// Number of answers that differ: in any bit if they must be exact, else in hit or miss or in
    /// t.
    pub(super) fn differences(&self, hits: &[Hit], exact: bool) -> u64 {
        let near = |a: &Hit, b: &Hit| a.is_hit() && b.is_hit() && (a.t - b.t).abs() <= SAME * a.t.abs();
        let same = |a: &Hit, b: &Hit| a == b || !exact && (near(a, b) || !a.is_hit() && !b.is_hit());
        self.expected.iter().zip(hits).filter(|(a, b)| !same(a, b)).count() as u64
    }
}

/// The rays of a scene's camera at the scene's time, by [`super::SETS`].
pub(super) fn frame_rays(scene: &Scene, size: (u32, u32)) -> Result<Vec<FrameRaySet>> {
    let (camera, diagonal) = camera(scene, size)?;
    let (mut rng, lift) = (Rng::new(1), LIFT * diagonal);
    let first = FrameRaySet::of(scene, camera.rays(), true);
    let second = FrameRaySet::of(scene, onward(scene, &first.rays, &first.expected, lift, &mut rng), false);
    let mut later = Vec::new();
    let (mut rays, mut hits) = (second.rays.clone(), second.expected.clone());
    for _ in 1..BOUNCES {
        let set = FrameRaySet::of(scene, onward(scene, &rays, &hits, lift, &mut rng), false);
        later.extend(&set.rays);
        (rays, hits) = (set.rays, set.expected);
    }
    Ok(vec![first, second, FrameRaySet::of(scene, later, false)])
}

/// The first camera of the scene, or one that frames all of it; and the diagonal of the visible
/// instances' box.
fn camera(scene: &Scene, size: (u32, u32)) -> Result<(Camera, f64)> {
    let view = scene.description().context("a scene")?;
    let (framing, diagonal) = Camera::framing_instances(scene, size).context("nothing is to be seen")?;
    let row = if view.scene[0].camera == NONE { 0 } else { view.scene[0].camera };
    let Some(lens) = view.cameras.get(row as usize) else { return Ok((framing, diagonal)) };
    let (rows, _) = scene.node(lens.node);
    let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
    let tangent = (lens.size / 2.0).to_radians().tan();
    let camera = Camera { eye: column(3), target: column(3) - column(2), tangent, size };
    Ok((camera, diagonal))
}

/// Cosine-weighted rays from a little off the hits of other rays.
fn onward(scene: &Scene, rays: &[Ray], hits: &[Hit], lift: f64, rng: &mut Rng) -> Vec<Ray> {
    let onward = rays.iter().zip(hits).filter(|(_, hit)| hit.is_hit()).map(|(from, hit)| {
        let direction = position(from.direction);
        let object = scene.object_of(hit.primitive.instance);
        let (triangles, positions) = (scene.object(object).triangles, scene.positions(object));
        let [a, b, c] = triangles[hit.primitive.triangle as usize].map(|v| position(positions[v as usize]));
        let normal = scene.normal_to_world(hit.primitive.instance, (b - a).cross(c - a).to_array());
        let normal = DVec3::from_array(normal).normalize();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let point = position(from.origin) + direction * f64::from(hit.t) + normal * lift;
        ray(point, cosine_weighted(rng, normal), f64::INFINITY)
    });
    onward.collect()
}
