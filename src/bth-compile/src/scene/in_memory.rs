//! The compilation of a scene whose meshes and instances are in memory.

use super::compile::{CachePolicy, through_cache};
use super::context::Context;
use super::keeper::Keeper;
use super::plan::ScenePlan;
use super::report::SceneReport;
use super::sources::{File, SourcePart};
use crate::cached::Cache;
use crate::error::{Error, Place, Result};
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::pipeline::CachedCompilation;
use crate::source::{SourceDigest, TriangleMesh};
use crate::stage::Clock;
use bth_scene::{Manifest, Node, Nodes, Object, Source, Transform};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

/// A mesh at a place in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Row of the mesh.
    pub mesh: u32,
    /// Rows of the transform from the mesh's space to the world, applied to columns (x, y, z, 1):
    /// finite and either invertible or, for an invisible instance, without size.
    pub to_world: [[f64; 4]; 3],
}

/// Names of the meshes and instances of a scene, one for each of them, which the file keeps.
/// Without them they are called `mesh 0`, `instance 0` and so on.
#[derive(Clone, Copy, Debug, Default)]
pub struct SceneNames<'a> {
    /// Names of meshes. Of equal meshes, which are stored once, the first one's counts.
    pub meshes: Option<&'a [String]>,
    /// Names of instances.
    pub instances: Option<&'a [String]>,
}

/// Name of the scene in messages.
const SCENE_NAME: &str = "scene";

/// See [`crate::memory::compile_named_scene`].
pub(crate) fn compile_meshes(
    meshes: &[TriangleMesh<'_>],
    instances: &[Instance],
    names: SceneNames<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<SceneReport>> {
    check(meshes.len(), instances)?;
    let manifest = manifest(meshes.len(), instances, names);
    let keeper = Arc::new(Keeper::in_memory());
    let context = Context { keeper, ..Context::new(options, cache, monitor)? };
    let mut clock = Clock::default();
    let plan = plan(&manifest, meshes, &mut clock);
    let policy = CachePolicy { whole: false, needed: &|_| true };
    through_cache(&manifest, &plan, Path::new(SCENE_NAME), &context, clock, policy)
}

/// Refuses instances of no mesh and transforms that are not finite.
fn check(meshes: usize, instances: &[Instance]) -> Result<()> {
    for (row, instance) in instances.iter().enumerate() {
        let refused = |code, message, hint: &str| {
            let place = Place::Part(SCENE_NAME.into(), format!("instance {row}"));
            Err(Error::Input { code, place, message, hint: hint.to_owned() })
        };
        if instance.mesh as usize >= meshes {
            let message = format!("mesh {} of {meshes} meshes", instance.mesh);
            return refused("BTH-I005", message, "meshes count from 0");
        }
        if let Some(x) = instance.to_world.as_flattened().iter().find(|x| !x.is_finite()) {
            return refused("BTH-I004", format!("expected a finite transform, found {x}"), "");
        }
    }
    Ok(())
}

/// The manifest of a scene in which each instance has a separate node.
fn manifest(meshes: usize, instances: &[Instance], names: SceneNames<'_>) -> Manifest {
    fn named(names: Option<&[String]>, row: usize, other: impl Fn() -> String) -> Cow<'_, str> {
        names.and_then(|names| names.get(row)).map_or_else(|| other().into(), |name| name.into())
    }
    let object = |row| {
        let path = format!("mesh {row}");
        let name = named(names.meshes, row, || path.clone());
        Object::new(name, Source::Model { path, mesh: None })
    };
    let mut nodes = Nodes::with_capacity(instances.len());
    for (row, instance) in instances.iter().enumerate() {
        nodes.push(Node {
            name: &named(names.instances, row, || format!("instance {row}")),
            parent: None,
            transform: Transform::Matrix(instance.to_world),
            object: Some(instance.mesh as usize),
            group: None,
            visible: true,
        });
    }
    Manifest { objects: (0..meshes).map(object).collect(), nodes, ..Manifest::default() }
}

/// The plan of a manifest made by [`manifest`]. All instances count as visible: if one without size
/// were skipped, the ones behind it would be renumbered.
fn plan<'a>(manifest: &'a Manifest, meshes: &[TriangleMesh<'a>], clock: &mut Clock) -> ScenePlan<'a> {
    let count = manifest.nodes.len();
    let mut used = vec![false; meshes.len()];
    manifest.nodes.iter().filter_map(|node| node.object).for_each(|object| used[object] = true);
    let several = used.iter().filter(|used| **used).count() > 1;
    let file = |row: usize| {
        let path = manifest.objects[row].source.path();
        let digest = SourceDigest::of_triangles(meshes[row]);
        let in_memory = Some(meshes[row]);
        File {
            path,
            shown: several.then_some(path),
            full: path.into(),
            compiled: false,
            parts: vec![(SourcePart::Whole, vec![row])],
            digest,
            moving: None,
            clips: Default::default(),
            in_memory,
        }
    };
    let rows: Vec<usize> = (0..meshes.len()).filter(|row| used[*row]).collect();
    let sources = clock.time("hash", || rows.into_par_iter().map(file).collect());
    ScenePlan { order: (0..count).collect(), visible: vec![true; count], used, sources }
}
