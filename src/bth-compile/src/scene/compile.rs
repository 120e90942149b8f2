//! The compilation of a manifest into a file: the objects that may be seen, then the scene.

use super::context::Context;
use super::file_index::FileIndex;
use super::objects::{self, Objects};
use super::plan::Plan;
use super::previous::Previous;
use super::report::{ObjectReport, SceneReport};
use super::{encode, meshes, sources, weights};
use crate::cached::{self, Cache, DryRun, Outcome};
use crate::costs;
use crate::error::{self, Error, Result};
use crate::monitor::Monitor;
use crate::options::{Options, Structure};
use crate::pipeline::{Clock, Compiled, provenance};
use crate::tets::WorkerStatus;
use crate::write::{self, Content, FileBuilder, SceneParts};
use bth_cache::{Key, Record};
use bth_files::Digest;
use bth_scene::Manifest;
use serde::Deserialize;
use std::path::Path;
use std::sync::Arc;

/// Compiles a scene; paths of the manifest count from `folder`, `name` stands for the scene in messages.
///
/// # Errors
/// Those of the objects; `BTH-I050` when its first frame cannot be shown.
pub fn compile(
    manifest: &Manifest,
    folder: &Path,
    name: &Path,
    options: &Options,
    monitor: &dyn Monitor,
) -> Result<(Compiled, SceneReport)> {
    let cache = Cache::none();
    let context = Context::of(options, &cache, None, monitor);
    let mut clock = Clock::default();
    let plan = Plan::of(manifest, folder, &mut clock)?;
    let (content, report, _) = build(manifest, &plan, name, &context, clock)?;
    warn_over_limit(&report.objects, options, monitor);
    Ok((Compiled { bytes: cached::joined(&content)?.into_owned() }, report))
}

/// Where a scene is.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The folder that its paths count from.
    pub folder: &'a Path,
    /// What stands for it in messages.
    pub name: &'a Path,
}

/// What the cache keeps of a scene besides its objects, and what the caller needs of it.
#[derive(Clone, Copy)]
pub struct Keep<'a> {
    /// Whether the cache keeps the whole file, to be mapped. Else it is put together from its objects when it is needed.
    pub whole: bool,
    /// Whether the bytes of a file that the cache has are needed.
    pub needed: &'a dyn Fn(&Record) -> bool,
    /// Where the file will be written: objects that have not changed are copied from the file that is there.
    pub target: Option<&'a Path>,
}

/// Compiles a scene through the cache.
///
/// # Errors
/// As [`compile`]; `BTH-O002` when a source changes meanwhile.
pub fn compile_cached(
    manifest: &Manifest,
    place: Place<'_>,
    options: &Options,
    cache: &Cache<'_>,
    keep: Keep<'_>,
    monitor: &dyn Monitor,
) -> Result<Outcome<SceneReport>> {
    let mut context = Context::new(options, cache, monitor)?;
    let mut clock = Clock::default();
    let plan = Plan::of(manifest, place.folder, &mut clock)?;
    let key = key(manifest, &plan, &context)?;
    let outcome = cached::compile_or_fetch(cache, key.as_ref(), keep.needed, monitor, || {
        context.previous = previous(keep.target, &context);
        let (content, report, index) = build(manifest, &plan, place.name, &context, clock)?;
        if keep.target.is_some() && !options.costs.for_scene {
            keep_index(&content.name(), &index, &context);
        }
        Ok((content, report, keep.whole))
    })?;
    let objects = Vec::<ObjectReport>::deserialize(&outcome.report["objects"]).unwrap_or_default();
    warn_over_limit(&objects, options, monitor);
    Ok(outcome)
}

/// Warns if objects are over the limit on bytes.
fn warn_over_limit(objects: &[ObjectReport], options: &Options, monitor: &dyn Monitor) {
    let Some(most) = options.costs.max_bytes_per_triangle else { return };
    let each = |o: &ObjectReport| o.resident_bytes as f64 / o.triangles.max(1) as f64;
    let over: Vec<&ObjectReport> = objects.iter().filter(|o| each(o) > most).collect();
    let Some(worst) = over.iter().max_by(|a, b| each(a).total_cmp(&each(b))) else { return };
    monitor.warn(&format!(
        "{} of {} objects take more bytes a triangle than the limit of {most} allows, even without tetrahedra; the most \
         takes {}: {:.1}",
        over.len(),
        objects.len(),
        worst.names.first().map_or("an object", String::as_str),
        each(worst)
    ));
}

/// Compiles part `shard.0` of `shard.1` (from 1) of a scene's objects into the cache; how many there are in this part.
///
/// # Errors
/// As [`compile_cached`].
pub fn compile_objects(
    manifest: &Manifest,
    place: Place<'_>,
    options: &Options,
    cache: &Cache<'_>,
    shard: (u32, u32),
    monitor: &dyn Monitor,
) -> Result<u64> {
    let context = Context::new(options, cache, monitor)?;
    let mut clock = Clock::default();
    let mut plan = Plan::of(manifest, place.folder, &mut clock)?;
    let mut place = 0;
    for file in &mut plan.sources {
        file.parts.retain(|_| {
            place += 1;
            !file.compiled && (place - 1) % shard.1 == shard.0 - 1
        });
    }
    plan.sources.retain(|file| !file.parts.is_empty());
    let objects = objects::build(manifest, &plan.sources, &context, &mut clock)?;
    Ok(objects.reports.len() as u64)
}

/// What [`compile_cached`] would do; `target` as in [`Keep`]. Reads and hashes all sources, and does nothing else.
///
/// # Errors
/// When a source cannot be read.
pub fn dry_run(
    manifest: &Manifest,
    place: Place<'_>,
    options: &Options,
    cache: &Cache<'_>,
    target: Option<&Path>,
    monitor: &dyn Monitor,
) -> Result<DryRun> {
    let mut context = Context::new(options, cache, monitor)?;
    context.previous = previous(target, &context);
    let plan = Plan::of(manifest, place.folder, &mut Clock::default())?;
    let mut found = DryRun::of(key(manifest, &plan, &context)?.as_ref(), cache, monitor);
    if found.record.is_none() {
        for file in plan.sources.iter().filter(|file| !file.compiled) {
            if objects::parts_without_reading(file, &context).is_some() {
                found.reused += file.parts.len() as u64;
                continue;
            }
            let missing = meshes::missing(file, &context);
            found.reused += (file.parts.len() - missing.len()) as u64;
            found.parts.extend(missing);
        }
    }
    Ok(found)
}

/// The file of an earlier compilation at the target. Of no use with the scene's rays: then an object depends on all others.
fn previous(target: Option<&Path>, context: &Context<'_>) -> Option<Arc<Previous>> {
    let target = target.filter(|_| !context.options.costs.for_scene)?;
    let tetgen = context.tetgen.as_ref()?;
    Previous::open(target, context.options, tetgen, context.cache, context.monitor).map(Arc::new)
}

/// Keeps the index of a file under the name of its content.
fn keep_index(named: &Digest, index: &FileIndex, context: &Context<'_>) {
    if let Some(tetgen) = &context.tetgen {
        let key = cached::file_index(named, context.options, tetgen);
        context.cache.put_here(&key, &cached::encode(index), context.monitor);
    }
}

/// The key of a scene, if it may be kept.
fn key(manifest: &Manifest, plan: &Plan<'_>, context: &Context<'_>) -> Result<Option<Key>> {
    let Some(tetgen) = &context.tetgen else { return Ok(None) };
    let as_they_are: Vec<_> = (0..manifest.objects.len() as u32).map(Some).collect();
    let parts = encode::encode(manifest, &plan.order, &plan.visible, &as_they_are)?;
    Ok(Some(cached::scene(&parts, &sources::contents(manifest, &plan.sources), context.options, tetgen)))
}

/// Compiles the objects and puts the file together.
fn build(
    manifest: &Manifest,
    plan: &Plan<'_>,
    name: &Path,
    context: &Context<'_>,
    mut clock: Clock,
) -> Result<(Content, SceneReport, FileIndex)> {
    let options = context.options;
    let weighed;
    let context = match options.costs.for_scene && options.structure == Structure::Bth {
        true => {
            let weights = Some(clock.time("rays", || rays(manifest, plan, name, context))?);
            weighed = Context { weights, ..context.with_monitor(context.monitor) };
            &weighed
        }
        false => context,
    };
    let objects = objects::build(manifest, &plan.sources, context, &mut clock)?;
    let parts = encode::encode(manifest, &plan.order, &plan.visible, &objects.number)?;

    let tetgen = match &objects.worker {
        Some(WorkerStatus::Ready { tetgen }) => Some(tetgen.as_str()),
        _ => None,
    };
    let provenance = provenance::of_scene(&objects.sources, tetgen, options)?;
    let (content, index) = clock.time("file", || {
        let mut builder = FileBuilder::new();
        objects.write(&mut builder)?;
        write::scene(&mut builder, &parts)?;
        builder.provenance(provenance)?;
        builder.check_limits()?;
        let (content, table) = builder.content();
        check(&objects, &parts, &content, name)?;
        Ok::<_, Error>((content, objects.file_index(&table)))
    })?;

    let report = report(manifest, plan, (objects, clock), &parts, content.length());
    Ok((content, report, index))
}

/// The report on a compiled scene.
fn report(
    manifest: &Manifest,
    plan: &Plan<'_>,
    (objects, clock): (Objects, Clock),
    parts: &SceneParts,
    bytes: u64,
) -> SceneReport {
    let triangles = |object: u32| objects.reports[object as usize].triangles;
    let unused = manifest.objects.iter().zip(&plan.used).filter(|(_, used)| !**used);
    SceneReport {
        seconds: clock.into_times(),
        unused: unused.map(|(object, _)| object.name.clone()).collect(),
        nodes: parts.nodes.len() as u64,
        instances: parts.instances.len() as u64,
        tracks: parts.tracks.len() as u64,
        cameras: parts.cameras.len() as u64,
        lights: parts.lights.len() as u64,
        first_frame: manifest.frames.first,
        last_frame: manifest.frames.last,
        rate: manifest.frames.rate,
        triangles: objects.reports.iter().map(|o| o.triangles).sum(),
        instanced_triangles: parts.instances.iter().map(|i| triangles(i.object)).sum(),
        bytes,
        resident_bytes: objects.reports.iter().map(|o| o.resident_bytes).sum(),
        worker: objects.worker.clone(),
        objects: objects.reports,
    }
}

/// Checks the first frame as a reader will. The sections of the objects have been checked one by one before, so the check
/// reads a file with their OBJECT rows only.
fn check(objects: &Objects, parts: &SceneParts, content: &Content, name: &Path) -> Result<()> {
    let mut rows_only = FileBuilder::new();
    objects.write_rows(&mut rows_only)?;
    write::scene(&mut rows_only, parts)?;
    let first_frame = |bytes: &[u8]| bth::check_first_frame(&bth_format::File::from_bytes(bytes)?);
    // Offsets in messages are those in the whole file.
    let whole = |error| content.bytes().ok().and_then(|bytes| first_frame(&bytes).err()).unwrap_or(error);
    first_frame(&rows_only.finish()).map_err(|e| refused(name, &whole(e)))
}

/// The rays of the scene that reach each object of the file, traced through a file with BVHs only.
fn rays(
    manifest: &Manifest,
    plan: &Plan<'_>,
    name: &Path,
    context: &Context<'_>,
) -> Result<Vec<Arc<costs::Weighting>>> {
    let Context { cache, monitor, .. } = *context;
    let costs = costs::Options { for_scene: false, ..context.options.costs.clone() };
    let coordinates = Default::default();
    let options =
        Options { structure: Structure::Bvh, geometry: true, costs, coordinates, ..context.options.clone() };
    let tetgen = context.tetgen.as_ref().map(|_| String::new());
    let plain = Context::of(&options, cache, tetgen, monitor);
    let (content, ..) = build(manifest, plan, name, &plain, Clock::default())?;
    let mut scene = bth::from_bytes(&cached::joined(&content)?).map_err(|e| refused(name, &e))?;
    Ok(weights::weights(&mut scene, name)?.into_iter().map(Arc::new).collect())
}

/// The error for a file that fails the reader's check: an input error when the first frame cannot be shown, else a defect
/// of the compiler.
fn refused(name: &Path, error: &bth::Error) -> Error {
    match error.code() {
        bth::Code::Singular | bth::Code::NotFinite => Error::Input {
            code: "BTH-I050",
            place: error::Place::File(name.to_owned()),
            message: format!("the first frame cannot be shown: {error}"),
            hint: error.hint().to_owned(),
        },
        _ => Error::Internal { code: "BTH-X030", message: format!("the written file fails: {error}") },
    }
}
