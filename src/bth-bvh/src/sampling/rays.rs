//! Sample rays, which represent the rays of a renderer: uniform lines from outside, rays from
//! surfaces, and rays from points within.

use crate::vectors::{corners, double_area, uniform_direction, unit};
use crate::{BinaryBvh, Node};
use bth_import::Mesh;
use bth_random::Rng;
use glam::DVec3;
use rayon::prelude::*;

/// A sampled ray, object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleRay {
    /// Origin.
    pub origin: [f64; 3],
    /// A unit vector.
    pub direction: [f64; 3],
    /// Length, in the units of the object; infinite for rays without an end.
    pub tmax: f64,
    /// Triangle on which the ray starts; `None` for rays from outside.
    pub from: Option<u32>,
}

/// Length of rays for ambient occlusion, relative to the diagonal of the bounds.
const SHORT: f64 = 0.05;
/// Offset of ray origins from the surface that they start on, relative to the diagonal of the
/// bounds.
const BOUNCE_LIFT: f64 = 2e-5;

/// The point at `t` on a ray.
pub fn along(ray: &SampleRay, t: f64) -> [f64; 3] {
    (DVec3::from(ray.origin) + t * DVec3::from(ray.direction)).into()
}

/// Length of a box's diagonal.
fn diagonal(node: &Node) -> f64 {
    (DVec3::from(node.upper.map(f64::from)) - DVec3::from(node.lower.map(f64::from))).length()
}

/// Lines that are uniform in space (chords of the ball around the box), which start outside the box
/// and hit it: the rays of the surface area heuristic and of Cauchy and Crofton.
pub fn outside(lower: [f32; 3], upper: [f32; 3], count: usize, seed: u64) -> Vec<SampleRay> {
    let mut random = Rng::new(seed);
    let ends = [lower, upper].map(|end| DVec3::from(end.map(f64::from)));
    let middle = 0.5 * (ends[0] + ends[1]);
    let radius = (0.5 * (ends[1] - ends[0])).length();
    let mut rays = Vec::with_capacity(count);
    // No chord hits a box of zero size, and few hit a flat box; hence the limit on attempts.
    for _ in 0..64 * count {
        if rays.len() == count || radius == 0.0 {
            break;
        }
        let [p, q] = [(); 2].map(|()| middle + 1.01 * radius * uniform_direction(&mut random));
        let (origin, direction) = (p.into(), unit(q - p).into());
        let ray = SampleRay { origin, direction, tmax: f64::INFINITY, from: None };
        if ray.direction[0].is_finite() && enters(&ray, lower, upper, f64::INFINITY).is_some() {
            rays.push(ray);
        }
    }
    rays
}

/// Rays in uniform directions from uniform points of a box. All rays of a point follow each other.
pub fn within(
    lower: [f32; 3],
    upper: [f32; 3],
    [points, rays_a_point]: [usize; 2],
    seed: u64,
) -> Vec<SampleRay> {
    let mut random = Rng::new(seed);
    let mut rays = Vec::with_capacity(points * rays_a_point);
    for _ in 0..points {
        let origin = [0, 1, 2].map(|k| random.between(f64::from(lower[k]), f64::from(upper[k])));
        rays.extend((0..rays_a_point).map(|_| {
            let direction = uniform_direction(&mut random).into();
            SampleRay { origin, direction, tmax: f64::INFINITY, from: None }
        }));
    }
    rays
}

/// Rays from the fronts of triangles of these rows of the BVH's order, chosen by area,
/// cosine-weighted about the normal; every second one as short as rays for ambient occlusion.
/// Closed models and rooms are seen from the fronts of their triangles. The rays are stratified
/// along the order, so that consecutive rays start close together, as in a renderer.
pub fn from_surface(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    rows: std::ops::Range<usize>,
    count: usize,
    seed: u64,
) -> Vec<SampleRay> {
    let Some(root) = bvh.nodes.first() else { return Vec::new() };
    let (mut random, diagonal) = (Rng::new(seed), diagonal(root));
    let triangles = &bvh.order[rows];
    let normal = |triangle: u32| double_area(corners(mesh, triangle));
    let mut sums: Vec<f64> = triangles.par_iter().map(|&t| normal(t).length()).collect();
    let mut total = 0.0;
    for sum in &mut sums {
        total += *sum;
        *sum = total;
    }
    if !(total > 0.0 && total.is_finite()) {
        return Vec::new();
    }
    let mut rays = Vec::with_capacity(count);
    for i in 0..count {
        let at = (i as f64 + random.unit_f64()) / count as f64 * total;
        let triangle = triangles[sums.partition_point(|sum| *sum <= at).min(triangles.len() - 1)];
        let [a, b, c] = corners(mesh, triangle);
        let n = unit(normal(triangle));
        // Uniform in the triangle by folding the parallelogram.
        let (mut u, mut v) = (random.unit_f64(), random.unit_f64());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let lift = BOUNCE_LIFT * diagonal;
        let origin = a + u * (b - a) + v * (c - a) + lift * n;
        let direction = unit(n + uniform_direction(&mut random));
        let tmax = if i % 2 == 0 { f64::INFINITY } else { SHORT * diagonal };
        if direction.is_finite() && origin.is_finite() {
            let (origin, direction) = (origin.into(), direction.into());
            rays.push(SampleRay { origin, direction, tmax, from: Some(triangle) });
        }
    }
    rays
}

/// The t at which a ray enters a box; `None` if it misses the box or enters it beyond `limit`. The
/// origin may lie in the box.
pub(super) fn enters(ray: &SampleRay, lower: [f32; 3], upper: [f32; 3], limit: f64) -> Option<f64> {
    let (mut near, mut far) = (0.0f64, limit.min(ray.tmax));
    for k in 0..3 {
        let (lower, upper) = (f64::from(lower[k]) - ray.origin[k], f64::from(upper[k]) - ray.origin[k]);
        if ray.direction[k] == 0.0 {
            if lower > 0.0 || upper < 0.0 {
                return None;
            }
            continue;
        }
        let inverse = 1.0 / ray.direction[k];
        let (a, b) = (lower * inverse, upper * inverse);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near <= far).then_some(near)
}
