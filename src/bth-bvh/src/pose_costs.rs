//! The cost of a wide BVH in each pose.

use super::bounds::Bounds;
use super::{Costs, Poses, Wide};
use bth_format::layout::{Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, RAW_LINES, RawLeaf, WideNode};
use bth_import::Mesh;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Expected work of a random line through the root's box in one pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseCost {
    /// Wide nodes that it meets.
    pub nodes: f64,
    /// Triangle leaves that it meets.
    pub leaves: f64,
    /// Their cost; see [`Costs`], without the price of lines.
    pub cost: f64,
}

/// The cost of a wide BVH without tet leaves, refitted to each pose. Zeros where the root has no area.
pub fn pose_costs(mesh: &Mesh, wide: &Wide, costs: &Costs, poses: &Poses<'_>) -> Vec<PoseCost> {
    let one = |pose: usize| {
        let mut sum = Sum { mesh, wide, costs, positions: poses.positions(pose), total: PoseCost::default() };
        let root = Child::from_code(wide.root).map_or(0.0, |root| sum.child(root).half_area());
        let PoseCost { nodes, leaves, cost } = sum.total;
        match root > 0.0 {
            true => PoseCost { nodes: nodes / root, leaves: leaves / root, cost: cost / root },
            false => PoseCost::default(),
        }
    };
    (0..poses.len()).into_par_iter().map(one).collect()
}

/// Sums of areas in one pose.
struct Sum<'a> {
    mesh: &'a Mesh,
    wide: &'a Wide,
    costs: &'a Costs,
    positions: &'a [[f32; 3]],
    total: PoseCost,
}

impl Sum<'_> {
    /// Adds the subtree of a child and returns its bounds. The depth of the recursion is that of the tree, at most
    /// [`MAX_LEVELS`](super::MAX_LEVELS).
    fn child(&mut self, child: Child) -> Bounds {
        match child {
            Child::Node(line) => {
                let node: &WideNode = at(self.wide, line, NODE_LINES);
                let children: Vec<Child> =
                    node.child.iter().filter_map(|code| Child::from_code(*code)).collect();
                let bounds =
                    children.into_iter().fold(Bounds::EMPTY, |all, child| all.union(&self.child(child)));
                self.total.nodes += bounds.half_area();
                self.total.cost += bounds.half_area() * f64::from(self.costs.node);
                bounds
            }
            Child::Indexed(line) => {
                let leaf: &IndexedLeaf = at(self.wide, line, INDEXED_LINES);
                self.leaf(leaf.first, leaf.triangles, self.costs.indexed)
            }
            Child::Raw(line) => {
                let leaf: &RawLeaf = at(self.wide, line, RAW_LINES);
                self.leaf(leaf.first, leaf.triangles, self.costs.raw)
            }
            Child::Tets(_) => unreachable!("the collapse of a mesh that deforms cuts no nodes"),
        }
    }

    fn leaf(&mut self, first: u32, count: u32, [entry, each]: [f32; 2]) -> Bounds {
        let ids = &self.wide.triangle_ids[first as usize..][..count as usize];
        let corners =
            ids.iter().map(|id| self.mesh.triangles[*id as usize].map(|row| self.positions[row as usize]));
        let bounds = corners.fold(Bounds::EMPTY, |all, corners| all.union(&Bounds::of_points(&corners)));
        self.total.leaves += bounds.half_area();
        self.total.cost += bounds.half_area() * f64::from(entry + each * count as f32);
        bounds
    }
}

/// A structure at a line.
fn at<T: FromBytes + KnownLayout + Immutable>(wide: &Wide, line: u32, lines: usize) -> &T {
    T::ref_from_bytes(wide.lines[line as usize..][..lines].as_bytes())
        .expect("a structure that the collapse wrote")
}
