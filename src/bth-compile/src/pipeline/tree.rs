//! The binary BVH of a mesh that keeps its shape, and the probabilities by which it is collapsed. Both follow sample rays, where the
//! quality says so.

use crate::bvh::{self, BinaryBvh, BvhOptions, BvhReport};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::sampling;
use bth_import::Mesh;

/// Builds the tree and rebuilds its treelets.
///
/// # Errors
/// As [`bvh::build`].
pub(super) fn build(
    mesh: &Mesh,
    options: &BvhOptions,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    let (tree, mut report) = bvh::build(mesh, options, monitor)?;
    let visits = |tree: &BinaryBvh| sampling::visits(mesh, tree);
    let tree = bvh::rebuild_treelets(mesh, tree, rounds(options), &visits, &mut report, monitor)?;
    Ok((tree, report))
}

/// For each node the probability that a ray enters it; `None` where its area stands for that.
pub(super) fn probabilities(mesh: &Mesh, tree: &BinaryBvh, options: &BvhOptions) -> Option<Vec<f64>> {
    (rounds(options) > 0).then(|| sampling::visits(mesh, tree))
}

/// Rounds of treelets. A mesh that will deform, which is why it keeps triangles of zero area, has no shape that rays could be traced
/// through.
fn rounds(options: &BvhOptions) -> usize {
    if options.keep_zero_area { 0 } else { options.quality.effort().treelets }
}
