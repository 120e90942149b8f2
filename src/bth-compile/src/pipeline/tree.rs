//! The binary BVH of a mesh that keeps its shape, and the probabilities by which it is collapsed.
//! Both follow sample rays where the quality says so, and the rays that are known.

use super::hashed::Hashed;
use crate::bvh::{self, BinaryBvh, BvhOptions, BvhReport};
use crate::cached::{Topology, decode, encode, text};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::sampling::{self, KnownRays};
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;
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
    /// The options of an object. A mesh that will deform, which is why it keeps triangles of zero
    /// area, has no shape that rays could be traced through.
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
#[derive(Clone, Copy)]
pub(crate) struct BuildTree<'a> {
    pub(crate) mesh: Hashed<'a>,
    pub(crate) options: TreeOptions<'a>,
}

impl Stage for BuildTree<'_> {
    type Output = (BinaryBvh, BvhReport);
    const NAME: &'static str = "bvh";
    const VERSION: &'static str = "3";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        build(self.mesh.mesh, &self.options, monitor)
    }
}

impl CachedStage<BinaryBvh, BvhReport> for BuildTree<'_> {
    fn key(&self) -> Key {
        let TreeOptions { bvh: BvhOptions { quality, keep_zero_area }, rays } = self.options;
        Key::new(Self::NAME)
            .with("geometry", self.mesh.hash())
            .with("quality", text(&quality))
            .with("zero area kept", keep_zero_area.to_string())
            .with("rays", rays.map_or_else(String::new, KnownRays::hash))
            .with("bvh version", Self::VERSION)
    }

    fn encode(tree: &BinaryBvh) -> Vec<u8> {
        encode(&Topology::of(tree))
    }

    fn decode(&self, bytes: &[u8]) -> Option<BinaryBvh> {
        decode::<Topology>(bytes)?.over(self.mesh.mesh)
    }
}

fn build(mesh: &Mesh, options: &TreeOptions<'_>, monitor: &dyn Monitor) -> Result<(BinaryBvh, BvhReport)> {
    rebuilt(mesh, bvh::build(mesh, &options.bvh, monitor)?, options, monitor)
}

/// A tree after its treelets were rebuilt.
pub(super) fn rebuilt(
    mesh: &Mesh,
    (tree, mut report): (BinaryBvh, BvhReport),
    options: &TreeOptions<'_>,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    let visits = |tree: &BinaryBvh| sampling::visits(mesh, tree, options.rays);
    let tree = bvh::rebuild_treelets(mesh, tree, options.rounds(), &visits, &mut report, monitor)?;
    Ok((tree, report))
}

/// The tree by which a mesh is compiled with these options.
///
/// # Errors
/// The errors of [`bvh::build`].
pub fn build_tree(
    mesh: &Mesh,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, BvhReport)> {
    build(mesh, &TreeOptions::of(options), monitor)
}

/// Finds for each node of a tree the probability that a ray enters it; `None` where the node's area
/// is used instead.
pub(super) struct CountVisits<'a> {
    pub(super) built: BuildTree<'a>,
    pub(super) tree: &'a BinaryBvh,
}

impl Stage for CountVisits<'_> {
    type Output = Option<Vec<f64>>;
    const NAME: &'static str = "visits";
    const VERSION: &'static str = "1";

    fn run(self, _: &dyn Monitor) -> Result<Self::Output> {
        let Self { built: BuildTree { mesh, options }, tree } = self;
        let by_rays = options.rounds() > 0 || options.rays.is_some();
        Ok(by_rays.then(|| sampling::visits(mesh.mesh, tree, options.rays)))
    }
}
