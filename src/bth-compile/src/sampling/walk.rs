//! Rays through the binary BVH in double precision: their nearest hits and the nodes that they enter. The counts are the
//! same on every machine, whatever its vector instructions.

use super::rays::{SampleRay, enters};
use crate::bvh::BinaryBvh;
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

/// Traces a ray from the root, the nearer child first, to the nearest hit; `entered` is called with every node entered.
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

/// t of the intersection of a ray and a triangle within (0, best] (Möller and Trumbore 1997, "Fast, Minimum Storage
/// Ray-Triangle Intersection").
pub(crate) fn crosses(ray: &SampleRay, [a, b, c]: [DVec3; 3], best: f64) -> Option<f64> {
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
