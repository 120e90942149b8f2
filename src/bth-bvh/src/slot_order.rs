//! The order of a wide node's children in its slots.
//!
//! Queries for the nearest hit sort children by depth. Queries for any hit enter them in the order
//! of the slots, the last slot first, so the last child is the one in which a ray most probably
//! hits a triangle, as in "SATO: Surface Area Traversal Order for Shadow Ray Tracing" (Nah and
//! Manocha 2014). A line that hits a box of surface S hits triangles of area A in it 2 A / S times
//! in the mean (Crofton).

use super::BinaryBvh;
use crate::vectors::{corners, double_area};
use bth_import::Mesh;
use rayon::prelude::*;

/// Sorts children by the area of their triangles over the area of their boxes.
pub(super) struct SlotOrder<'a> {
    bvh: &'a BinaryBvh,
    /// For each row of the BVH's order the sum of the areas of the triangles before it, doubled;
    /// and the sum of all.
    before: Vec<f64>,
}

impl<'a> SlotOrder<'a> {
    pub(super) fn new(mesh: &Mesh, bvh: &'a BinaryBvh) -> Self {
        let area = |&triangle: &u32| double_area(corners(mesh, triangle)).length();
        let areas: Vec<f64> = bvh.order.par_iter().map(area).collect();
        let mut sum = 0.0;
        let mut before = Vec::with_capacity(areas.len() + 1);
        before.push(sum);
        before.extend(areas.into_iter().map(|area| {
            sum += area;
            sum
        }));
        Self { bvh, before }
    }

    /// Sorts children, nodes of the BVH. The last one is the one in which a ray most probably hits
    /// a triangle.
    pub(super) fn sort(&self, children: &mut [u32]) {
        children.sort_by(|a, b| self.density(*a).total_cmp(&self.density(*b)));
    }

    /// The area of the triangles below a node over the area of its box.
    fn density(&self, at: u32) -> f64 {
        let node = &self.bvh.nodes[at as usize];
        let rows = [node.first, node.first + node.count].map(|row| self.before[row as usize]);
        let area = node.half_area();
        if area > 0.0 { (rows[1] - rows[0]) / area } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::soup;
    use super::super::{BvhOptions, build};
    use super::*;
    use bth_import::monitor::Silent;

    #[test]
    fn the_densest_child_is_the_last() {
        let mesh = soup(300, 4);
        let (bvh, _) = build(&mesh, &BvhOptions::default(), &Silent).unwrap();
        let density = |at: u32| {
            let node = &bvh.nodes[at as usize];
            let ids = &bvh.order[node.first as usize..][..node.count as usize];
            ids.iter().map(|id| double_area(corners(&mesh, *id)).length()).sum::<f64>() / node.half_area()
        };
        let mut nodes: Vec<u32> = (0..bvh.nodes.len() as u32).collect();
        SlotOrder::new(&mesh, &bvh).sort(&mut nodes);
        // Differences of sums are rounded relative to the sum of all.
        assert!(nodes.windows(2).all(|pair| density(pair[0]) <= density(pair[1]) * (1.0 + 1e-9)));
        assert!(density(nodes[0]) < 0.5 * density(nodes[nodes.len() - 1]));
    }
}
