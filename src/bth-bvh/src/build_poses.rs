//! Construction of one BVH for several poses of a mesh that deforms.
//!
//! After "T-SAH: Animation Optimized Bounding Volume Hierarchies" (Bittner and Meister 2015): the
//! cost of a tree is the mean of its SAH costs over poses, each relative to the area of the root in
//! that pose. The paper builds for one pose and then optimizes by insertion; here the top-down
//! splits are chosen by the summed cost as well, so that triangles that part in any pose part
//! early.

use super::bounds::Bounds;
use super::build::{BvhReport, Effort, over_used, reinsert, split_all};
use super::linked_tree::LinkedTree;
use super::pose_bounds::ScaledPoses;
use super::poses::{Poses, refit};
use super::split::Reference;
use super::{BinaryBvh, MAX_POSES};
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use rayon::prelude::*;

/// Options of [`build_poses`].
#[derive(Clone, Debug)]
pub struct PoseOptions {
    /// Parameters of the builder.
    pub effort: Effort,
    /// True if the tree keeps triangles of zero area, for a mesh whose vertices move at run time.
    pub keep_zero_area: bool,
}

/// Builds the binary BVH of smallest cost over all poses; the boxes of its nodes are computed from
/// the mesh's own positions. The report's visits are means over the poses. With one pose that
/// equals the mesh's positions, and without `keep_zero_area`, the tree is the same as from
/// [`build()`](super::build()).
///
/// # Errors
/// The errors of [`build()`](super::build()).
pub fn build_poses(
    mesh: &Mesh,
    poses: &Poses<'_>,
    options: &PoseOptions,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    let effort = &options.effort;
    over_used(mesh, options.keep_zero_area, |used, report| match poses.len() {
        1 if poses.positions(0) == mesh.positions => {
            over(&used, |id| Bounds::of_points(&mesh.corners(id)), effort, report, monitor)
        }
        ..=4 => scaled::<4>(mesh, poses, &used, effort, report, monitor),
        5..=8 => scaled::<8>(mesh, poses, &used, effort, report, monitor),
        _ => scaled::<MAX_POSES>(mesh, poses, &used, effort, report, monitor),
    })
}

/// The tree over bounds in up to `P` poses.
fn scaled<const P: usize>(
    mesh: &Mesh,
    poses: &Poses<'_>,
    used: &[u32],
    effort: &Effort,
    report: &mut BvhReport,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    let scaled = ScaledPoses::<P>::new(&mesh.triangles, poses, used);
    let mut bvh = over(used, |id| scaled.bounds(id), effort, report, monitor)?;
    refit(mesh, &mut bvh);
    Ok(bvh)
}

/// The tree over bounds that `leaf` gives for each triangle.
fn over<E: super::extent::Extent>(
    used: &[u32],
    leaf: impl Fn(u32) -> E + Sync,
    effort: &Effort,
    report: &mut BvhReport,
    monitor: &dyn Monitor,
) -> Result<BinaryBvh> {
    let references = used.par_iter().map(|&id| Reference { bounds: leaf(id), id }).collect();
    let bvh = split_all(references, effort, monitor)?;
    let tree = LinkedTree::of_leaves(&bvh, leaf);
    report.visits.push(tree.visits());
    if effort.reinsertion.is_empty() || bvh.nodes.len() <= 3 {
        return Ok(bvh);
    }
    reinsert(tree, bvh, &effort.reinsertion, report, monitor)
}

#[cfg(test)]
#[path = "build_poses_tests.rs"]
mod tests;
