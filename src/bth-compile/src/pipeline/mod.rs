//! The compilation of a model: import → coordinates → BVH → visits → marks → costs → tets → probe →
//! limit → collapse → file.
//!
//! Each stage is a function of its input and its options. The stages whose results can come from elsewhere are called
//! through the trait `Stages`, which a cache implements outside of this module.

mod clock;
mod limit;
mod motion;
mod moving;
pub(crate) mod object;
pub(crate) mod provenance;
mod report;
mod select;
mod stages;
mod tree;

pub use crate::options::{CompileOptions, MotionOptions, Structure};
pub use clock::StageTime;
pub(crate) use clock::{Clock, timed};
pub use limit::storage;
pub(crate) use limit::warn_over_limit;
pub use motion::{MotionReport, SegmentReport};
pub(crate) use moving::{PoseSource, compile_moving, warn_of_options};
pub use object::{Compiled, assemble};
pub(crate) use object::{Object, TracedMesh};
pub(crate) use report::StageReports;
pub use report::{CompileReport, FileReport};
pub(crate) use stages::{Direct, Stages};
pub(crate) use tree::TreeOptions;
pub use tree::build_tree;

use crate::error::Result;
use crate::monitor::Monitor;
use crate::source::{Model, SourceDigest, changed};
use crate::{coordinates, free, tets};
use bth_import::{self as mesh, Mesh};
use report::TetReports;
use std::collections::BTreeSet;
use std::path::Path;

/// Compiles a model.
///
/// # Errors
/// Those of the stages: a source that cannot be used or read, a limit of the format, cancellation.
pub fn compile(
    source: &Path,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Compiled, CompileReport)> {
    let mut clock = Clock::default();
    let digest = clock.time("hash", || SourceDigest::of(source, options.looks()))?;
    let model = Model { path: source, digest: &digest };
    let (file, report) = compile_model(&model, options, &mut Direct, clock, monitor)?;
    warn_over_limit(&report.file, options, monitor);
    Ok((file.into(), report))
}

/// Compiles a model whose files have been hashed; `clock` has the time of that.
pub(crate) fn compile_model(
    model: &Model<'_>,
    options: &CompileOptions,
    stages: &mut dyn Stages,
    mut clock: Clock,
    monitor: &dyn Monitor,
) -> Result<(bth_format::File, CompileReport)> {
    let imported = clock.time("mesh", || stages.import(model, options.wanted(), monitor))?;
    compile_imported(model, imported, options, stages, clock, monitor)
}

/// Compiles a model that has been imported.
pub(crate) fn compile_imported(
    model: &Model<'_>,
    (mesh, import): (Mesh, mesh::Report),
    options: &CompileOptions,
    stages: &mut dyn Stages,
    mut clock: Clock,
    monitor: &dyn Monitor,
) -> Result<(bth_format::File, CompileReport)> {
    let (object, reports) = compile_mesh(model.path, mesh, options, stages, &mut clock, monitor)?;
    let source_blake3 = model.digest.file.hex();
    let tetgen = provenance::tetgen(reports.tets.as_ref());
    let provenance = provenance::of_model(&source_blake3, &import.format, tetgen, options)?;
    let images = images(model, object.image_names(), monitor)?;
    let (file, report) = clock.time("file", || object.file(provenance, &images, options))?;
    Ok((file, CompileReport::new(source_blake3, clock, import, reports, report)))
}

/// The images of a model that have these names.
///
/// # Errors
/// `BTH-O002` where a file has changed since its material was read, so that an image is not there any more.
fn images(
    model: &Model<'_>,
    mut names: BTreeSet<[u8; 16]>,
    monitor: &dyn Monitor,
) -> Result<Vec<mesh::ImageFile>> {
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let mut images = mesh::import_images(model.path, model.digest.looks, monitor)?;
    images.retain(|image| names.remove(&image.name));
    if names.is_empty() { Ok(images) } else { Err(changed(model.path)) }
}

/// Compiles a mesh into an object; `source` names the model in messages.
pub(crate) fn compile_mesh(
    source: &Path,
    mesh: Mesh,
    options: &CompileOptions,
    stages: &mut dyn Stages,
    clock: &mut Clock,
    monitor: &dyn Monitor,
) -> Result<(Object, StageReports)> {
    options.check()?;
    if let Some(sequence) = mesh.sequence.clone() {
        warn_of_options(&source.display().to_string(), options, monitor);
        return compile_moving((mesh, &sequence), &options.of_deforming(), clock, monitor);
    }
    let (mesh, on_grid) = match options.coordinates == coordinates::CoordinateOptions::default() {
        true => (mesh, None),
        false => clock.time("coordinates", || stages.coordinates(source, mesh, &options.coordinates))?,
    };
    let options = &CompileOptions { structure: options.built_structure(), ..options.clone() };
    let tree_options = TreeOptions::of(options);
    let (tree, bvh) = clock.time("bvh", || stages.bvh(&mesh, &tree_options, monitor))?;
    let probabilities = clock.time("visits", || tree::probabilities(&mesh, &tree, &tree_options));
    let traced = TracedMesh { mesh, on_grid, tree, probabilities };
    let (leaves, tets) = match options.structure {
        Structure::Bvh => (Vec::new(), TetReports::default()),
        Structure::Bth | Structure::Tets => tet_leaves(source, &traced, options, stages, clock, monitor)?,
    };
    let (free, free_report) = free_directions(&traced, &leaves, options, (stages, clock), monitor)?;
    let (object, collapse) =
        clock.time("collapse", || object::join(traced, leaves, free, options, monitor))?;
    let coordinates = object.coordinates_report();
    Ok((object, StageReports::new(coordinates, (bvh, free_report), tets, collapse)))
}

/// Decides in which directions rays from a triangle meet nothing, and whether that is kept. A tetrahedralization of the whole model
/// has no leaves in which its triangles could be found. Deformable objects get no free directions. What is kept where it is worth its
/// bytes stays within the limit on them.
fn free_directions(
    traced: &TracedMesh,
    leaves: &[tets::Leaf],
    options: &CompileOptions,
    (stages, clock): (&mut dyn Stages, &mut Clock),
    monitor: &dyn Monitor,
) -> Result<(Option<free::Free>, Option<free::FreeReport>)> {
    let is_wanted = options.free.keep != free::KeepFree::None;
    if !is_wanted || options.structure == Structure::Tets || options.deformable {
        return Ok((None, None));
    }
    let mut free = options.free;
    if free.keep == free::KeepFree::Auto {
        free.row_bytes = limit::row_bytes(traced, leaves, options, monitor)?.min(free.row_bytes);
    }
    let TracedMesh { mesh, tree, .. } = traced;
    let find = || stages.free(mesh, tree, (&TreeOptions::of(options), &free), monitor);
    let (free, report) = clock.time("free directions", find)?;
    Ok(((report.kept != free::Kept::None).then_some(free), Some(report)))
}

/// Tetrahedralizes the nodes for which that saves time: marks → costs → tets → probe → limit. Where the costs rule out all nodes
/// none is marked.
fn tet_leaves(
    source: &Path,
    traced: &TracedMesh,
    options: &CompileOptions,
    stages: &mut dyn Stages,
    clock: &mut Clock,
    monitor: &dyn Monitor,
) -> Result<(Vec<tets::Leaf>, TetReports)> {
    let (tree, mesh) = (&traced.tree, &traced.mesh);
    let without_marks = || select::choose_without_marks(traced, options, monitor);
    let (choice, costs, marks) = match clock.time("costs", without_marks)? {
        Some((choice, costs)) => (choice, Some(costs), None),
        None => {
            let (marks, report) =
                clock.time("marks", || stages.marks(mesh, tree, &TreeOptions::of(options), monitor))?;
            let choose = || select::choose(source, traced, &marks, options, monitor);
            let (choice, costs) = clock.time("costs", choose)?;
            (choice, costs, Some(report))
        }
    };
    let (built, tets) =
        clock.time("tets", || stages.tets(mesh, tree, &choice.chosen, &options.tets, monitor))?;
    select::check_built(source, tree, &built, options)?;
    let (mut leaves, mut probe) =
        clock.time("probe", || select::probe(mesh, tree, built, options, monitor))?;
    if let Some(most) = limit::bytes_per_triangle(options) {
        let within = || limit::fit(traced, most, leaves, (&choice, probe.as_mut()), options, monitor);
        leaves = clock.time("limit", within)?;
    }
    Ok((leaves, TetReports { marks, costs, tets: Some(tets), probe }))
}
