//! A manifest into a file: objects that may be seen, then the scene.

use super::objects::{self, ObjectReport, Objects};
use super::outline::Outline;
use super::previous::{Previous, keep_outline};
use super::{encode, meshes, sources, visible, weights};
use crate::cached::{self, Cache, ObjectKeys};
use crate::costs;
use crate::error::{self, Error, Result};
use crate::monitor::Monitor;
use crate::pipeline::{self, Clock, Compiled, Foreseen, Options, Outcome, StageTime, Structure, provenance};
use crate::tets::WorkerStatus;
use crate::write::{self, Content, FileBuilder, SceneParts};
use bth_cache::{Key, Record};
use bth_scene::Manifest;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// What a scene file holds and how it was made.
#[derive(Clone, Debug, Serialize)]
pub struct SceneReport {
    /// What each stage took, all objects together.
    pub seconds: Vec<StageTime>,
    /// Objects of the file, in order.
    pub objects: Vec<ObjectReport>,
    /// Objects of the manifest that no visible instance uses.
    pub unused: Vec<String>,
    /// Nodes.
    pub nodes: u64,
    /// Instances that may be seen.
    pub instances: u64,
    /// Tracks.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// First frame.
    pub first_frame: i32,
    /// Last frame.
    pub last_frame: i32,
    /// Frames per second.
    pub rate: f64,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Triangles of all instances.
    pub instanced_triangles: u64,
    /// Bytes of the file.
    pub bytes: u64,
    /// Bytes of the objects' sections that traversal reads.
    pub resident_bytes: u64,
    /// The tetrahedralization worker, if one was needed.
    pub worker: Option<WorkerStatus>,
}

/// What the parts of a compilation need.
pub(super) struct Context<'a> {
    pub(super) options: &'a Options,
    pub(super) cache: &'a Cache<'a>,
    /// The tetrahedralizer as it stands in keys; nothing when objects may not be kept.
    pub(super) tetgen: Option<String>,
    /// The keys of objects, if they may be kept.
    pub(super) keys: Option<Arc<ObjectKeys>>,
    pub(super) monitor: &'a dyn Monitor,
    /// The scene's rays for each object of the file, if they count.
    pub(super) weights: Option<Vec<Arc<costs::Weighting>>>,
    /// What an earlier compilation left where this one will write.
    pub(super) previous: Option<Arc<Previous>>,
}

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
    pipeline::say(over(&report.objects, options), monitor);
    Ok((Compiled { bytes: pipeline::joined(&content)?.into_owned() }, report))
}

/// Where a scene is.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a> {
    /// The folder that its paths count from.
    pub folder: &'a Path,
    /// What stands for it in messages.
    pub name: &'a Path,
}

/// What is kept of a scene besides its objects.
#[derive(Clone, Copy)]
pub struct Keep<'a> {
    /// Whether the whole file is, for mapping it. Else it is put together from its objects when it is needed.
    pub whole: bool,
    /// Whether the bytes of a file that is kept are needed.
    pub needed: &'a dyn Fn(&Record) -> bool,
    /// Where the file will be written: if the last one is still there, what has not changed is taken from it.
    pub target: Option<&'a Path>,
}

/// Compiles a scene, or takes what was made of the same content before.
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
    let outcome = pipeline::through(cache, key.as_ref(), keep.needed, monitor, || {
        context.previous = previous(keep.target, &context);
        let (content, report, outline) = build(manifest, &plan, place.name, &context, clock)?;
        if keep.target.is_some() && !options.costs.for_scene {
            keep_outline(&content.name(), &outline, &context);
        }
        Ok((content, report, keep.whole))
    })?;
    let objects = Vec::<ObjectReport>::deserialize(&outcome.report["objects"]).unwrap_or_default();
    pipeline::say(over(&objects, options), monitor);
    Ok(outcome)
}

/// Which objects are over the limit on bytes, in words; `None` if none are.
fn over(objects: &[ObjectReport], options: &Options) -> Option<String> {
    let most = options.costs.max_bytes_per_triangle?;
    let each = |o: &ObjectReport| o.resident_bytes as f64 / o.triangles.max(1) as f64;
    let over: Vec<&ObjectReport> = objects.iter().filter(|o| each(o) > most).collect();
    let worst = over.iter().max_by(|a, b| each(a).total_cmp(&each(b)))?;
    Some(format!(
        "{} of {} objects take more bytes a triangle than the limit of {most} allows, even without tetrahedra; the most \
         takes {}: {:.1}",
        over.len(),
        objects.len(),
        worst.names.first().map_or("an object", String::as_str),
        each(worst)
    ))
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

/// What [`compile_cached`] would find; `target` as in [`Keep`]. Reads and hashes all sources, and does nothing else.
///
/// # Errors
/// When a source cannot be read.
pub fn foresee(
    manifest: &Manifest,
    place: Place<'_>,
    options: &Options,
    cache: &Cache<'_>,
    target: Option<&Path>,
    monitor: &dyn Monitor,
) -> Result<Foreseen> {
    let mut context = Context::new(options, cache, monitor)?;
    context.previous = previous(target, &context);
    let plan = Plan::of(manifest, place.folder, &mut Clock::default())?;
    let mut foreseen = Foreseen::of(key(manifest, &plan, &context)?.as_ref(), cache, monitor);
    if foreseen.record.is_none() {
        for file in plan.sources.iter().filter(|file| !file.compiled) {
            if objects::known(file, &context).is_some() {
                foreseen.kept += file.parts.len() as u64;
                continue;
            }
            let missing = meshes::missing(file, &context);
            foreseen.kept += (file.parts.len() - missing.len()) as u64;
            foreseen.parts.extend(missing);
        }
    }
    Ok(foreseen)
}

/// What an earlier compilation left, if it is of use: with the scene's rays an object depends on all others.
fn previous(target: Option<&Path>, context: &Context<'_>) -> Option<Arc<Previous>> {
    let target = target.filter(|_| !context.options.costs.for_scene)?;
    Previous::open(target, context).map(Arc::new)
}

/// The key of a scene, if it may be kept.
fn key(manifest: &Manifest, plan: &Plan<'_>, context: &Context<'_>) -> Result<Option<Key>> {
    let Some(tetgen) = &context.tetgen else { return Ok(None) };
    let as_they_are: Vec<_> = (0..manifest.objects.len() as u32).map(Some).collect();
    let parts = encode::encode(manifest, &plan.order, &plan.visible, &as_they_are)?;
    Ok(Some(cached::scene(&parts, &sources::contents(manifest, &plan.sources), context.options, tetgen)))
}

impl<'a> Context<'a> {
    fn new(options: &'a Options, cache: &'a Cache<'a>, monitor: &'a dyn Monitor) -> Result<Self> {
        Ok(Self::of(options, cache, pipeline::tetgen(options, cache, monitor)?, monitor))
    }

    fn of(
        options: &'a Options,
        cache: &'a Cache<'a>,
        tetgen: Option<String>,
        monitor: &'a dyn Monitor,
    ) -> Self {
        let keys = tetgen.as_ref().map(|tetgen| Arc::new(ObjectKeys::new(options, tetgen)));
        Self { options, cache, tetgen, keys, monitor, weights: None, previous: None }
    }

    /// With somebody else who watches.
    pub(super) fn with_monitor<'b>(&'b self, monitor: &'b dyn Monitor) -> Context<'b> {
        let Self { options, cache, ref tetgen, ref keys, ref weights, ref previous, .. } = *self;
        Context {
            options,
            cache,
            tetgen: tetgen.clone(),
            keys: keys.clone(),
            monitor,
            weights: weights.clone(),
            previous: previous.clone(),
        }
    }
}

/// What is to be done.
struct Plan<'a> {
    /// Nodes with parents before children.
    order: Vec<usize>,
    visible: Vec<bool>,
    used: Vec<bool>,
    sources: Vec<sources::File<'a>>,
}

impl<'a> Plan<'a> {
    fn of(manifest: &'a Manifest, folder: &Path, clock: &mut Clock) -> Result<Self> {
        let order = encode::order(manifest);
        let visible = visible::visible(manifest, &order);
        let mut used = vec![false; manifest.objects.len()];
        for (node, _) in manifest.nodes.iter().zip(&visible).filter(|(_, visible)| **visible) {
            node.object.into_iter().for_each(|object| used[object] = true);
        }
        let sources = clock.time("hash", || sources::files(manifest, folder, &used))?;
        Ok(Self { order, visible, used, sources })
    }
}

fn build(
    manifest: &Manifest,
    plan: &Plan<'_>,
    name: &Path,
    context: &Context<'_>,
    mut clock: Clock,
) -> Result<(Content, SceneReport, Outline)> {
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
    let (content, outline) = clock.time("file", || {
        let mut builder = FileBuilder::new();
        objects.write(&mut builder)?;
        write::scene(&mut builder, &parts)?;
        builder.provenance(provenance)?;
        builder.check_limits()?;
        let (content, table) = builder.content();
        check(&objects, &parts, &content, name)?;
        Ok::<_, Error>((content, objects.outline_of(&table)))
    })?;

    let triangles = |object: u32| objects.reports[object as usize].triangles;
    let unused = manifest.objects.iter().zip(&plan.used).filter(|(_, used)| !**used);
    let report = SceneReport {
        seconds: clock.0,
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
        bytes: content.length(),
        resident_bytes: objects.reports.iter().map(|o| o.resident_bytes).sum(),
        worker: objects.worker.clone(),
        objects: objects.reports,
    };
    Ok((content, report, outline))
}

/// Checks what was put together as a reader will, without looking at the objects again: their sections have been checked
/// one by one.
fn check(objects: &Objects, parts: &SceneParts, content: &Content, name: &Path) -> Result<()> {
    let mut outline = FileBuilder::new();
    objects.outline(&mut outline)?;
    write::scene(&mut outline, parts)?;
    let first_frame = |bytes: &[u8]| bth::check_first_frame(&bth_format::File::from_bytes(bytes)?);
    // Places in messages are those in the whole file.
    let whole = |error| content.bytes().ok().and_then(|bytes| first_frame(&bytes).err()).unwrap_or(error);
    first_frame(&outline.finish()).map_err(|e| refused(name, &whole(e)))
}

/// The rays of the scene that concern each object of the file, by way of a file with BVHs only.
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
    let mut scene = bth::from_bytes(&pipeline::joined(&content)?).map_err(|e| refused(name, &e))?;
    Ok(weights::weights(&mut scene, name)?.into_iter().map(Arc::new).collect())
}

/// The error for a file that the library does not take: the scene's fault when its first frame cannot be shown,
/// else ours.
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
