//! The binary BVH of a mesh that keeps its shape, and the probabilities by which it is collapsed.
//! Both follow sample rays where the quality says so, and the rays that are known.

use super::hashed::Hashed;
use crate::bvh::{self, BinaryBvh, BvhOptions, BvhReport, Quality};
use crate::cached::{Topology, decode, encode, text};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::sampling::{self, KnownRays};
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;

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

    /// Returns true if the wide nodes are chosen by what rays enter.
    fn by_rays(&self) -> bool {
        self.rays.is_some() || (self.bvh.quality != Quality::Fast && !self.bvh.keep_zero_area)
    }
}

/// Builds the tree.
#[derive(Clone, Copy)]
pub(crate) struct BuildTree<'a> {
    pub(crate) mesh: Hashed<'a>,
    pub(crate) options: TreeOptions<'a>,
}

impl Stage for BuildTree<'_> {
    type Output = (BinaryBvh, BvhReport);
    const NAME: &'static str = "bvh";
    const VERSION: &'static str = "4";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        bvh::build(self.mesh.mesh, &self.options.bvh, monitor)
    }
}

impl CachedStage<BinaryBvh, BvhReport> for BuildTree<'_> {
    fn key(&self) -> Key {
        let BvhOptions { quality, keep_zero_area } = self.options.bvh;
        Key::new(Self::NAME)
            .with("geometry", self.mesh.hash())
            .with("quality", text(&quality))
            .with("zero area kept", keep_zero_area.to_string())
            .with("bvh version", Self::VERSION)
    }

    fn encode(tree: &BinaryBvh) -> Vec<u8> {
        encode(&Topology::of(tree))
    }

    fn decode(&self, bytes: &[u8]) -> Option<BinaryBvh> {
        decode::<Topology>(bytes)?.over(self.mesh.mesh)
    }
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
        Ok(options.by_rays().then(|| sampling::visits(mesh.mesh, tree, options.rays)))
    }
}
