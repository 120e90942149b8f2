//! A binary BVH as in pbrt that may have tetrahedralizations as leaves: the paper's BTH
//! (§3), and without any its BVH.
//!
//! Nodes take 32 bytes, the first child follows its parent, traversal visits the nearer child by
//! the sign of the direction along the axis of the split (Pharr, Jakob and Humphreys 2016, §4.3.4),
//! leaves hold up to four triangles.

use super::tet_records::Tets;
use super::tet_walk::{End, Plane};
use crate::moller_trumbore::moller_trumbore;
use crate::tracer::{Batch, Tracer};
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::bvh::{self, BinaryBvh};
use bth_compile::tets::TetMesh;
use bth_import::Mesh;

/// How the binary BVH is built: binned and top-down, as the paper has it.
pub(super) fn bvh_options() -> bvh::BvhOptions {
    bvh::BvhOptions { quality: bvh::Quality::Fast, ..Default::default() }
}

/// Most triangles of a leaf (pbrt's default).
const LEAF: u32 = 4;
/// Cost of a step down, if a triangle costs 1 (pbrt, §4.3.2).
const STEP_COST: f64 = 0.125;
/// Set in `count` where a leaf is a tetrahedralization.
const TETS: u16 = u16::MAX;

#[derive(Clone, Copy, Debug)]
#[repr(C)]
struct PbrtNode {
    lower: [f32; 3],
    upper: [f32; 3],
    /// First triangle or row of the tetrahedralization; of an inner node its second child.
    offset: u32,
    /// Triangles; 0 for inner nodes.
    count: u16,
    axis: u8,
    unused: u8,
}

const _: () = assert!(size_of::<PbrtNode>() == 32);

/// The structure.
pub(super) struct PaperTree<const STORED: usize> {
    nodes: Vec<PbrtNode>,
    /// Corners in the order of the leaves, as pbrt's leaves hold them, with the triangle's id.
    triangles: Vec<([[f32; 3]; 3], u32)>,
    leaves: Vec<Tets<STORED>>,
    /// For each camera: the tetrahedron of each leaf that holds its eye.
    cameras: Vec<([f32; 3], Vec<Option<u32>>)>,
}

impl<const STORED: usize> PaperTree<STORED> {
    /// Flattens a binary BVH of single triangles; `built` are nodes in ascending order that become
    /// tet leaves.
    pub(super) fn new(mesh: &Mesh, bvh: &BinaryBvh, built: &[(u32, TetMesh)]) -> PaperTree<STORED> {
        let mut tree = PaperTree {
            nodes: Vec::new(),
            triangles: Vec::new(),
            leaves: built.iter().map(|(_, tets)| Tets::new(tets)).collect(),
            cameras: Vec::new(),
        };
        if !bvh.nodes.is_empty() {
            let cost = costs(bvh, built);
            tree.flatten(mesh, bvh, built, &cost, 0);
        }
        tree
    }

    fn flatten(&mut self, mesh: &Mesh, bvh: &BinaryBvh, built: &[(u32, TetMesh)], cost: &[f64], at: u32) {
        let node = &bvh.nodes[at as usize];
        let mut flat =
            PbrtNode { lower: node.lower, upper: node.upper, offset: 0, count: 0, axis: 0, unused: 0 };
        if let Ok(row) = built.binary_search_by_key(&at, |b| b.0) {
            (flat.offset, flat.count) = (row as u32, TETS);
            self.nodes.push(flat);
            return;
        }
        let holds_tets = built.iter().any(|b| (at..at + 2 * node.count - 1).contains(&b.0));
        if node.is_leaf() || node.count <= LEAF && !holds_tets && cost[at as usize] >= f64::from(node.count) {
            (flat.offset, flat.count) = (self.triangles.len() as u32, node.count as u16);
            let rows = &bvh.order[node.first as usize..(node.first + node.count) as usize];
            self.triangles.extend(rows.iter().map(|&t| (mesh.corners(t), t)));
            self.nodes.push(flat);
            return;
        }
        let (left, right) = (at + 1, node.right);
        let middle = |i: u32, k: usize| bvh.nodes[i as usize].lower[k] + bvh.nodes[i as usize].upper[k];
        let apart = |k: &usize| (middle(left, *k) - middle(right, *k)).abs();
        let axis = (0..3).max_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(0);
        // The child at lower coordinates comes first.
        let (first, second) =
            if middle(left, axis) <= middle(right, axis) { (left, right) } else { (right, left) };
        flat.axis = axis as u8;
        let here = self.nodes.len();
        self.nodes.push(flat);
        self.flatten(mesh, bvh, built, cost, first);
        self.nodes[here].offset = self.nodes.len() as u32;
        self.flatten(mesh, bvh, built, cost, second);
    }

    /// Finds the tetrahedra that hold the eye of a camera, once for all of its rays.
    pub(super) fn look_from(&mut self, eye: [f32; 3]) {
        let holding = self.leaves.iter().map(|tets| tets.holding(eye)).collect();
        self.cameras.push((eye, holding));
    }

    /// Bytes that traversal reads.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + self.leaves.iter().map(Tets::bytes).sum::<usize>()
    }

    fn trace(&self, ray: &Ray) -> Hit {
        let mut best = Hit { t: ray.tmax, ..Hit::MISS };
        let inverse = ray.direction.map(|d| 1.0 / d);
        let negative = inverse.map(|d| d < 0.0);
        let mut plane = None;
        let mut stack = [0u32; 96];
        let (mut top, mut at) = (0, 0usize);
        if self.nodes.is_empty() {
            return Hit::MISS;
        }
        loop {
            let node = &self.nodes[at];
            if meets(node, ray, &inverse, &negative, best.t) {
                if node.count == 0 {
                    // Visit the nearer child first.
                    let (near, far) = (at as u32 + 1, node.offset);
                    let (now, later) =
                        if negative[usize::from(node.axis)] { (far, near) } else { (near, far) };
                    stack[top] = later;
                    top += 1;
                    at = now as usize;
                    continue;
                }
                if node.count == TETS {
                    let plane = plane.get_or_insert_with(|| Plane::new(ray));
                    self.enter(ray, plane, node.offset, &mut best);
                } else {
                    let first = node.offset as usize;
                    for (corners, id) in &self.triangles[first..first + usize::from(node.count)] {
                        if let Some(hit) = moller_trumbore(ray, *corners, best.t) {
                            best = Hit {
                                t: hit.t,
                                primitive: PrimitiveRef { instance: 0, triangle: *id },
                                ..best
                            };
                        }
                    }
                }
            }
            if top == 0 {
                break;
            }
            top -= 1;
            at = stack[top] as usize;
        }
        if best.primitive == PrimitiveRef::NONE { Hit::MISS } else { best }
    }

    #[inline(always)]
    fn enter(&self, ray: &Ray, plane: &Plane, leaf: u32, best: &mut Hit) {
        let tets = &self.leaves[leaf as usize];
        let camera = self.cameras.iter().find(|(eye, _)| *eye == ray.origin);
        let end = match camera.and_then(|(_, holding)| holding[leaf as usize]) {
            Some(tet) => tets.start(ray, plane, tet, best.t),
            None => tets.enter(ray, plane, best.t),
        };
        let hit = match end {
            End::Face(row, t) => Some((row, t)),
            End::Left => None,
            End::Lost => {
                // A walk that rounding errors led astray: all faces are tested instead.
                let corners = |row: usize| tets.faces[row].1.map(|v| tets.vertices[v as usize]);
                let found = (0..tets.faces.len())
                    .filter_map(|r| Some((r as u32, moller_trumbore(ray, corners(r), best.t)?.t)));
                found.min_by(|a, b| a.1.total_cmp(&b.1))
            }
        };
        if let Some((row, t)) = hit {
            let triangle = tets.faces[row as usize].0;
            *best = Hit { t, primitive: PrimitiveRef { instance: 0, triangle }, ..*best };
        }
    }
}

/// pbrt's test of a box, with its factor against rounding.
#[inline(always)]
fn meets(node: &PbrtNode, ray: &Ray, inverse: &[f32; 3], negative: &[bool; 3], best: f32) -> bool {
    const ROUNDING: f32 = 1.0 + 2.0 * (3.0 * f32::EPSILON / 2.0);
    let (mut near, mut far) = (ray.tmin, best);
    for k in 0..3 {
        let (a, b) =
            if negative[k] { (node.upper[k], node.lower[k]) } else { (node.lower[k], node.upper[k]) };
        near = near.max((a - ray.origin[k]) * inverse[k]);
        far = far.min((b - ray.origin[k]) * inverse[k] * ROUNDING);
    }
    near <= far
}

/// Cost of each node by the surface area heuristic, in units of a triangle's test; leaves of
/// tetrahedra cost nothing, so that they are kept.
fn costs(bvh: &BinaryBvh, built: &[(u32, TetMesh)]) -> Vec<f64> {
    let area = |i: usize| {
        let node = &bvh.nodes[i];
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(node.upper[k]) - f64::from(node.lower[k]));
        x * y + y * z + z * x
    };
    let mut cost = vec![1.0; bvh.nodes.len()];
    for i in (0..bvh.nodes.len()).rev() {
        let node = &bvh.nodes[i];
        if built.binary_search_by_key(&(i as u32), |b| b.0).is_ok() {
            cost[i] = 0.0;
        } else if !node.is_leaf() {
            let (l, r) = (i + 1, node.right as usize);
            let split = STEP_COST + (area(l) * cost[l] + area(r) * cost[r]) / area(i);
            cost[i] = if node.count <= LEAF { split.min(f64::from(node.count)) } else { split };
        }
    }
    cost
}

impl<const STORED: usize> Tracer for PaperTree<STORED> {
    fn nearest(&self, batch: Batch<'_>, hits: &mut [Hit]) {
        for (ray, hit) in batch.rays.iter().zip(hits) {
            *hit = self.trace(ray);
        }
    }

    fn any(&self, batch: Batch<'_>, found: &mut [bool]) {
        for (ray, found) in batch.rays.iter().zip(found) {
            *found = self.trace(ray).is_hit();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tet_records::{TET20, TET32};
    use super::*;
    use bth_compile::{Silent, bvh, sampling, tets};

    /// Compares hits with the nearest of all triangles; `eye`: rays from one point
    /// within.
    fn agrees<const STORED: usize>(mesh: &Mesh, tree: &PaperTree<STORED>, rays: &[Ray]) {
        let mut hits = 0;
        for ray in rays {
            let all = (0..mesh.triangles.len() as u32)
                .filter_map(|t| moller_trumbore(ray, mesh.corners(t), f32::INFINITY))
                .map(|hit| hit.t)
                .fold(f32::INFINITY, f32::min);
            let found = tree.trace(ray);
            assert_eq!(found.is_hit(), all.is_finite(), "{ray:?}");
            if all.is_finite() {
                hits += 1;
                assert!((found.t - all).abs() <= 1e-4 * all.max(0.1), "{} for {all}", found.t);
            }
        }
        assert!(hits > 50, "{hits}");
    }

    #[test]
    fn all_structures_find_the_nearest_triangle_from_outside_and_within() {
        let model = bth_scenes::gyroid::gyroid(1500);
        let mesh = Mesh { positions: model.positions, triangles: model.triangles, ..Mesh::default() };
        let (bvh, _) = bvh::build(&mesh, &bvh::BvhOptions::default(), &Silent).unwrap();
        let root = &bvh.nodes[0];
        let outside: Vec<Ray> = sampling::outside(root.lower, root.upper, 150, 1)
            .iter()
            .map(|s| Ray::new(s.origin.map(|x| x as f32), s.direction.map(|x| x as f32)))
            .collect();
        let eye: [f32; 3] = std::array::from_fn(|k| 0.43 * root.lower[k] + 0.57 * root.upper[k]);
        let inside: Vec<Ray> = outside.iter().map(|r| Ray { origin: eye, ..*r }).collect();
        agrees(&mesh, &PaperTree::<TET20>::new(&mesh, &bvh, &[]), &outside);

        let parts = [1, bvh.nodes[0].right];
        for chosen in [&[0][..], &parts[..]] {
            let (built, report) =
                tets::build(&mesh, &bvh, chosen, &tets::TetOptions::default(), &Silent).unwrap();
            if let tets::WorkerStatus::Missing { .. } = report.worker {
                crate::output::note("skipped: walks through tetrahedra need the worker bth-tetgen");
                return;
            }
            assert_eq!(built.len(), chosen.len());
            let mut wide = PaperTree::<TET32>::new(&mesh, &bvh, &built);
            let mut small = PaperTree::<TET20>::new(&mesh, &bvh, &built);
            wide.look_from(eye);
            small.look_from(eye);
            for rays in [&outside, &inside] {
                agrees(&mesh, &wide, rays);
                agrees(&mesh, &small, rays);
            }
        }
    }
}
