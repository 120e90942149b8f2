//! The binary BVH of a mesh that keeps its shape, and the probabilities by which it is collapsed. Both follow sample rays where the
//! quality says so, and the rays that are known.

use crate::bvh::{self, BinaryBvh, BvhOptions, BvhReport};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::sampling::{self, KnownRays};
use bth_import::Mesh;

/// What the tree of a mesh depends on besides the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeOptions<'a> {
    /// The builder's options.
    pub(crate) bvh: BvhOptions,
    /// Rays that are known.
    pub(crate) rays: Option<&'a KnownRays>,
}

impl<'a> TreeOptions<'a> {
    /// Those of an object. A mesh that will deform, which is why it keeps triangles of zero area, has no shape that rays could be traced
    /// through.
    pub(crate) fn of(options: &'a CompileOptions) -> Self {
        let bvh = BvhOptions { keep_zero_area: options.deformable, ..options.bvh };
        Self { bvh, rays: options.costs.rays.as_deref().filter(|_| !options.deformable) }
    }

    /// Rounds of treelets.
    fn rounds(&self) -> usize {
        if self.bvh.keep_zero_area { 0 } else { self.bvh.quality.effort().treelets }
    }
}

/// Builds the tree and rebuilds its treelets.
///
/// # Errors
/// As [`bvh::build`].
pub(super) fn build(
    mesh: &Mesh,
    options: &TreeOptions<'_>,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    let (tree, mut report) = bvh::build(mesh, &options.bvh, monitor)?;
    let visits = |tree: &BinaryBvh| sampling::visits(mesh, tree, options.rays);
    let tree = bvh::rebuild_treelets(mesh, tree, options.rounds(), &visits, &mut report, monitor)?;
    Ok((tree, report))
}

/// The tree by which a mesh is compiled with these options.
///
/// # Errors
/// As [`bvh::build`].
pub fn build_tree(
    mesh: &Mesh,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    build(mesh, &TreeOptions::of(options), monitor)
}

/// For each node the probability that a ray enters it; `None` where its area stands for that.
pub(super) fn probabilities(mesh: &Mesh, tree: &BinaryBvh, options: &TreeOptions<'_>) -> Option<Vec<f64>> {
    let by_rays = options.rounds() > 0 || options.rays.is_some();
    by_rays.then(|| sampling::visits(mesh, tree, options.rays))
}
