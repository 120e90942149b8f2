//! Compilation of triangles that are in memory, without files. [`pipeline::compile`] takes one
//! mesh, too.
//!
//! The result is the same as from a model file with the same vertices and faces, for example a PLY
//! file: all sections but PROVENANCE are the same bytes, and so is the content id. PROVENANCE names
//! the format `memory` and the hash of the arrays instead of the file's. A scene is compiled like a
//! manifest whose nodes are called `instance 0`, `instance 1` and so on.
//!
//! ```
//! use bth_compile::memory::{PositionRows, TriangleMesh, open};
//! use bth_compile::{Silent, pipeline::CompileOptions};
//!
//! let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let mesh = TriangleMesh { positions: PositionRows::F32(&positions), triangles: &[[0, 1, 2]] };
//! let scene = open(mesh, &CompileOptions::default(), &Silent)?;
//! let ray = bth::rays::Ray::new([0.25, 0.25, 1.0], [0.0, 0.0, -1.0]);
//! assert_eq!(scene.nearest(&ray).map(|hit| hit.t), Some(1.0));
//! # Ok::<(), bth_compile::Error>(())
//! ```

pub use crate::scene::{Instance, SceneNames};
pub use crate::source::TriangleMesh;
pub use bth_import::PositionRows;

use crate::cached::Cache;
use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::pipeline::{self, CachedCompilation, CompileOptions};
use crate::scene::{self, SceneReport};
use crate::write::Content;

/// Compiles a mesh and opens the result. The bytes are not copied.
///
/// # Errors
/// The errors of [`pipeline::compile`].
pub fn open(mesh: TriangleMesh<'_>, options: &CompileOptions, monitor: &dyn Monitor) -> Result<bth::Scene> {
    let (content, _) =
        pipeline::compile_cached(mesh, options, &Cache::none(), &|_| true, monitor)?.into_built();
    opened(content)
}

/// Compiles a scene of meshes, each with any number of instances; with [`Cache::none`] without a
/// cache. Row i of `instances` is instance i of the scene. Skips meshes without an instance and
/// stores equal ones once, so the file may have fewer objects than there are meshes. The result
/// always has the content.
///
/// # Errors
/// The errors of [`pipeline::compile`], for each mesh; `BTH-I005` for an instance of no mesh,
/// `BTH-I004` and `BTH-I050` for one whose transform is not finite or flattens the mesh.
pub fn compile_scene(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<SceneReport>> {
    compile_named_scene(meshes, instances, SceneNames::default(), options, cache, monitor)
}

/// Like [`compile_scene`], with names of meshes and instances.
///
/// # Errors
/// The errors of [`compile_scene`].
pub fn compile_named_scene(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    names: SceneNames<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<SceneReport>> {
    scene::compile_meshes(meshes, instances, names, options, cache, monitor)
}

/// Compiles a scene without a cache and opens it; see [`compile_scene`].
///
/// # Errors
/// The errors of [`compile_scene`].
pub fn open_scene(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<bth::Scene> {
    let (content, _) = compile_scene(meshes, instances, options, &Cache::none(), monitor)?.into_built();
    opened(content)
}

fn opened(content: Content) -> Result<bth::Scene> {
    let scene = match content.file() {
        Some(file) => bth::from_file(file.clone()),
        None => bth::from_bytes(&content.bytes()?),
    };
    scene.map_err(|e| Error::Internal { code: "BTH-X030", message: format!("the written file fails: {e}") })
}
