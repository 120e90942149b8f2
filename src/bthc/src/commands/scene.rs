//! `bthc compile` of scenes: glTF, FBX and 3MF files and manifests.

use super::deliver::deliver;
use super::job::{self, Job, JobContext, JobReport, Target};
use super::summary::{stages, worker_note};
use crate::args::Compile;
use crate::failure::Failure;
use crate::overwrite::Outputs;
use crate::table::{Table, bytes, count};
use bth_compile::Monitor;
use bth_compile::cached::Cache;
use bth_compile::pipeline::DryRun;
use bth_compile::scene::{self, CachePolicy, SceneReport, SceneSource, ShardReport};
use bth_compile::source;
use bth_import::Looks;
use bth_import::gltf::scene::{ImportReport, file_name, import};
use bth_scene::Manifest;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Returns true if a model is compiled as a scene.
pub(super) fn is_scene(model: &Path, args: &Compile) -> bool {
    is_manifest(model) || bth_import::is_scene(model) && !args.flatten
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    path.extension().is_some_and(|e| extensions.iter().any(|wanted| e.eq_ignore_ascii_case(wanted)))
}

/// Returns true if a path has the extension of manifests.
pub(super) fn is_manifest(path: &Path) -> bool {
    has_extension(path, &["manifest", "toml"])
}

/// The folder to which paths in a scene are relative.
pub(super) fn folder(scene: &Path) -> &Path {
    scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Reads the manifest of a job, or makes one from another file.
///
/// # Errors
/// When it cannot be read, or names a file that an output would replace.
fn read(
    context: &JobContext<'_>,
    job: &Job,
    monitor: &dyn Monitor,
) -> Result<(Manifest, Option<ImportReport>), Failure> {
    let (model, Compile { gltf, jobs, .. }) = (&job.model, context.args);
    if !is_manifest(model) {
        let (manifest, report) = import(model, file_name(model)?, &gltf.options(), monitor)?;
        return Ok((manifest, Some(report)));
    }
    let manifest = bth_scene::read(model)?;
    let there = Outputs::new(job.target.path().into_iter().chain(jobs.depfile.as_deref()));
    if !there.is_empty() {
        // A model that cannot be read is reported when it is compiled.
        let inputs = files(&manifest, model, context.options.looks());
        there.check(inputs.unwrap_or_else(|_| vec![model.clone()]))?;
    }
    Ok((manifest, None))
}

/// Compiles a scene.
pub(super) fn compile(
    context: &JobContext<'_>,
    job: &Job,
    monitor: &dyn Monitor,
) -> Result<JobReport, Failure> {
    let (manifest, import) = read(context, job, monitor)?;
    let cache = job::cache(context, job);
    let source = SceneSource { folder: folder(&job.model), name: &job.model };
    if let Some(shard) = context.shard {
        check_store(context)?;
        let done = scene::compile_objects(&manifest, source, &context.options, &cache, shard, monitor)?;
        return shard_report(job, &cache, done);
    }
    let policy = CachePolicy {
        whole: job.target == Target::Cache,
        needed: &|record| job.target.needs(record, context.store.as_ref()),
    };
    let mut outcome = scene::compile_cached(&manifest, source, &context.options, &cache, policy, monitor)?;
    let mut report = deliver(context, job, &mut outcome, &cache, &|| {
        let mut files = files(&manifest, &job.model, context.options.looks())?;
        files.extend(context.args.selection.rays.clone());
        Ok(files)
    })?;
    report.json["scene"] = outcome.report;
    report.json["import"] = json!(import);
    if let Some(built) = &outcome.built {
        report.text = format!("{}{}", summary(built), report.text);
    }
    Ok(report)
}

/// Fails without a cache, where the work of a shard would be lost.
pub(super) fn check_store(context: &JobContext<'_>) -> Result<(), Failure> {
    let usage = Failure::Usage {
        message: "--shard keeps objects and their parts in the cache, and no cache is in use".to_owned(),
        hint: "leave --no-cache and BTH_NO_CACHE out, and name a folder with --cache-dir or BTH_CACHE_DIR",
    };
    if context.store.is_some() { Ok(()) } else { Err(usage) }
}

/// The report of a shard of objects and their parts.
pub(super) fn shard_report(job: &Job, cache: &Cache<'_>, done: ShardReport) -> Result<JobReport, Failure> {
    let (log, ShardReport { objects, parts }) = (cache.log(), done);
    if log.failed {
        let message = "what was compiled could not be kept";
        return Err(Failure::file("BTH-O061", Path::new("the cache"), &message));
    }
    let of_parts = if parts > 0 { format!(", {} parts", count(parts)) } else { String::new() };
    let line =
        format!("{}  {} objects{of_parts}  compiled into the cache", job.model.display(), count(objects));
    let json = json!({
        "model": job.name(),
        "objects": objects,
        "parts": parts,
        "cache": {"hits": log.hits, "misses": log.misses},
    });
    Ok(JobReport { json, text: format!("{line}\n"), line })
}

/// What a compilation of a scene would do.
pub(super) fn dry_run(
    context: &JobContext<'_>,
    job: &Job,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<DryRun, Failure> {
    let (manifest, _) = read(context, job, monitor)?;
    let source = SceneSource { folder: folder(&job.model), name: &job.model };
    Ok(scene::dry_run(&manifest, source, &context.options, cache, monitor)?)
}

/// All files that a scene is made from.
pub(super) fn inputs(model: &Path, looks: Looks) -> Result<Vec<PathBuf>, Failure> {
    if bth_import::is_scene(model) {
        return Ok(source::files(model, looks)?);
    }
    Ok(files(&bth_scene::read(model)?, model, looks)?)
}

/// All files that a scene with this manifest, or the file that it was read from, is made from.
fn files(manifest: &Manifest, model: &Path, looks: Looks) -> bth_compile::Result<Vec<PathBuf>> {
    if bth_import::is_scene(model) {
        return source::files(model, looks);
    }
    scene::files(manifest, model, looks)
}

/// What is known about the trees of objects whose vertices move.
fn motion(facts: &mut Table, report: &SceneReport) {
    let moving = report.objects.iter().filter_map(|object| Some((object, object.motion.as_ref()?)));
    for (object, motion) in moving {
        let name = object.names.first().map_or("an object", String::as_str).escape_debug().to_string();
        if motion.frames > 0 {
            let frames = format!("{}, {}", motion.frames, bytes(motion.position_bytes));
            facts.row([format!("frames of {name}, positions"), frames].each_ref().map(String::as_str));
        }
        if motion.poses > 1 {
            facts.row([format!("poses for the tree of {name}").as_str(), &motion.poses.to_string()]);
        }
    }
}

/// The report of a compiled scene for people.
fn summary(report: &SceneReport) -> String {
    let mut facts = Table::default();
    facts.row(["nodes", &count(report.nodes)]);
    facts.row(["instances", &count(report.instances)]);
    if report.rows != report.instances {
        facts.row(["instances with each group once", &count(report.rows)]);
    }
    facts.row(["objects", &count(report.objects.len() as u64)]);
    let stored_once = report.objects.iter().map(|object| object.names.len().saturating_sub(1) as u64).sum();
    facts.count("objects of equal geometry, stored once", stored_once);
    facts.count("objects that nobody sees, left out", report.unused.len() as u64);
    facts.count("objects that deform", report.deformers);
    facts.count("tracks", report.tracks);
    facts.count("cameras", report.cameras);
    facts.count("lights", report.lights);
    facts.row(["frames", &format!("{} to {} at {}/s", report.first_frame, report.last_frame, report.rate)]);
    facts.row(["triangles", &count(report.triangles)]);
    facts.row(["triangles of all instances", &count(report.instanced_triangles)]);
    facts.count("degenerate (never hit)", report.objects.iter().map(|o| o.degenerate).sum());
    let rounded = report.objects.iter().filter_map(|o| o.rounding.as_ref());
    facts.count("positions moved by rounding", rounded.clone().map(|r| r.positions).sum());
    facts.count("triangles without area by rounding", rounded.map(|r| r.triangles).sum());
    let in_f64 = report.objects.iter().filter(|o| o.avoided_rounding.is_some()).count();
    facts.count("objects with positions in f64", in_f64 as u64);
    facts.count("tet leaves", report.objects.iter().map(|o| o.tet_leaves).sum());
    facts.count("triangles in tet leaves", report.objects.iter().map(|o| o.tet_triangles).sum());
    motion(&mut facts, report);
    facts.row(["file", &bytes(report.bytes)]);
    facts.row(["traversal reads", &bytes(report.resident_bytes)]);
    let note = worker_note(report.worker.as_ref());
    format!("{}\n{}{note}\n", stages(&report.seconds), facts.render())
}
