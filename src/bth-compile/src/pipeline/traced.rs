//! A mesh with the vertices that are traced, its binary BVH, and the wide BVH that is collapsed
//! from it.

use crate::bvh;
use crate::coordinates::{self, OnGrid};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use bth_import::Mesh;

/// A mesh with the vertices that are traced, and its binary BVH.
pub(crate) struct TracedMesh {
    /// The mesh; its vertices are on the grid, if there is one.
    pub(crate) mesh: Mesh,
    /// The grid and the original positions, if vertices were moved.
    pub(crate) on_grid: Option<OnGrid>,
    pub(crate) tree: bvh::BinaryBvh,
    /// For each node the probability that a ray enters it, if that is not by its area: counted, or
    /// a mean over poses.
    pub(crate) probabilities: Option<Vec<f64>>,
}

/// A borrowed [`TracedMesh`].
#[derive(Clone, Copy)]
pub(super) struct TracedRef<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) on_grid: Option<&'a OnGrid>,
    pub(super) tree: &'a bvh::BinaryBvh,
    pub(super) probabilities: Option<&'a [f64]>,
}

impl TracedMesh {
    pub(super) fn by_ref(&self) -> TracedRef<'_> {
        let probabilities = self.probabilities.as_deref();
        TracedRef { mesh: &self.mesh, on_grid: self.on_grid.as_ref(), tree: &self.tree, probabilities }
    }
}

/// The wide BVH over a binary one, in which the nodes `cut` are tet leaves.
pub(super) fn collapse(
    traced: TracedRef<'_>,
    cut: &[u32],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(bvh::Wide, bvh::CollapseReport)> {
    let collapse_options =
        bvh::CollapseOptions { leaf_vertices: options.deformable, ..bvh::CollapseOptions::default() };
    let weighed = bvh::Weighed { bvh: traced.tree, probabilities: traced.probabilities };
    let (mut wide, mut report) = bvh::collapse(traced.mesh, weighed, cut, &collapse_options, monitor)?;
    if let Some(on_grid) = traced.on_grid {
        coordinates::pack(&mut wide, &on_grid.grid)?;
    }
    report.measure(&wide);
    Ok((wide, report))
}
