//! Compilation of triangles that are in memory, without files.
//!
//! The result is that of a model file with the same vertices and faces, for example a PLY file: all sections but PROVENANCE are
//! the same bytes, and so is the content id. PROVENANCE names the format `memory` and the hash of the arrays in place of those of
//! the file. A scene is that of a manifest whose nodes are called `instance 0`, `instance 1` and so on.
//!
//! ```
//! use bth_compile::memory::{TriangleMesh, open};
//!
//! let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = TriangleMesh { positions: &positions, triangles: &[[0, 1, 2]] };
//! let scene = open(mesh, &bth_compile::pipeline::CompileOptions::default(), &bth_compile::Silent)?;
//! let ray = bth::rays::Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
//! assert_eq!(scene.nearest(&ray).map(|hit| hit.t), Some(1.0));
//! # Ok::<(), bth_compile::Error>(())
//! ```

pub use crate::scene::Instance;
pub use crate::source::TriangleMesh;

use crate::cached::{self, Cache, CachedCompilation};
use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::pipeline::{
    Clock, CompileOptions, CompileReport, Compiled, Direct, compile_imported, warn_over_limit,
};
use crate::scene::{self, SceneReport};
use crate::source::{MESH_NAME, Model, SourceDigest};
use bth_cache::Record;
use bth_import::import_triangles;
use std::path::Path;

/// Compiles a mesh.
///
/// # Errors
/// `BTH-I005` for an index that is not a row of the positions, `BTH-I004` for a corner that is not finite, both with the row of
/// the triangle; else those of the stages: a limit of the format, cancellation.
pub fn compile(
    mesh: TriangleMesh<'_>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Compiled, CompileReport)> {
    let (file, report) = compile_checked(mesh, options, monitor)?;
    Ok((file.into(), report))
}

/// Compiles a mesh and opens the result. The bytes are not copied.
///
/// # Errors
/// As [`compile`].
pub fn open(mesh: TriangleMesh<'_>, options: &CompileOptions, monitor: &dyn Monitor) -> Result<bth::Scene> {
    let (file, _) = compile_checked(mesh, options, monitor)?;
    opened(bth::from_file(file))
}

/// Compiles a mesh through a cache. `needed` decides whether the bytes of a file in the cache are read; with
/// `&|_| true` the result always has the content.
///
/// # Errors
/// As [`compile`].
pub fn compile_cached(
    mesh: TriangleMesh<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<CompileReport>> {
    cached::compile_triangles(mesh, options, cache, needed, monitor)
}

/// Compiles a scene of meshes, each of which may have any number of instances; with [`Cache::none`] without a cache. Row i of
/// `instances` is instance i of the scene. Meshes without an instance are left out and equal ones are stored once, so the file
/// may have fewer objects than there are meshes. The result always has the content.
///
/// # Errors
/// As [`compile`], for each mesh; `BTH-I005` for an instance of no mesh, `BTH-I004` and `BTH-I050` for one whose transform is not
/// finite or flattens the mesh.
pub fn compile_scene(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<SceneReport>> {
    scene::compile_meshes(meshes, instances, options, cache, monitor)
}

/// As [`compile_scene`] without a cache, opened.
///
/// # Errors
/// As [`compile_scene`].
pub fn open_scene(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<bth::Scene> {
    let outcome = compile_scene(meshes, instances, options, &Cache::none(), monitor)?;
    let content = outcome.content.unwrap_or_else(|| unreachable!("the content was asked for"));
    opened(bth::from_bytes(&cached::joined(&content)?))
}

fn compile_checked(
    mesh: TriangleMesh<'_>,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(bth_format::File, CompileReport)> {
    let mut clock = Clock::default();
    let digest = clock.time("hash", || SourceDigest::of_triangles(mesh));
    let model = Model { path: Path::new(MESH_NAME), digest: &digest };
    let import = || import_triangles(model.path, mesh.positions, mesh.triangles, options.wanted(), monitor);
    let imported = clock.time("mesh", import)?;
    let (file, report) = compile_imported(&model, imported, options, &mut Direct, clock, monitor)?;
    warn_over_limit(&report.file, options, monitor);
    Ok((file, report))
}

fn opened(scene: std::result::Result<bth::Scene, bth::Error>) -> Result<bth::Scene> {
    scene.map_err(|e| Error::Internal { code: "BTH-X030", message: format!("the written file fails: {e}") })
}
