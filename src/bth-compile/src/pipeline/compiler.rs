//! The compilation of an object: calls the stages in order, each through the cache and under the
//! clock.

use super::choose_nodes::ChooseNodes;
use super::free_directions::FindFree;
use super::hashed::Hashed;
use super::import::Import;
use super::marks::Mark;
use super::moving::{self, BuildPoses, PoseSource, warn_of_options};
use super::object::{Collapse, Object, ObjectSource};
use super::parts::{BuildInParts, in_parts};
use super::place::PlaceOnGrid;
use super::provenance;
use super::report::{CompileReport, StageReports, TetReports};
use super::tetrahedralize::{Probe, Tetrahedralize};
use super::traced::TracedMesh;
use super::tree::{BuildTree, CountVisits, TreeOptions};
use crate::bvh::Quality;
use crate::cached::Cache;
use crate::coordinates::OnGrid;
use crate::error::Result;
use crate::free::{self, Free, FreeReport};
use crate::monitor::Monitor;
use crate::options::{CompileOptions, Structure};
use crate::shard::Shard;
use crate::source::{Model, changed};
use crate::stage::{CachedStage, Clock, Stage};
use crate::tets;
use bth_files::Digest;
use bth_import::{self as mesh, Mesh};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::path::Path;

/// A mesh on its grid, if it has one, with its hash and options.
type Placed = (Mesh, Option<OnGrid>, OnceCell<Digest>, CompileOptions);

/// Compiles one object.
pub(crate) struct Compiler<'a> {
    /// Names the source in messages.
    pub(crate) source: &'a Path,
    /// Names the object within the source in explanations of misses.
    pub(crate) part: &'a str,
    pub(crate) options: &'a CompileOptions,
    pub(crate) cache: &'a Cache<'a>,
    pub(crate) clock: &'a mut Clock,
    pub(crate) monitor: &'a dyn Monitor,
}

impl<'a> Compiler<'a> {
    /// Runs a stage whose results the cache keeps.
    fn fetch<T, R: Serialize + DeserializeOwned, S: CachedStage<T, R>>(
        &mut self,
        stage: S,
    ) -> Result<(T, R)> {
        let Self { part, cache, monitor, .. } = *self;
        self.clock.time(S::NAME, || cache.run(stage, part, monitor))
    }

    /// Runs another stage.
    fn run<S: Stage>(&mut self, stage: S) -> Result<S::Output> {
        let monitor = self.monitor;
        self.clock.time(S::NAME, || stage.run(monitor))
    }

    /// Reads the mesh of a model. The hash of its geometry is known if the cache needs it.
    pub(super) fn import(&mut self, model: &Model<'_>) -> Result<(Mesh, mesh::Report, OnceCell<Digest>)> {
        let import = Import { model, wanted: self.options.wanted() };
        if self.cache.store().is_none() {
            let monitor = self.monitor;
            let (mesh, report) = self.clock.time(Import::NAME, || import.read(monitor))?;
            return Ok((mesh, report, OnceCell::new()));
        }
        let (mesh, summary) = self.fetch(import)?;
        Ok((mesh, summary.report, summary.geometry.into()))
    }

    /// Compiles the mesh of a model into a file with one object.
    pub(super) fn file(
        self,
        model: &Model<'_>,
        (mesh, import, hash): (Mesh, mesh::Report, OnceCell<Digest>),
    ) -> Result<(bth_format::File, CompileReport)> {
        let Self { options, monitor, .. } = self;
        let (object, reports) = Compiler { clock: &mut *self.clock, ..self }.object(mesh, hash)?;
        let source_blake3 = model.digest.file.hex();
        let provenance = provenance::of_model(&source_blake3, &import.format, reports.worker(), options)?;
        let images = images(model, object.image_names(), monitor)?;
        let file = || object.file(provenance, &images, options);
        let (file, report) = self.clock.time("file", file)?;
        let clock = std::mem::take(self.clock);
        Ok((file, CompileReport::new(source_blake3, clock, import, reports, report)))
    }

    /// Compiles a mesh into an object. `hash` is the hash of its geometry, if it is known.
    pub(crate) fn object(mut self, mesh: Mesh, hash: OnceCell<Digest>) -> Result<(Object, StageReports)> {
        self.check(&mesh)?;
        if let Some(sequence) = mesh.sequence.clone() {
            warn_of_options(&self.source.display().to_string(), self.options, self.monitor);
            let options = &self.options.of_deforming();
            return Compiler { options, ..self }.moving(mesh, &sequence);
        }
        let (mesh, on_grid, hash, options) = self.placed(mesh, hash)?;
        Compiler { options: &options, ..self }.still(mesh, on_grid, &hash)
    }

    /// Builds those parts of an object into the cache that belong to a shard, where the first part
    /// is this work. Returns their number; `None` if the object is not built in parts.
    pub(crate) fn parts_of(
        mut self,
        mesh: Mesh,
        hash: OnceCell<Digest>,
        shard: (Shard, u64),
    ) -> Result<Option<u64>> {
        if mesh.sequence.is_some() || !in_parts(mesh.triangles.len() as u64, self.options) {
            return Ok(None);
        }
        self.check(&mesh)?;
        let (mesh, _, hash, options) = self.placed(mesh, hash)?;
        let compiler = Compiler { options: &options, ..self };
        compiler.building(&mesh, &hash).build_shard(shard, compiler.monitor).map(Some)
    }

    /// Refuses options that exclude each other, and a mesh without the memory for it.
    fn check(&self, mesh: &Mesh) -> Result<()> {
        self.options.check()?;
        // Of the memory for a triangle its mesh has some already.
        let more = if self.options.bvh.quality == Quality::Fast { 0 } else { 40 };
        let (triangles, each) = (mesh.triangles.len() as u64, mesh::BYTES_PER_TRIANGLE - 20 + more);
        let is_in_parts = in_parts(triangles, self.options);
        mesh::check_memory(triangles, each, if is_in_parts { self.options.part_triangles } else { u64::MAX })
    }

    /// A mesh that does not move, on the grid of its coordinates, with its hash, and the options
    /// that it is compiled with.
    fn placed(&mut self, mesh: Mesh, hash: OnceCell<Digest>) -> Result<Placed> {
        if mesh.exact.is_some() {
            return Ok((mesh, None, hash, self.options.of_exact()));
        }
        let (mesh, on_grid, hash) = match self.options.coordinates == Default::default() {
            true => (mesh, None, hash),
            false => {
                let stage = PlaceOnGrid { source: self.source, mesh, options: &self.options.coordinates };
                let (mesh, on_grid) = self.run(stage)?;
                let hash = if on_grid.is_some() { OnceCell::new() } else { hash };
                (mesh, on_grid, hash)
            }
        };
        let options = CompileOptions { structure: self.options.built_structure(), ..self.options.clone() };
        Ok((mesh, on_grid, hash, options))
    }

    /// Compiles a mesh whose vertices do not move by themselves.
    fn still(
        mut self,
        mesh: Mesh,
        on_grid: Option<OnGrid>,
        hash: &OnceCell<Digest>,
    ) -> Result<(Object, StageReports)> {
        let options = self.options;
        if in_parts(mesh.triangles.len() as u64, options) {
            return self.in_parts(mesh, on_grid, hash);
        }
        let built =
            BuildTree { mesh: Hashed { mesh: &mesh, known: hash }, options: TreeOptions::of(options) };
        let (tree, bvh) = self.fetch(built)?;
        let probabilities = self.run(CountVisits { built, tree: &tree })?;
        let traced = TracedMesh { mesh, on_grid, tree, probabilities };
        let (leaves, tets) = match options.structure {
            Structure::Bvh => (Vec::new(), TetReports::default()),
            Structure::Bth | Structure::Tets => self.tet_leaves(&traced, hash)?,
        };
        let (free, free_report) = self.free_directions(&traced, hash)?;
        let coordinates = traced.on_grid.as_ref().map(OnGrid::report);
        let (object, collapse) = self.run(Collapse { traced, leaves, free, motion: None, options })?;
        Ok((object, StageReports { coordinates, bvh, free: free_report, tets, collapse }))
    }

    /// Compiles a mesh that does not move in parts.
    fn in_parts(
        mut self,
        mesh: Mesh,
        on_grid: Option<OnGrid>,
        hash: &OnceCell<Digest>,
    ) -> Result<(Object, StageReports)> {
        let (mut hierarchy, bvh, mut collapse) = self.run(self.building(&mesh, hash))?;
        if let Some(on_grid) = &on_grid {
            crate::coordinates::pack(&mut hierarchy.wide, &on_grid.grid)?;
            collapse.measure(&hierarchy.wide);
        }
        let coordinates = on_grid.as_ref().map(OnGrid::report);
        let source = ObjectSource { mesh, on_grid, free: None, motion: None };
        let object = Object::new(source, hierarchy, Vec::new());
        Ok((object, StageReports { coordinates, bvh, collapse, ..StageReports::default() }))
    }

    /// The stage that builds the tree of a mesh in parts.
    fn building<'b>(&self, mesh: &'b Mesh, known: &'b OnceCell<Digest>) -> BuildInParts<'b>
    where
        'a: 'b,
    {
        let Self { part: name, options, cache, .. } = *self;
        let (mesh, most) = (Hashed { mesh, known }, options.part_triangles as usize);
        BuildInParts { mesh, options: TreeOptions::of(options), most, cache, name }
    }

    /// Compiles a mesh whose vertices move, with the options of deformable objects
    /// ([`CompileOptions::of_deforming`]).
    pub(crate) fn moving(mut self, mesh: Mesh, source: &dyn PoseSource) -> Result<(Object, StageReports)> {
        let options = self.options;
        let motion = Some(moving::report(&mesh, options));
        let (traced, bvh) = self.run(BuildPoses { mesh, source, options })?;
        let (object, collapse) =
            self.run(Collapse { traced, leaves: Vec::new(), free: None, motion, options })?;
        Ok((object, StageReports { bvh, collapse, ..StageReports::default() }))
    }

    /// Tetrahedralizes the nodes for which that saves time. Where the costs rule out all nodes none
    /// is marked.
    fn tet_leaves(
        &mut self,
        traced: &TracedMesh,
        hash: &OnceCell<Digest>,
    ) -> Result<(Vec<tets::Leaf>, TetReports)> {
        let Self { source, options, cache, .. } = *self;
        let TracedMesh { mesh, tree, .. } = traced;
        let mut reports = TetReports::default();
        let chosen = match self.run(ChooseNodes { source, traced, marks: None, options })? {
            Some(chosen) => Some(chosen),
            None => {
                let mesh = Hashed { mesh, known: hash };
                let built = BuildTree { mesh, options: TreeOptions::of(options) };
                let (marks, report) = self.fetch(Mark { built, tree })?;
                reports.marks = Some(report);
                self.run(ChooseNodes { source, traced, marks: Some(&marks), options })?
            }
        };
        let (chosen, costs) = chosen.unwrap_or_default();
        let chosen = &chosen[..];
        let (built, report) = self.run(Tetrahedralize { source, mesh, tree, chosen, options, cache })?;
        (reports.costs, reports.tets) = (costs, Some(report));
        let (leaves, probe) = self.run(Probe { mesh, tree, built, options })?;
        reports.probe = probe;
        Ok((leaves, reports))
    }

    /// Decides in which directions rays from a triangle hit nothing. A tetrahedralization of the
    /// whole model has no leaves in which its triangles could be found, and deformable objects get
    /// no free directions.
    fn free_directions(
        &mut self,
        traced: &TracedMesh,
        hash: &OnceCell<Digest>,
    ) -> Result<(Option<Free>, Option<FreeReport>)> {
        let options = self.options;
        let free = options.free;
        if free.keep == free::KeepFree::None || options.structure == Structure::Tets || options.deformable {
            return Ok((None, None));
        }
        let TracedMesh { mesh, tree, .. } = traced;
        let built = BuildTree { mesh: Hashed { mesh, known: hash }, options: TreeOptions::of(options) };
        let (found, report) = self.fetch(FindFree { built, tree, options: free })?;
        Ok(((report.kept != free::Kept::None).then_some(found), Some(report)))
    }
}

/// The images of a model that have these names.
///
/// # Errors
/// `BTH-O002` where a file has changed since its material was read, so that an image is not there
/// any more.
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
