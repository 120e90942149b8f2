//! One object of a scene: from the cache, else built and kept, by one process if others want the same.

use super::context::Context;
use super::meshes::SourceMesh;
use super::object_key::object_key;
use super::report::ObjectReport;
use super::sources::File;
use crate::cached::{CachedStages, ObjectKeys, replay};
use crate::costs;
use crate::error::Result;
use crate::monitor::{Monitor, Recording};
use crate::options::CompileOptions;
use crate::pipeline::{self, Clock};
use crate::tets;
use crate::write::{self, FileBuilder, object};
use bth_cache::Key;
use serde::{Deserialize, Serialize};

/// Bytes of memory that building an object takes for each triangle (measured: 14 for each byte of a binary mesh).
const MEMORY_PER_TRIANGLE: u64 = 320;
/// Bytes of memory that building an object takes in addition.
const MEMORY_AT_LEAST: u64 = 4 << 20;

/// An object with its sections, of which every index has been checked.
pub(super) struct BuiltObject {
    pub(super) file: bth_format::File,
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

/// An object, from the cache or built. `number` is its number in the file, which selects the scene's rays.
pub(super) fn build(
    file: &File<'_>,
    mesh: &mut SourceMesh,
    context: &Context<'_>,
    number: usize,
    clock: &mut Clock,
) -> Result<BuiltObject> {
    let part = file.name_of(mesh.part);
    let rays = context.known_rays.as_ref().and_then(|rays| rays.get(number));
    let deforms = mesh.summary.deformation.is_some();
    let Some(rays) = rays.filter(|_| !deforms) else {
        let key = object_key(&mesh.summary, mesh.part, context);
        let of_deforming = deforms.then(|| context.options.of_deforming());
        let options = of_deforming.as_ref().unwrap_or(context.options);
        return build_or_fetch(file, mesh, (key, &part), options, context, clock);
    };
    let costs = costs::CostOptions { rays: Some(rays.clone()), ..context.options.costs.clone() };
    let options = CompileOptions { costs, ..context.options.clone() };
    let key = context.tetgen.as_ref().map(|tetgen| ObjectKeys::new(&options, tetgen).of(&mesh.summary, None));
    build_or_fetch(file, mesh, (key, &part), &options, context, clock)
}

/// The object of a key: from the cache, else built and kept.
fn build_or_fetch(
    file: &File<'_>,
    mesh: &mut SourceMesh,
    (key, part): (Option<Key>, &str),
    options: &CompileOptions,
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<BuiltObject> {
    let Context { cache, monitor, .. } = context;
    let fetched = || key.as_ref().and_then(|key| fetch(key, part, context));
    let (found, _working) = cache.find_or_lock((key.as_ref(), part), *monitor, fetched)?;
    if let Some(found) = found {
        return Ok(found);
    }
    let recording = Recording::new(*monitor);
    let monitor: &dyn Monitor = &recording;
    let triangles = clock.time("mesh", || mesh.take(file, context))?;
    if mesh.summary.deformation.is_some() {
        pipeline::warn_of_options(part, context.options, monitor);
    }
    let poses = mesh.part.clip().and_then(|clip| file.clips.poses(&clip, &triangles));
    let (built, reports) = match poses {
        Some(poses) => pipeline::compile_moving((triangles, &poses), options, clock, monitor)?,
        None => {
            let stages = &mut CachedStages::of_object(cache, part, mesh.summary.geometry);
            pipeline::compile_mesh(&file.full, triangles, options, stages, clock, monitor)?
        }
    };
    let report = ObjectReport {
        triangles: mesh.summary.report.triangles,
        degenerate: mesh.summary.report.degenerate,
        tet_leaves: built.tet_leaves,
        tet_triangles: built.tet_triangles,
        opacity: mesh.summary.report.opacity,
        motion: built.motion.clone(),
        ..ObjectReport::default()
    };
    let worker = reports.tets.map(|r| r.worker).filter(|w| *w != tets::WorkerStatus::NotNeeded);
    let record = ObjectRecord { object: report, worker };
    let file = clock.time("file", || {
        let mut builder = FileBuilder::new();
        object(&mut builder, 0, &built.parts(options))?;
        for (number, segment) in (1..).zip(&built.segment_objects) {
            object(&mut builder, number, &segment.parts(options))?;
        }
        write::open(&builder)
    })?;
    drop(built);
    if let Some(key) = key {
        cache.put(&key, part, file.bytes(), &record, &recording);
    }
    Ok(BuiltObject { file, record })
}

/// An object from the cache.
fn fetch(key: &Key, part: &str, context: &Context<'_>) -> Option<BuiltObject> {
    let record = context.cache.find(key, context.monitor)?;
    let file = context.cache.open(&record, context.monitor).filter(|file| file.object_count() >= 1)?;
    let report = ObjectRecord::deserialize(&record.report).ok()?;
    context.cache.hit(key, part);
    replay(&record.report, context.monitor);
    Some(BuiltObject { file, record: report })
}
