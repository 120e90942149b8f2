//! Meshes, planted contacts and a plain BVH for the tests of this stage.

use crate::bvh::{BinaryBvh, Node};
use bth_import::Mesh;
use bth_random::Rng;
use std::collections::HashMap;

/// Welds bit-equal positions.
pub(crate) fn weld(corners: &[[[f32; 3]; 3]]) -> Mesh {
    let mut mesh = Mesh::default();
    let mut rows = HashMap::new();
    for t in corners {
        let t = t.map(|p| {
            let p = p.map(|x| x + 0.0);
            *rows.entry(p.map(f32::to_bits)).or_insert_with(|| {
                mesh.positions.push(p);
                mesh.positions.len() as u32 - 1
            })
        });
        mesh.triangles.push(t);
    }
    mesh
}

fn has_area(corners: [[f32; 3]; 3]) -> bool {
    super::coplanar::Projection::of(corners).is_some()
}

/// Splits at the median centroid of the longest axis, down to single triangles.
pub(crate) fn median_bvh(mesh: &Mesh) -> BinaryBvh {
    let mut bvh = BinaryBvh { nodes: Vec::new(), order: Vec::new() };
    bvh.order = (0..mesh.triangles.len() as u32).filter(|&i| has_area(mesh.corners(i))).collect();
    let mut order = std::mem::take(&mut bvh.order);
    if !order.is_empty() {
        split(mesh, &mut bvh.nodes, &mut order, 0);
    }
    bvh.order = order;
    bvh
}

fn split(mesh: &Mesh, nodes: &mut Vec<Node>, order: &mut [u32], first: u32) {
    let (mut lower, mut upper) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in order.iter().flat_map(|&t| mesh.corners(t)) {
        for k in 0..3 {
            lower[k] = lower[k].min(p[k]);
            upper[k] = upper[k].max(p[k]);
        }
    }
    let i = nodes.len();
    nodes.push(Node { lower, upper, first, count: order.len() as u32, right: 0 });
    if order.len() > 1 {
        let k = (0..3).max_by(|&a, &b| (upper[a] - lower[a]).total_cmp(&(upper[b] - lower[b]))).unwrap_or(0);
        let centre = |t: u32| mesh.corners(t).iter().map(|p| f64::from(p[k])).sum::<f64>();
        order.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)));
        let half = order.len() / 2;
        let (left, right) = order.split_at_mut(half);
        split(mesh, nodes, left, first);
        nodes[i].right = nodes.len() as u32;
        split(mesh, nodes, right, first + half as u32);
    }
}

/// A random mesh on a small grid of points: connected fans and loose triangles, many of which touch.
pub(crate) fn patch(seed: u64, triangles: usize) -> Mesh {
    let mut random = Rng::new(seed);
    let side = 3 + random.below(12);
    let mut point = || [0; 3].map(|_: i32| random.below(side) as f32);
    let mut corners: Vec<[[f32; 3]; 3]> = Vec::new();
    while corners.len() < triangles {
        let (a, b, c) = (point(), point(), point());
        corners.push([a, b, c]);
        // Add a neighbour across an edge and one at a corner.
        let (d, e) = (point(), point());
        corners.extend([[b, a, d], [a, d, e]]);
    }
    weld(&corners)
}

/// A latitude-longitude sphere of `2 n (n - 1)` triangles, closed and free of contacts.
pub(crate) fn sphere(n: u32, centre: [f32; 3]) -> Mesh {
    let at = |i: u32, j: u32| {
        let (theta, phi) = (
            std::f64::consts::PI * f64::from(i) / f64::from(n),
            std::f64::consts::TAU * f64::from(j % n) / f64::from(n),
        );
        let s = if i == 0 || i == n { 0.0 } else { theta.sin() };
        let p = [s * phi.cos(), s * phi.sin(), theta.cos()];
        [0, 1, 2].map(|k| p[k] as f32 + centre[k])
    };
    let mut corners = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i + 1 < n {
                corners.push([a, b, c]);
            }
            if i > 0 {
                corners.push([a, c, d]);
            }
        }
    }
    weld(&corners)
}

/// A small mesh with known contacts.
pub(crate) struct Planted {
    pub(crate) name: String,
    pub(crate) mesh: Mesh,
    pub(crate) bad: Vec<u32>,
    pub(crate) pairs: u64,
}

/// The planted contacts of `tools/crosscheck/planted.json`, which the cross-check with other programs uses too.
pub(crate) fn planted() -> Vec<Planted> {
    #[derive(serde::Deserialize)]
    struct Case {
        name: String,
        triangles: Vec<[[f32; 3]; 3]>,
        bad: Vec<u32>,
        pairs: u64,
    }
    let text = include_str!("../../../../tools/crosscheck/planted.json");
    let cases: Vec<Case> = serde_json::from_str(text).expect("a list of planted contacts");
    cases
        .into_iter()
        .map(|c| Planted { name: c.name, mesh: weld(&c.triangles), bad: c.bad, pairs: c.pairs })
        .collect()
}
