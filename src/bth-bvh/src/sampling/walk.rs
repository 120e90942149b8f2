//! Rays through the binary BVH in double precision: their nearest hits and the nodes that they
//! enter. The counts are the same on every machine, whatever its vector instructions.

use super::rays::{SampleRay, enters};
use crate::BinaryBvh;
use crate::vectors::corners;
use bth_import::Mesh;
use glam::DVec3;

/// Result of tracing a ray through the binary BVH.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traced {
    /// Row of the BVH's order that was hit, and t of the hit.
    pub hit: Option<(u32, f64)>,
    /// Nodes whose boxes the ray entered, leaves included.
    pub visits: u32,
}

/// Traces a ray from the root, the nearer child first, to the nearest hit; `entered` is called with
/// every node entered.
pub fn walk(mesh: &Mesh, bvh: &BinaryBvh, ray: &SampleRay, mut entered: impl FnMut(u32)) -> Traced {
    let mut traced = Traced { hit: None, visits: 0 };
    let mut best = ray.tmax;
    let meets = |node: u32, best: f64| {
        let node = &bvh.nodes[node as usize];
        enters(ray, node.lower, node.upper, best)
    };
    let mut stack: Vec<(u32, f64)> = Vec::with_capacity(64);
    if !bvh.nodes.is_empty()
        && let Some(near) = meets(0, best)
    {
        stack.push((0, near));
    }
    while let Some((at, near)) = stack.pop() {
        if near > best {
            continue;
        }
        entered(at);
        traced.visits += 1;
        let node = &bvh.nodes[at as usize];
        if node.is_leaf() {
            if let Some(t) = crosses(ray, corners(mesh, bvh.order[node.first as usize]), best) {
                best = t;
                traced.hit = Some((node.first, t));
            }
            continue;
        }
        let [left, right] = [at + 1, node.right].map(|child| meets(child, best).map(|t| (child, t)));
        match (left, right) {
            (Some(a), Some(b)) if a.1 <= b.1 => stack.extend([b, a]),
            (Some(a), Some(b)) => stack.extend([a, b]),
            (one, other) => stack.extend(one.or(other)),
        }
    }
    traced
}

/// Nodes that all sample rays of a stage together may enter. With ordinary models they enter a
/// fifth of this number.
const MOST_ENTERED: u64 = 1 << 24;
/// Rays by which it is estimated how many nodes all enter.
const ESTIMATED_BY: usize = 64;

/// Returns the rays, or an evenly spaced part of them if all would enter more nodes than a stage
/// has time for. Where many triangles lie in one place, each ray enters the nodes of all.
pub fn affordable(mesh: &Mesh, bvh: &BinaryBvh, rays: Vec<SampleRay>) -> Vec<SampleRay> {
    let spaced = rays.iter().step_by(rays.len().div_ceil(ESTIMATED_BY).max(1));
    let (count, entered) = spaced.fold((0u64, 0u64), |(count, entered), ray| {
        (count + 1, entered + u64::from(walk(mesh, bvh, ray, |_| ()).visits))
    });
    let all = entered / count.max(1) * rays.len() as u64;
    match usize::try_from(all.div_ceil(MOST_ENTERED)).unwrap_or(usize::MAX) {
        0 | 1 => rays,
        step => rays.into_iter().step_by(step).collect(),
    }
}

/// t of the intersection of a ray and a triangle within (0, best] (Möller and Trumbore 1997, "Fast,
/// Minimum Storage Ray-Triangle Intersection").
pub fn crosses(ray: &SampleRay, [a, b, c]: [DVec3; 3], best: f64) -> Option<f64> {
    let (e1, e2) = (b - a, c - a);
    let direction = DVec3::from(ray.direction);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let from = DVec3::from(ray.origin) - a;
    let q = from.cross(e1);
    let (u, v) = (from.dot(p) / determinant, direction.dot(q) / determinant);
    let t = e2.dot(q) / determinant;
    // Comparisons with the NaN of a zero determinant are false.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t <= best).then_some(t)
}
