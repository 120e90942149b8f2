//! One object of a scene: from the cache, else built and kept, by one process if others want the
//! same.

use super::context::Context;
use super::meshes::{self, SourceMesh, object_key};
use super::report::ObjectReport;
use super::sections::ObjectSections;
use super::sources::File;
use crate::cached::replay;
use crate::error::Result;
use crate::monitor::{Monitor, Recording};
use crate::options::CompileOptions;
use crate::pipeline::{Compiler, in_parts, may_be_in_parts, warn_of_options};
use crate::shard::Shard;
use crate::stage::Clock;
use crate::tets;
use crate::write::{self, FileBuilder, object as object_sections};
use bth_cache::Key;
use serde::{Deserialize, Serialize};

/// Bytes of memory that building an object takes for each triangle (measured: 14 for each byte of a
/// binary mesh).
const MEMORY_PER_TRIANGLE: u64 = 320;
/// Bytes of memory that building an object takes in addition.
const MEMORY_AT_LEAST: u64 = 4 << 20;

/// An object with its sections. Every index in them has been checked.
pub(super) struct BuiltObject {
    pub(super) sections: ObjectSections,
    pub(super) record: ObjectRecord,
}

/// The report that the cache keeps with an object.
#[derive(Serialize, Deserialize)]
pub(super) struct ObjectRecord {
    pub(super) object: ObjectReport,
    pub(super) worker: Option<tets::WorkerStatus>,
}

/// Estimated bytes of memory that building an object takes.
pub(super) fn memory(triangles: u64) -> u64 {
    triangles.saturating_mul(MEMORY_PER_TRIANGLE).saturating_add(MEMORY_AT_LEAST)
}

/// An object, from the cache or built.
pub(super) fn build(
    file: &File<'_>,
    mesh: &mut SourceMesh,
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<BuiltObject> {
    let part = file.name_of(mesh.part);
    let key = object_key(&mesh.summary, mesh.part, context);
    let options = match mesh.summary.deforms() {
        true => context.options.of_deforming(),
        false => context.options.clone(),
    };
    let Context { cache, monitor, .. } = context;
    let fetched = || key.as_ref().and_then(|key| fetch(key, &part, context));
    let (found, _working) = cache.find_or_lock((key.as_ref(), &part), *monitor, fetched)?;
    if let Some((found, record)) = found {
        return Ok(BuiltObject { sections: found.keep(context)?, record });
    }
    let recording = Recording::new(*monitor);
    let (built, record) = compile(file, mesh, (&part, &options), (context, &recording), clock)?;
    let kept = key.and_then(|key| cache.put(&key, &part, built.bytes(), &record, &recording));
    let pinned = kept.and_then(|kept| context.keeper.pin(&kept, cache, *monitor));
    let found = pinned.map_or(Fetched::InMemory(built), Fetched::Pinned);
    Ok(BuiltObject { sections: found.keep(context)?, record })
}

/// Builds those parts of a file's objects into the cache that belong to a shard, as
/// [`compile_objects`](super::compile_objects) says; `first` is the number of the file's first
/// object. Returns for each object the number of its parts here; `None` if it is not built in parts
/// or in the cache as a whole.
pub(super) fn parts_of(
    file: &File<'_>,
    (shard, first): (Shard, u64),
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Vec<Option<u64>>> {
    let Context { options, cache, monitor, .. } = *context;
    if file.compiled || file.moving.is_some() || !may_be_in_parts(&file.full, options) {
        return Ok(Vec::new());
    }
    let mut one = |(row, mut mesh): (u64, SourceMesh)| {
        let SourceMesh { summary, part, .. } = &mesh;
        let (name, hash) = (file.name_of(*part), summary.geometry);
        let key = object_key(summary, *part, context);
        let kept = key.and_then(|key| cache.find(&key, monitor)).is_some_and(|record| cache.holds(&record));
        if kept || summary.deforms() || !in_parts(summary.report.triangles, options) {
            return Ok(None);
        }
        let triangles = mesh.take(file, context)?;
        let source = file.full.as_path();
        let compiler = Compiler { source, part: &name, options, cache, clock: &mut *clock, monitor };
        compiler.parts_of(triangles, hash.into(), (shard, row))
    };
    (first..).zip(meshes::read(file, context)?).map(&mut one).collect()
}

/// An object in memory or in the cache.
enum Fetched {
    InMemory(bth_format::File),
    Pinned(ObjectSections),
}

impl Fetched {
    fn keep(self, context: &Context<'_>) -> Result<ObjectSections> {
        match self {
            Self::InMemory(file) => context.keeper.keep(file),
            Self::Pinned(sections) => Ok(sections),
        }
    }
}

/// Compiles a mesh into a file with one object.
fn compile(
    file: &File<'_>,
    mesh: &mut SourceMesh,
    (part, options): (&str, &CompileOptions),
    (context, monitor): (&Context<'_>, &dyn Monitor),
    clock: &mut Clock,
) -> Result<(bth_format::File, ObjectRecord)> {
    let triangles = clock.time("mesh", || mesh.take(file, context))?;
    if mesh.summary.deforms() {
        warn_of_options(part, context.options, monitor);
    }
    let poses = mesh.part.clip().and_then(|clip| file.clips.poses(&clip, &triangles));
    let (source, cache) = (file.full.as_path(), context.cache);
    let compiler = Compiler { source, part, options, cache, clock: &mut *clock, monitor };
    let (built, reports) = match poses {
        Some(poses) => compiler.moving(triangles, &poses)?,
        None => compiler.object(triangles, mesh.summary.geometry.into())?,
    };
    let object = ObjectReport {
        triangles: mesh.summary.report.triangles,
        degenerate: mesh.summary.report.degenerate,
        rounding: mesh.summary.report.rounding,
        avoided_rounding: mesh.summary.report.avoided_rounding,
        tet_leaves: built.tet_leaves,
        tet_triangles: built.tet_triangles,
        opacity: mesh.summary.report.opacity,
        motion: built.motion.clone(),
        ..ObjectReport::default()
    };
    let record = ObjectRecord { object, worker: reports.worker().cloned() };
    let file = clock.time("file", || {
        let mut builder = FileBuilder::new();
        object_sections(&mut builder, 0, &built.parts(options))?;
        write::open(&builder)
    })?;
    Ok((file, record))
}

/// An object from the cache.
fn fetch(key: &Key, part: &str, context: &Context<'_>) -> Option<(Fetched, ObjectRecord)> {
    let Context { cache, keeper, monitor, .. } = context;
    let record = cache.find(key, *monitor)?;
    let found = match keeper.pin(&record, cache, *monitor) {
        Some(sections) => Fetched::Pinned(sections),
        None => Fetched::InMemory(cache.open(&record, *monitor).filter(|file| file.object_count() == 1)?),
    };
    let report = ObjectRecord::deserialize(&record.report).ok()?;
    cache.hit(key, part);
    replay(&record.report, *monitor);
    Some((found, report))
}
