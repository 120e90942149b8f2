//! Planted contacts and a plain BVH for the tests of this stage.

use bth_bvh::testing::weld;
use bth_bvh::{BinaryBvh, Node};
use bth_import::Mesh;

fn has_area(corners: [[f32; 3]; 3]) -> bool {
    super::coplanar::Projection::of(corners).is_some()
}

/// Splits at the median centroid of the longest axis, down to single triangles.
pub(super) fn median_bvh(mesh: &Mesh) -> BinaryBvh {
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

/// A small mesh with known contacts.
pub(super) struct Planted {
    pub(super) name: String,
    pub(super) mesh: Mesh,
    pub(super) bad: Vec<u32>,
    pub(super) pairs: u64,
}

/// The planted contacts of `tools/crosscheck/planted.json`, which the cross-check with other
/// programs uses too.
pub(super) fn planted() -> Vec<Planted> {
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
