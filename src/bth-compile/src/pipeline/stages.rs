//! The stages that a decorator may wrap, timed.

use super::clock::timed;
use super::tree::{self, TreeOptions};
use crate::coordinates::OnGrid;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::source::Model;
use crate::{bvh, coordinates, free, marks, opacity, tets};
use bth_import::{self as mesh, Mesh, Wanted};
use std::path::Path;

/// The stages of the pipeline whose results may come from elsewhere. The provided methods call the stages
/// and store their times in the reports; a decorator overrides them, returns an earlier result where it has one, and calls
/// [`Direct`] otherwise.
pub(crate) trait Stages {
    /// Reads the mesh of a model whose files have been hashed, and finds where its triangles let rays pass.
    ///
    /// # Errors
    /// Those of the import; `BTH-O002` when a file has changed since it was hashed.
    fn import(
        &mut self,
        model: &Model<'_>,
        wanted: Wanted,
        monitor: &dyn Monitor,
    ) -> Result<(Mesh, mesh::Report)> {
        let (mut mesh, mut report) = mesh::import(model.path, wanted, monitor)?;
        let looks = model.digest.looks;
        if looks.alpha != mesh::AlphaMode::None {
            let cutouts = mesh::import_cutouts(model.path, looks, monitor)?;
            opacity::add(&mut mesh, &mut report, &cutouts, monitor)?;
        }
        model.digest.unchanged(model.path, (mesh, report))
    }

    /// Moves the vertices to a grid.
    ///
    /// # Errors
    /// As [`coordinates::place`].
    fn coordinates(
        &mut self,
        source: &Path,
        mut mesh: Mesh,
        options: &coordinates::CoordinateOptions,
    ) -> Result<(Mesh, Option<OnGrid>)> {
        let on_grid = coordinates::place(source, &mut mesh, options)?;
        Ok((mesh, on_grid))
    }

    /// Builds the binary BVH and rebuilds its treelets.
    ///
    /// # Errors
    /// As [`bvh::build`].
    fn bvh(
        &mut self,
        mesh: &Mesh,
        options: &TreeOptions<'_>,
        monitor: &dyn Monitor,
    ) -> Result<(bvh::BinaryBvh, bvh::BvhReport)> {
        timed(|| tree::build(mesh, options, monitor))
    }

    /// Decides in which directions rays from a triangle meet nothing. The result does not depend on how the BVH was built, by
    /// `_tree`, but for what is too close to decide.
    ///
    /// # Errors
    /// As [`free::find`].
    fn free(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        (_tree, options): (&TreeOptions<'_>, &free::FreeOptions),
        monitor: &dyn Monitor,
    ) -> Result<(free::Free, free::FreeReport)> {
        timed(|| free::find(mesh, tree, options, monitor))
    }

    /// Marks the nodes of a BVH, built with `_options`, that can be tetrahedralized.
    ///
    /// # Errors
    /// As [`marks::mark`].
    fn marks(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        _options: &TreeOptions<'_>,
        monitor: &dyn Monitor,
    ) -> Result<(marks::Marks, marks::MarkReport)> {
        timed(|| marks::mark(mesh, tree, monitor))
    }

    /// Tetrahedralizes the chosen nodes.
    ///
    /// # Errors
    /// As [`tets::build`].
    fn tets(
        &mut self,
        mesh: &Mesh,
        tree: &bvh::BinaryBvh,
        chosen: &[u32],
        options: &tets::TetOptions,
        monitor: &dyn Monitor,
    ) -> Result<(Vec<tets::Leaf>, tets::TetReport)> {
        timed(|| tets::build(mesh, tree, chosen, options, monitor))
    }
}

/// Calls every stage.
pub(crate) struct Direct;

impl Stages for Direct {}
