//! The compiler: calls the stages in order.

mod kept;
mod limit;
mod options;
pub(crate) mod parts;
pub(crate) mod provenance;
mod structure;

pub use kept::{Foreseen, Outcome, compile_cached, foresee};
pub(crate) use kept::{joined, tetgen, through};
pub use limit::storage;
pub(crate) use limit::{over, say};
pub use options::{Options, Structure};

use crate::cached::{self, Cache, Topology};
use crate::coordinates::Boxes;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::{bvh, coordinates, costs, marks, tets};
use bth_import as mesh;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// A compiled file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Compiled {
    /// Its bytes. They depend on the source's content and the options only.
    pub bytes: Vec<u8>,
}

/// What the stages found and did.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// BLAKE3 of the source file's bytes, hexadecimal.
    pub source_blake3: String,
    /// What each stage took, in order.
    pub seconds: Vec<StageTime>,
    /// Import.
    pub mesh: mesh::Report,
    /// Coordinates, unless they are `f32`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates: Option<coordinates::Report>,
    /// Binary BVH.
    pub bvh: bvh::Report,
    /// Marking; absent when no tetrahedra were asked for, as the next two.
    pub marks: Option<marks::Report>,
    /// Selection.
    pub costs: Option<costs::Report>,
    /// Tetrahedralization.
    pub tets: Option<tets::Report>,
    /// What the probe made of the tetrahedra, if there were any.
    pub probe: Option<costs::ProbeReport>,
    /// Wide BVH.
    pub collapse: bvh::CollapseReport,
    /// The compiled file.
    pub file: FileReport,
}

/// What a stage took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StageTime {
    /// Name of the stage.
    pub name: &'static str,
    /// Seconds on the wall clock.
    pub seconds: f64,
}

/// Size of the compiled file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FileReport {
    /// Bytes of the file.
    pub bytes: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Triangles in tet leaves.
    pub tet_triangles: u64,
    /// Bytes of the sections that traversal reads.
    pub resident_bytes: u64,
    /// The same for each triangle of the source; 0 when it has none.
    pub resident_bytes_per_triangle: f64,
}

/// Compiles a model.
///
/// # Errors
/// Those of the stages: a source that cannot be used or read, a limit of the format, cancellation.
pub fn compile(source: &Path, options: &Options, monitor: &dyn Monitor) -> Result<(Compiled, Report)> {
    let mut clock = Clock::default();
    let digest = clock.time("hash", || cached::SourceDigest::of(source))?;
    let (compiled, report) = compile_model(source, &digest, options, &Cache::none(), monitor, clock)?;
    say(over(&report.file, options), monitor);
    Ok((compiled, report))
}

/// Compiles a model whose files have been hashed.
fn compile_model(
    source: &Path,
    digest: &cached::SourceDigest,
    options: &Options,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
    mut clock: Clock,
) -> Result<(Compiled, Report)> {
    let (mesh, facts) = clock.time("mesh", || {
        cache.stage(
            || cached::mesh(digest, source, "flat", options.attributes),
            "",
            monitor,
            cached::decode,
            cached::encode,
            || {
                let read = mesh::import(source, options.attributes, monitor)?;
                digest.unchanged(source, cached::MeshFacts::of(read))
            },
        )
    })?;
    let (object, reports) = build(source, "", (mesh, &facts.geometry), options, cache, monitor, &mut clock)?;
    let mesh_report = facts.report;
    let source_blake3 = digest.file.hex();
    let tetgen = provenance::tetgen(reports.tets.as_ref());
    let provenance = provenance::json(&source_blake3, &mesh_report.format, tetgen, options)?;
    let (bytes, resident_bytes) = clock.time("file", || parts::file(&object, provenance, options))?;

    let triangles = object.mesh.triangles.len();
    let file = FileReport {
        bytes: bytes.len() as u64,
        tet_leaves: object.tet_leaves,
        tet_triangles: object.tet_triangles,
        resident_bytes,
        resident_bytes_per_triangle: resident_bytes as f64 / triangles.max(1) as f64,
    };
    let Reports { coordinates, bvh, marks, costs, tets, probe, collapse } = reports;
    let seconds = clock.0;
    let mesh = mesh_report;
    let report =
        Report { source_blake3, seconds, mesh, coordinates, bvh, marks, costs, tets, probe, collapse, file };
    Ok((Compiled { bytes }, report))
}

/// An object that is ready to be written.
pub(crate) struct Object {
    /// As it is traced.
    pub(crate) mesh: mesh::Mesh,
    /// How it was before, if its positions were moved.
    on_grid: Option<coordinates::OnGrid>,
    tree: bvh::BinaryBvh,
    wide: bvh::Wide,
    packed_nodes: bool,
    /// Absent without tet leaves.
    encoded: Option<tets::Encoded>,
    pub(crate) tet_leaves: u64,
    pub(crate) tet_triangles: u64,
}

/// What the stages from the mesh to the wide BVH found; see [`Report`].
pub(crate) struct Reports {
    coordinates: Option<coordinates::Report>,
    bvh: bvh::Report,
    marks: Option<marks::Report>,
    costs: Option<costs::Report>,
    pub(crate) tets: Option<tets::Report>,
    probe: Option<costs::ProbeReport>,
    collapse: bvh::CollapseReport,
}

/// Builds an object from its mesh and the hash of its geometry; `source` is for messages, `part` tells the objects of a source apart when misses of
/// the cache are explained.
pub(crate) fn build(
    source: &Path,
    part: &str,
    (mut mesh, geometry): (mesh::Mesh, &bth_cache::Digest),
    options: &Options,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
    clock: &mut Clock,
) -> Result<(Object, Reports)> {
    let mut on_grid = None;
    if options.coordinates != coordinates::Options::default() {
        on_grid =
            clock.time("coordinates", || coordinates::place(source, &mut mesh, &options.coordinates))?;
    }
    let moved = on_grid.as_ref().map(|_| cached::geometry(&mesh));
    let geometry = moved.as_ref().unwrap_or(geometry);
    let (tree, bvh_report) = clock.time("bvh", || {
        cache.stage(
            || cached::bvh(geometry, &options.bvh),
            part,
            monitor,
            |bytes| cached::decode::<Topology>(bytes)?.over(&mesh),
            |tree| cached::encode(&Topology::of(tree)),
            || bvh::build(&mesh, &options.bvh, monitor),
        )
    })?;
    let (mut meshes, mut reports, mut probe) = (Vec::new(), (None, None, None), None);
    if options.structure != Structure::Bvh {
        let (marks, marks_report) = clock.time("marks", || {
            cache.stage(
                || cached::marks(geometry, &options.bvh),
                part,
                monitor,
                |bytes| cached::decode(bytes).filter(|m: &marks::Marks| m.suitable.len() == tree.nodes.len()),
                cached::encode,
                || marks::mark(&mesh, &tree, monitor),
            )
        })?;
        let (choice, costs_report) = clock.time("costs", || {
            let storage = limit::storage_on(&mesh, on_grid.as_ref(), &tree, options, monitor)?;
            structure::choose(source, &mesh, &tree, &marks, options, storage, monitor)
        })?;
        let (built, tets_report) = clock.time("tets", || {
            tets::build_cached(&mesh, &tree, &choice.chosen, &options.tets, cache, monitor)
        })?;
        structure::check_built(source, &tree, &built, options)?;
        (meshes, probe) = clock.time("probe", || structure::probe(&mesh, &tree, built, options, monitor))?;
        let made = limit::Made { mesh: &mesh, on_grid: on_grid.as_ref(), tree: &tree, options };
        if let Some(most) =
            options.costs.max_bytes_per_triangle.filter(|_| options.structure == Structure::Bth)
        {
            meshes = clock.time("limit", || made.within(most, meshes, &choice, probe.as_mut(), monitor))?;
        }
        reports = (Some(marks_report), costs_report, Some(tets_report));
    }
    let (object, collapse) =
        clock.time("collapse", || object((mesh, on_grid), tree, meshes, options, monitor))?;
    let (marks, costs, tets) = reports;
    let coordinates = object.on_grid.as_ref().map(coordinates::OnGrid::report);
    Ok((object, Reports { coordinates, bvh: bvh_report, marks, costs, tets, probe, collapse }))
}

/// Joins what the stages made of a mesh.
fn object(
    (mesh, on_grid): (mesh::Mesh, Option<coordinates::OnGrid>),
    tree: bvh::BinaryBvh,
    built: Vec<(u32, tets::TetMesh)>,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<(Object, bvh::CollapseReport)> {
    let (cut, meshes): (Vec<u32>, Vec<tets::TetMesh>) = built.into_iter().unzip();
    let Joined { wide, packed_nodes, collapse } =
        wide(&mesh, on_grid.as_ref(), &tree, &cut, options, monitor)?;
    if options.coordinates.boxes == Boxes::Bytes && !packed_nodes {
        monitor.warn("boxes of nodes stay f32: coordinates are too great for steps of bytes");
    }
    let encoded = (!meshes.is_empty())
        .then(|| tets::encode(&meshes, &wide.subtrees, options.record, mesh.triangles.len()));
    let (tet_leaves, tet_triangles) =
        (meshes.len() as u64, meshes.iter().map(|m| m.faces.len() as u64).sum());
    Ok((Object { mesh, on_grid, tree, wide, packed_nodes, encoded, tet_leaves, tet_triangles }, collapse))
}

/// A wide BVH as it will be stored.
struct Joined {
    wide: bvh::Wide,
    packed_nodes: bool,
    collapse: bvh::CollapseReport,
}

/// The wide BVH over a tree, tet leaves in place of nodes.
fn wide(
    mesh: &mesh::Mesh,
    on_grid: Option<&coordinates::OnGrid>,
    tree: &bvh::BinaryBvh,
    cut: &[u32],
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Joined> {
    let collapse_options = bvh::CollapseOptions { keep_subtrees: options.keep_subtrees, ..options.collapse };
    let (mut wide, mut collapse) = bvh::collapse(mesh, tree, cut, &collapse_options, monitor)?;
    let grid = on_grid.map(|on_grid| &on_grid.grid);
    let packed_nodes = coordinates::pack(&mut wide, grid, options.coordinates.boxes == Boxes::Bytes)?;
    collapse.measure(&wide);
    Ok(Joined { wide, packed_nodes, collapse })
}

/// The bytes of a file from a mesh, its binary BVH and the tetrahedralizations of some of its nodes: for
/// measurements, which make one of these and look at it in several forms.
///
/// # Errors
/// A limit of the format, cancellation.
pub fn assemble(
    mesh: &mesh::Mesh,
    tree: &bvh::BinaryBvh,
    built: &[(u32, tets::TetMesh)],
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<Compiled> {
    let (object, _) = object((mesh.clone(), None), tree.clone(), built.to_vec(), options, monitor)?;
    let (bytes, _) = parts::file(&object, "{}".to_owned(), options)?;
    Ok(Compiled { bytes })
}

/// Times the stages on the wall clock; a stage that comes again adds to its time.
#[derive(Default)]
pub(crate) struct Clock(pub(crate) Vec<StageTime>);

impl Clock {
    pub(crate) fn time<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(Clock(vec![StageTime { name, seconds: start.elapsed().as_secs_f64() }]));
        result
    }

    /// Adds what another has timed.
    pub(crate) fn add(&mut self, other: Clock) {
        for StageTime { name, seconds } in other.0 {
            match self.0.iter_mut().find(|stage| stage.name == name) {
                Some(stage) => stage.seconds += seconds,
                None => self.0.push(StageTime { name, seconds }),
            }
        }
    }
}
