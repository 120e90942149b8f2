//! The compilation of a manifest into a file: first the objects that may be visible, then the
//! scene.

use super::context::Context;
use super::objects::{self, Objects};
use super::plan::ScenePlan;
use super::report::{ObjectReport, SceneReport};
use super::{deformers, encode, meshes, object, sources, visible, whole_files};
use crate::cached::{Cache, HashedRows, Sink};
use crate::error::{self, Error, Result};
use crate::monitor::Monitor;
use crate::options::CompileOptions;
use crate::pipeline::{self, CachedCompilation, Compiled, DryRun, compile_or_fetch};
use crate::shard::Shard;
use crate::stage::Clock;
use crate::write::{self, Content, FileBuilder, SceneParts, SectionHead};
use bth::Trees;
use bth_cache::{Key, Record};
use bth_format::groups::Groups;
use bth_format::layout::{CacheLine, FEATURE_FIRST_TREES, NODE_LINES, NONE, Node, Tree, kind};
use bth_scene::Manifest;
use std::path::Path;
use zerocopy::IntoBytes;

/// Lines of trees from which on a file holds them: placing the rows of smaller ones when the file
/// is opened takes less than a millisecond.
const MIN_TREE_LINES: usize = 200 * NODE_LINES;
/// Lines of trees that are kept at a time.
const CHUNK: usize = 1 << 14;

/// Compiles a scene; paths of the manifest count from `folder`, `name` names the scene in messages.
///
/// # Errors
/// Errors of the objects; `BTH-I050` when its first frame cannot be shown.
pub fn compile(
    manifest: &Manifest,
    folder: &Path,
    name: &Path,
    options: &CompileOptions,
    monitor: &dyn Monitor,
) -> Result<(Compiled, SceneReport)> {
    let (source, cache) = (SceneSource { folder, name }, Cache::none());
    let policy = CachePolicy { whole: true, needed: &|_| true };
    let (content, report) = compile_cached(manifest, source, options, &cache, policy, monitor)?.into_built();
    Ok((Compiled { bytes: content.bytes()?.into_owned() }, report))
}

/// The folder and the name of a scene.
#[derive(Clone, Copy, Debug)]
pub struct SceneSource<'a> {
    /// The folder that its paths count from.
    pub folder: &'a Path,
    /// Name of the scene in messages.
    pub name: &'a Path,
}

/// The contents that the cache keeps of a scene besides its objects, and those that the caller
/// needs.
#[derive(Clone, Copy)]
pub struct CachePolicy<'a> {
    /// True if the cache keeps the whole file, so that it can be mapped. Else the file is assembled
    /// from its objects when it is needed.
    pub whole: bool,
    /// True if the bytes of a file that the cache has are needed.
    pub needed: &'a dyn Fn(&Record) -> bool,
}

/// Compiles a scene through the cache.
///
/// # Errors
/// The errors of [`compile`]; `BTH-O002` when a source changes meanwhile.
pub fn compile_cached(
    manifest: &Manifest,
    source: SceneSource<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    policy: CachePolicy<'_>,
    monitor: &dyn Monitor,
) -> Result<CachedCompilation<SceneReport>> {
    compile_in(manifest, source, &Context::new(options, cache, monitor)?, policy)
}

pub(super) fn compile_in(
    manifest: &Manifest,
    source: SceneSource<'_>,
    context: &Context<'_>,
    policy: CachePolicy<'_>,
) -> Result<CachedCompilation<SceneReport>> {
    let mut clock = Clock::default();
    let manifest = &*whole_files::expanded(manifest, source.folder, context.monitor)?;
    let plan = ScenePlan::of(manifest, source.folder, context.options, &mut clock)?;
    warn_of_flattened(manifest, context.monitor);
    through_cache(manifest, &plan, source.name, context, clock, policy)
}

/// Takes the file of a plan from the cache, or builds and keeps it.
pub(super) fn through_cache(
    manifest: &Manifest,
    plan: &ScenePlan<'_>,
    name: &Path,
    context: &Context<'_>,
    clock: Clock,
    policy: CachePolicy<'_>,
) -> Result<CachedCompilation<SceneReport>> {
    let Context { cache, monitor, .. } = *context;
    let key = key(manifest, plan, context)?;
    compile_or_fetch(cache, key.as_ref(), policy.needed, monitor, |monitor| {
        let (content, report) = build(manifest, plan, name, &context.with_monitor(monitor), clock)?;
        Ok((content, report, policy.whole))
    })
}

/// Warns of nodes that are hidden because a scale is 0.
fn warn_of_flattened(manifest: &Manifest, monitor: &dyn Monitor) {
    let nodes = visible::flattened(manifest);
    if let Some(first) = nodes.first() {
        let others =
            if nodes.len() > 1 { format!(" and {} other nodes", nodes.len() - 1) } else { String::new() };
        monitor.warn(&format!(
            "node \"{}\"{others}: a scale of 0 along an axis hides what is below; a small one shows it flat",
            first.escape_debug()
        ));
    }
}

/// What a shard has done of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShardReport {
    /// Objects of the shard.
    pub objects: u64,
    /// Parts of objects that are built in parts.
    pub parts: u64,
}

/// Compiles those objects of a scene into the cache that belong to a shard. Where there are fewer
/// objects than shards, the parts of an object that is built in parts are shared, too: part `p` of
/// object `o`, both from 0, belongs to the shard of object `o + p`.
///
/// # Errors
/// The errors of [`compile_cached`].
pub fn compile_objects(
    manifest: &Manifest,
    source: SceneSource<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    shard: Shard,
    monitor: &dyn Monitor,
) -> Result<ShardReport> {
    let context = Context::new(options, cache, monitor)?;
    let mut clock = Clock::default();
    let manifest = &*whole_files::expanded(manifest, source.folder, monitor)?;
    let mut plan = ScenePlan::of(manifest, source.folder, options, &mut clock)?;
    let all: usize = plan.sources.iter().map(|file| file.parts.len()).sum();
    let (mut first, mut parts) = (0, 0);
    for file in &mut plan.sources {
        let share = (all as u64) < u64::from(shard.of);
        let shared =
            if share { object::parts_of(file, (shard, first), &context, &mut clock)? } else { Vec::new() };
        parts += shared.iter().flatten().sum::<u64>();
        let mut rows = (first..).zip(shared.into_iter().chain(std::iter::repeat(None)));
        first += file.parts.len() as u64;
        file.parts.retain(|_| {
            rows.next().is_some_and(|(row, shared)| !file.compiled && shared.is_none() && shard.has(row))
        });
    }
    plan.sources.retain(|file| !file.parts.is_empty());
    let objects = objects::build(manifest, &plan.sources, &context, &mut clock)?.reports.len() as u64;
    Ok(ShardReport { objects, parts })
}

/// What [`compile_cached`] would do. Only reads and hashes the sources.
///
/// # Errors
/// When a source cannot be read.
pub fn dry_run(
    manifest: &Manifest,
    source: SceneSource<'_>,
    options: &CompileOptions,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<DryRun> {
    let context = Context::new(options, cache, monitor)?;
    let manifest = &*whole_files::expanded(manifest, source.folder, monitor)?;
    let plan = ScenePlan::of(manifest, source.folder, options, &mut Clock::default())?;
    let mut found = DryRun::of(key(manifest, &plan, &context)?.as_ref(), cache, monitor);
    if found.record.is_none() {
        for file in plan.sources.iter().filter(|file| !file.compiled) {
            let missing = meshes::missing(file, &context);
            found.reused += (file.parts.len() - missing.len()) as u64;
            found.parts.extend(missing);
        }
    }
    Ok(found)
}

/// The key of a scene, if it may be kept.
fn key(manifest: &Manifest, plan: &ScenePlan<'_>, context: &Context<'_>) -> Result<Option<Key>> {
    let Some(tetgen) = &context.tetgen else { return Ok(None) };
    let as_they_are: Vec<_> = (0..manifest.objects.len() as u32).map(Some).collect();
    let mut nodes = HashedRows::new("nodes");
    let (parts, _) = encode::encode(manifest, &plan.order, &plan.visible, &as_they_are, &mut |rows| {
        nodes.add(rows);
        Ok(())
    })?;
    let mut contents = sources::contents(manifest, &plan.sources);
    if context.options.names {
        contents.extend(manifest.objects.iter().map(|object| object.name.clone()));
    }
    Ok(Some(pipeline::scene(&parts, nodes.finish(), &contents, context.options, tetgen)))
}

/// Compiles the objects and assembles the file.
fn build(
    manifest: &Manifest,
    plan: &ScenePlan<'_>,
    name: &Path,
    context: &Context<'_>,
    mut clock: Clock,
) -> Result<(Content, SceneReport)> {
    let options = context.options;
    if options.costs.rays.is_some() {
        let message = "known rays are rays through one model, and this is a scene".to_owned();
        return Err(Error::Limit { code: "BTH-L033", message });
    }
    let mut objects = objects::build(manifest, &plan.sources, context, &mut clock)?;
    deformers::check(manifest, &objects.number, name, &|object| objects.deformation(object))?;
    let provenance = pipeline::provenance_of_scene(&objects.sources, objects.worker.as_ref(), options)?;
    let (content, mut report) = clock.time("file", || {
        let (rows, mut report) = scene_rows(manifest, plan, &mut objects, context)?;
        let mut builder = rows.clone();
        objects.write(&mut builder)?;
        if options.names {
            let name = |report: &ObjectReport| report.names.first().cloned().unwrap_or_default();
            write::object_names(&mut builder, report.objects.iter().map(name))?;
        }
        super::images::write(&mut builder, &plan.sources, &objects, context)?;
        builder.provenance(provenance)?;
        builder.move_large(&mut |bytes: &[u8]| context.keeper.keep_bytes(bytes))?;
        let Trees { trees, lines, first_only } =
            check(&objects, rows, &builder, (report.deformers > 0, name), context)?;
        if lines.len() >= MIN_TREE_LINES {
            if first_only {
                builder.require(FEATURE_FIRST_TREES);
            }
            builder.section(kind::TREES, NONE, size_of::<Tree>() as u32, trees.as_bytes().to_vec())?;
            let mut section = context.keeper.pieces();
            lines.chunks(CHUNK).try_for_each(|lines| section.add(lines.as_bytes()))?;
            let (bytes, hash) = section.finish()?;
            let stride = size_of::<CacheLine>() as u32;
            let head = SectionHead { kind: kind::TREE_LINES, object: NONE, stride, hash };
            builder.hashed_section(head, None, bytes)?;
        }
        builder.check_limits()?;
        let content = Content::from(builder);
        report.bytes = content.length();
        Ok::<_, Error>((content, report))
    })?;
    report.seconds = clock.into_times();
    Ok((content, report))
}

/// The sections of the scene, and the report on it.
fn scene_rows(
    manifest: &Manifest,
    plan: &ScenePlan<'_>,
    objects: &mut Objects,
    context: &Context<'_>,
) -> Result<(FileBuilder<'static>, SceneReport)> {
    let mut nodes = context.keeper.pieces();
    let mut take = |rows: &[Node]| nodes.add(rows.as_bytes());
    let (parts, groups) = encode::encode(manifest, &plan.order, &plan.visible, &objects.number, &mut take)?;
    let (nodes, hash) = nodes.finish()?;
    let mut builder = FileBuilder::new();
    write::scene(&mut builder, &parts)?;
    if nodes.len() > 0 {
        let head = SectionHead { kind: kind::NODES, object: NONE, stride: size_of::<Node>() as u32, hash };
        builder.hashed_section(head, None, nodes)?;
    }
    builder.move_large(&mut |bytes: &[u8]| context.keeper.keep_bytes(bytes))?;
    Ok((builder.into_static(), report(manifest, plan, objects, &parts, groups.as_ref())))
}

/// The report on a compiled scene.
fn report(
    manifest: &Manifest,
    plan: &ScenePlan<'_>,
    objects: &mut Objects,
    parts: &SceneParts,
    groups: Option<&Groups>,
) -> SceneReport {
    let triangles = |object: u32| objects.reports[object as usize].triangles;
    let world = groups.map_or(0, |groups| groups.world() as usize);
    let group_of = |node: u32| groups.map_or(0, |groups| groups.of_node(node) as usize);
    // For each group and the world its instances and their triangles, once groups are written out.
    let mut written_out = vec![(0u64, 0u64); world + 1];
    for instance in &parts.instances {
        let (count, of) = match instance.group() {
            Some(node) => written_out[group_of(node)],
            None => (1, triangles(instance.object)),
        };
        let sum = &mut written_out[group_of(instance.node)];
        *sum = (sum.0 + count, sum.1 + of);
    }
    let unused = manifest.objects.iter().zip(&plan.used).filter(|(_, used)| !**used);
    SceneReport {
        seconds: Vec::new(),
        unused: unused.map(|(object, _)| object.name.clone()).collect(),
        nodes: plan.order.len() as u64,
        instances: written_out[world].0,
        rows: parts.instances.len() as u64,
        tracks: parts.tracks.len() as u64,
        cameras: parts.cameras.len() as u64,
        lights: parts.lights.len() as u64,
        deformers: parts.deformers.deformers.len() as u64,
        first_frame: manifest.frames.first,
        last_frame: manifest.frames.last,
        rate: manifest.frames.rate,
        triangles: objects.reports.iter().map(|o| o.triangles).sum(),
        instanced_triangles: written_out[world].1,
        bytes: 0,
        resident_bytes: objects.reports.iter().map(|o| o.resident_bytes).sum(),
        worker: objects.worker.clone(),
        objects: std::mem::take(&mut objects.reports),
    }
}

/// Checks the first frame as a reader does. The sections of the objects have been checked one by
/// one before, so the check reads a file with their OBJECT rows and the `rows` of the scene only;
/// the whole file where objects deform. Returns the trees that the file may hold.
fn check(
    objects: &Objects,
    mut rows: FileBuilder<'static>,
    builder: &FileBuilder<'static>,
    (deforms, name): (bool, &Path),
    context: &Context<'_>,
) -> Result<Trees> {
    let whole = || Content::from(builder.clone());
    if deforms {
        let opened = bth::from_bytes(&whole().bytes()?).map(drop);
        return opened.map(|()| Trees::default()).map_err(|e| refused(name, &e));
    }
    objects.write_rows(&mut rows)?;
    // A scene may have millions of rows, so they are not in memory twice.
    let file = context.keeper.assembled(rows)?;
    let error = match bth::check_first_frame(&file) {
        Ok(trees) => return Ok(trees),
        Err(error) => error,
    };
    // Reports the error of the whole file instead, so that offsets in messages are offsets in the
    // whole file.
    let whole = bth_format::File::from_bytes(&whole().bytes()?);
    let whole = whole.and_then(|whole| bth::check_first_frame(&whole));
    Err(refused(name, &whole.err().unwrap_or(error)))
}

/// The error for a file that fails the reader's check: an input error when the first frame cannot
/// be shown, else a defect of the compiler.
fn refused(name: &Path, error: &bth::Error) -> Error {
    match error.code() {
        bth::Code::Singular | bth::Code::NotFinite => Error::Input {
            code: "BTH-I050",
            place: error::Place::File(name.to_owned()),
            message: format!("the first frame cannot be shown: {}", error.without_hint()),
            hint: error.hint().to_owned(),
        },
        _ => Error::Internal { code: "BTH-X030", message: format!("the written file fails: {error}") },
    }
}
