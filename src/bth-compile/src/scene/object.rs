//! One object of a scene: from the cache, else built and kept, by one process if others want the same.

use super::compile::Context;
use super::meshes::Found;
use super::objects::ObjectReport;
use super::sources::File;
use crate::cached::ObjectKeys;
use crate::costs;
use crate::error::{Error, Result};
use crate::pipeline::{self, Clock, Options, parts};
use crate::tets;
use crate::write::{self, FileBuilder, object};
use bth_cache::Key;
use serde::{Deserialize, Serialize};

/// Bytes that building takes for each triangle (measured: 14 for each byte of a binary mesh)...
const MEMORY_PER_TRIANGLE: u64 = 320;
/// ...and in any case.
const MEMORY_AT_LEAST: u64 = 4 << 20;

/// An object with its sections, every index of which has been checked.
pub(super) struct Built {
    pub(super) file: bth_format::File,
    pub(super) facts: Facts,
}

/// What the cache says of an object.
#[derive(Serialize, Deserialize)]
pub(super) struct Facts {
    pub(super) object: ObjectReport,
    pub(super) worker: Option<tets::WorkerStatus>,
}

/// Bytes that building an object takes, by an estimate.
pub(super) fn memory(triangles: u64) -> u64 {
    triangles.saturating_mul(MEMORY_PER_TRIANGLE).saturating_add(MEMORY_AT_LEAST)
}

/// An object, from the cache or built. `number` is that of the file, by which the scene's rays count.
pub(super) fn build(
    file: &File<'_>,
    mesh: &mut Found,
    context: &Context<'_>,
    number: usize,
    clock: &mut Clock,
) -> Result<Built> {
    let part = file.name_of(mesh.number);
    let rays = context.weights.as_ref().and_then(|weights| weights.get(number));
    let Some(rays) = rays else {
        let key = context.keys.as_ref().map(|keys| keys.of(&mesh.facts));
        return through(file, mesh, (key, &part), context.options, context, clock);
    };
    let costs = costs::Options { scene: Some(rays.clone()), ..context.options.costs.clone() };
    let options = Options { costs, ..context.options.clone() };
    let key = context.tetgen.as_ref().map(|tetgen| ObjectKeys::new(&options, tetgen).of(&mesh.facts));
    through(file, mesh, (key, &part), &options, context, clock)
}

/// What a key stands for.
fn through(
    file: &File<'_>,
    mesh: &mut Found,
    (key, part): (Option<Key>, &str),
    options: &Options,
    context: &Context<'_>,
    clock: &mut Clock,
) -> Result<Built> {
    let Context { cache, monitor, .. } = context;
    let _working = match &key {
        Some(key) => {
            if let Some(found) = kept(key, part, context) {
                return Ok(found);
            }
            let lock = cache.work(key, *monitor)?;
            if lock.as_ref().is_some_and(|lock| lock.waited)
                && let Some(found) = kept(key, part, context)
            {
                return Ok(found);
            }
            cache.miss(key, part);
            lock
        }
        None => None,
    };
    let triangles = clock.time("mesh", || mesh.take(file, context))?;
    let geometry = (triangles, &mesh.facts.geometry);
    let (built, reports) = pipeline::build(&file.full, part, geometry, options, cache, *monitor, clock)?;
    let report = ObjectReport {
        triangles: mesh.facts.report.triangles,
        degenerate: mesh.facts.report.degenerate,
        tet_leaves: built.tet_leaves,
        tet_triangles: built.tet_triangles,
        ..ObjectReport::default()
    };
    let worker = reports.tets.map(|r| r.worker).filter(|w| *w != tets::WorkerStatus::NotNeeded);
    let facts = Facts { object: report, worker };
    let bytes = clock.time("file", || {
        let mut builder = FileBuilder::new();
        object(&mut builder, 0, &parts::parts(&built, options))?;
        Ok::<_, Error>(builder.finish())
    })?;
    drop(built);
    let file = clock.time("file", || write::checked(&bytes))?;
    if let Some(key) = key {
        cache.put(&key, part, &bytes, &facts, *monitor);
    }
    Ok(Built { file, facts })
}

/// An object that the cache has.
fn kept(key: &Key, part: &str, context: &Context<'_>) -> Option<Built> {
    let record = context.cache.find(key, context.monitor)?;
    let file = context.cache.open(&record, context.monitor).filter(|file| file.object_count() == 1)?;
    let facts = serde_json::from_value(record.report).ok()?;
    context.cache.hit(key, part);
    Some(Built { file, facts })
}
