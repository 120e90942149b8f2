//! Selection of the nodes to tetrahedralize, by structure: none, those with a gain, or the root.

use super::clock::timed;
use super::limit;
use super::object::TracedMesh;
use super::{CompileOptions, Structure};
use crate::error::{Error, Place, Result};
use crate::monitor::Monitor;
use crate::{bvh, costs, marks, tets};
use bth_import::Mesh;
use std::path::Path;

/// The choice where no node would be chosen even if all were free of bad contacts, as it is with most models and profiles; `None`
/// where the marks are needed.
pub(super) fn choose_without_marks(
    traced: &TracedMesh,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<Option<(costs::Choice, costs::CostReport)>> {
    if options.structure != Structure::Bth || !options.costs.more_suitable_gain_more() {
        return Ok(None);
    }
    let storage = limit::storage_of(traced.by_ref(), options, monitor)?;
    let choose = || costs::choose_of_all(&traced.mesh, &traced.tree, &options.costs, storage, monitor);
    let (choice, report) = timed(choose)?;
    Ok(choice.chosen.is_empty().then_some((choice, report)))
}

/// The nodes to tetrahedralize, in ascending order.
pub(super) fn choose(
    source: &Path,
    traced: &TracedMesh,
    marks: &marks::Marks,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(costs::Choice, Option<costs::CostReport>)> {
    let (mesh, tree) = (&traced.mesh, &traced.tree);
    match (options.structure, marks.suitable.first()) {
        (Structure::Bvh, _) | (Structure::Tets, None) => Ok((costs::Choice::default(), None)),
        (Structure::Tets, Some(true)) => Ok((costs::Choice { chosen: vec![0], verdicts: Vec::new() }, None)),
        (Structure::Tets, Some(false)) => {
            let contacts = marks::bad_pairs(mesh, tree, monitor)?;
            let message = format!(
                "the model cannot be tetrahedralized whole: {} of its {} triangles are in {} bad contacts (they cross, overlap or touch other than at common vertices and edges)",
                contacts.triangles.len(),
                mesh.triangles.len(),
                contacts.pairs
            );
            Err(unusable(
                source,
                message,
                "repair the model (`bthc marks` lists the triangles), or use --structure bth",
            ))
        }
        (Structure::Bth, _) => {
            let storage = limit::storage_of(traced.by_ref(), options, monitor)?;
            let choose = || costs::choose(mesh, tree, marks, &options.costs, storage, monitor);
            let (choice, report) = timed(choose)?;
            Ok((choice, Some(report)))
        }
    }
}

/// The tetrahedralizations that save time according to sample rays; that of a whole model is always kept.
pub(super) fn probe(
    mesh: &Mesh,
    tree: &bvh::BinaryBvh,
    built: Vec<tets::Leaf>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<tets::Leaf>, Option<costs::ProbeReport>)> {
    match options.structure {
        Structure::Bth => costs::probe(mesh, tree, built, &options.costs, options.storage(), monitor),
        Structure::Bvh | Structure::Tets => Ok((built, None)),
    }
}

/// Fails where the whole model had to be tetrahedralized and was not.
pub(super) fn check_built(
    source: &Path,
    tree: &bvh::BinaryBvh,
    built: &[tets::Leaf],
    options: &CompileOptions,
) -> Result<()> {
    let whole = matches!(built, [(0, _)]);
    if options.structure == Structure::Tets && !tree.nodes.is_empty() && !whole {
        let message = "the model could not be tetrahedralized whole".to_owned();
        return Err(unusable(
            source,
            message,
            "is the worker bth-tetgen installed? Else use --structure bth",
        ));
    }
    Ok(())
}

fn unusable(source: &Path, message: String, hint: &str) -> Error {
    Error::Input { code: "BTH-I080", place: Place::File(source.into()), message, hint: hint.into() }
}
