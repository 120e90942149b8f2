//! Rebuilds small parts of the binary BVH, treelets, where the wide tree that is collapsed from it
//! then costs less.
//!
//! Reinsertion lowers the cost of the binary tree, most of whose nodes vanish in the collapse. Here
//! the plan of the wide tree is made first. One round then rebuilds subtrees of few triangles
//! (`small`), whose leaves may share more vertices. The other rounds rebuild what lies below each
//! wide node (`wide`), and join its children again (`agglomerate`). The present plan remains
//! possible in every new tree, so by areas the cost of the wide tree never rises.
//!
//! After the treelets of "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies"
//! (Karras and Aila 2013), with the cost of the wide tree instead of the binary one.

mod agglomerate;
mod small;
mod wide;

use super::build::levels;
use super::plan::{Costs, Planner};
use super::poses::Weighed;
use super::{BinaryBvh, BvhReport, MAX_LEVELS, Node};
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;

/// Trees of fewer nodes are one or two wide nodes, whatever is done.
const LEAST_NODES: usize = 64;

/// Rebuilds treelets in `rounds` rounds. `visits` gives for each node of a tree the probability
/// that a ray enters it, by which its wide tree is planned.
///
/// # Errors
/// [`bth_import::Error::Cancelled`].
pub fn rebuild_treelets(
    mesh: &Mesh,
    mut bvh: BinaryBvh,
    rounds: usize,
    visits: &dyn Fn(&BinaryBvh) -> Vec<f64>,
    report: &mut BvhReport,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    if rounds == 0 || bvh.nodes.len() < LEAST_NODES {
        return Ok(bvh);
    }
    monitor.stage("treelets", Some(rounds as u64));
    for round in 0..rounds {
        monitor.check()?;
        let probabilities = visits(&bvh);
        let weighed = Weighed { bvh: &bvh, probabilities: Some(&probabilities) };
        let planner = Planner::new(mesh, weighed, Costs::default(), monitor);
        let (decisions, _) = planner.run(&[])?;
        let count = if round == 0 {
            let found = small::find(&planner, &decisions)?;
            drop((decisions, probabilities));
            found.iter().for_each(|(at, part)| small::replace(&mut bvh, *at, part));
            found.len() as u64
        } else {
            let (rebuilt, count) = wide::rebuild(&bvh, &decisions, monitor)?;
            // A deeper tree could not be traversed.
            if levels(&rebuilt) > MAX_LEVELS {
                break;
            }
            bvh = rebuilt;
            count
        };
        report.treelets.push(count);
        monitor.advance(1);
    }
    report.visits.push(super::visits(&bvh));
    report.levels = levels(&bvh);
    Ok(bvh)
}

/// Copies a subtree of a BVH behind the nodes and rows of another one.
fn copy_subtree(bvh: &BinaryBvh, at: u32, to: &mut BinaryBvh) {
    let Node { first, count, .. } = bvh.nodes[at as usize];
    let (new_at, new_first) = (to.nodes.len() as u32, to.order.len() as u32);
    let moved = |node: &Node| Node {
        first: node.first - first + new_first,
        right: if node.is_leaf() { 0 } else { node.right - at + new_at },
        ..*node
    };
    to.nodes.extend(bvh.nodes[at as usize..][..2 * count as usize - 1].iter().map(moved));
    to.order.extend_from_slice(&bvh.order[first as usize..][..count as usize]);
}

#[cfg(test)]
mod tests;
