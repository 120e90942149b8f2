//! `bthc compile`: models and scenes into BTH files.

use super::deliver::{self, Done, Target};
use super::{depfile, dry_run, jobs, scene, watch, with_threads};
use crate::args::Compile;
use crate::failure::Failure;
use crate::output;
use crate::progress::{Progress, Quiet};
use crate::table::{Table, bytes, count, seconds};
use bth_cache::Store;
use bth_compile::Monitor;
use bth_compile::cached::{self, Cache};
use bth_compile::pipeline::{Options, Report};
use bth_compile::tets::WorkerStatus;
use serde_json::json;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What is compiled, and where to.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) model: PathBuf,
    pub(super) target: Target,
}

/// What all jobs have in common.
pub(super) struct Setting<'a> {
    pub(super) args: &'a Compile,
    pub(super) options: Options,
    pub(super) store: Option<Store>,
}

pub(crate) fn run(args: &Compile) -> Result<(), Failure> {
    let _stdin;
    let mut models = args.models.clone();
    if let Some(place) = models.iter().position(|m| m.as_os_str() == "-") {
        let (folder, path) = deliver::standard_input(args.jobs.format.as_deref())?;
        (_stdin, models[place]) = (folder, path);
        if args.output.is_none() && !args.keeping.in_cache {
            let message = "a model from standard input has no name that the output could have".to_owned();
            return Err(Failure::Usage { message, hint: "name the output with -o" });
        }
    }
    let mut jobs = plan(args, &models)?;
    let progress = Progress::new(args.quiet || args.json);
    let store = args.keeping.store(&|text| progress.warn(text))?;
    let options = Options { objects_memory: jobs::memory_of_objects(args, jobs.len()), ..args.options()? };
    let setting = Setting { args, options, store };
    if let Some((part, parts)) = args.jobs.shard
        && !(jobs.len() == 1 && scene::is_scene(&jobs[0].model, args))
    {
        let mine = |place: usize| place % parts as usize == part as usize - 1;
        jobs = jobs.into_iter().enumerate().filter(|(place, _)| mine(*place)).map(|(_, job)| job).collect();
    }
    if args.jobs.dry_run {
        return dry_run::show(&setting, &jobs, progress);
    }
    if args.jobs.watch {
        return watch::run(&setting, &jobs, &progress);
    }
    all(&setting, &jobs, progress)?;
    match &args.jobs.depfile {
        Some(path) => depfile::write(path, &setting, &jobs),
        None => Ok(()),
    }
}

/// Compiles all jobs and says what came of it.
fn all(setting: &Setting<'_>, jobs: &[Job], progress: Progress) -> Result<(), Failure> {
    let args = setting.args;
    if let [job] = jobs {
        let done = with_threads(args.threads, || one(setting, job, &progress))??;
        drop(progress);
        return match (args.json, args.quiet || job.target == Target::Stdout) {
            (true, _) => Ok(output::json(&done.json)?),
            (false, true) => Ok(()),
            (false, false) => Ok(output::text(&done.text)?),
        };
    }
    let watched = progress.of_jobs(jobs.len() as u64);
    let results = jobs::run(args, jobs, |job, threads| {
        let done = with_threads(threads, || one(setting, job, &Quiet::new(&watched, &job.model)))?;
        if let Ok(done) = &done
            && !args.json
            && !args.quiet
        {
            watched.print(&done.line);
        }
        watched.done();
        done
    });
    drop(watched);
    let failed = results.iter().filter_map(|r| r.as_ref().err()).map(Failure::exit_code).next();
    let report = |(job, result): (&Job, Result<Done, Failure>)| match result {
        Ok(done) => done.json,
        Err(failure) => {
            failure.say();
            json!({"model": job.model.to_string_lossy(), "error": failure.json()})
        }
    };
    let reports: Vec<_> = jobs.iter().zip(results).map(report).collect();
    if args.json {
        output::json(&json!({ "jobs": reports }))?;
    }
    failed.map_or(Ok(()), |code| Err(Failure::Reported(code)))
}

/// Compiles one job.
pub(super) fn one(setting: &Setting<'_>, job: &Job, monitor: &dyn Monitor) -> Result<Done, Failure> {
    if scene::is_scene(&job.model, setting.args) {
        return scene::compile(setting, job, monitor);
    }
    let cache = cache(setting, &job.model);
    let needed = |record: &_| job.target.needs(record, setting.store.as_ref());
    let outcome = cached::compile(&job.model, &setting.options, &cache, &needed, monitor)?;
    let mut done =
        deliver::deliver(setting, job, &outcome, &cache, &|| bth_compile::source::files(&job.model))?;
    done.json["report"] = outcome.report;
    if let Some(report) = &outcome.built {
        done.text = format!("{}{}", summary(report), done.text);
    }
    Ok(done)
}

/// The cache of a job.
pub(super) fn cache<'a>(setting: &'a Setting<'_>, model: &Path) -> Cache<'a> {
    let subject = std::path::absolute(model).unwrap_or_else(|_| model.to_owned());
    match &setting.store {
        Some(store) => Cache::new(store, subject.to_string_lossy()),
        None => Cache::none(),
    }
}

/// Each model with its output.
fn plan(args: &Compile, models: &[PathBuf]) -> Result<Vec<Job>, Failure> {
    let usage = |message: String, hint| Err(Failure::Usage { message, hint });
    let into_folder = args.output.as_ref().filter(|o| models.len() > 1 || is_folder(o));
    let target = |model: &PathBuf| match (&args.output, into_folder) {
        _ if args.keeping.in_cache => Target::Cache,
        (Some(output), _) if output.as_os_str() == "-" => Target::Stdout,
        (_, Some(folder)) => {
            Target::File(folder.join(model.with_extension("bth").file_name().unwrap_or_default()))
        }
        (Some(output), None) => Target::File(output.clone()),
        (None, None) => Target::File(model.with_extension("bth")),
    };
    let jobs: Vec<Job> = models.iter().map(|m| Job { model: m.clone(), target: target(m) }).collect();
    if jobs.iter().any(|job| job.target == Target::Stdout) && (jobs.len() > 1 || args.json) {
        return usage(
            "standard output takes one compiled file and nothing else".to_owned(),
            "name a file with -o",
        );
    }
    if let Some(folder) = into_folder
        && !is_folder(folder)
    {
        let message = format!("{} is no folder, and there are {} models", folder.display(), models.len());
        return usage(message, "name a folder that is there with -o");
    }
    let mut of_output = HashMap::new();
    for job in &jobs {
        let Target::File(path) = &job.target else { continue };
        if *path == job.model {
            let message = "the output would replace the model".to_owned();
            return usage(message, "name another output with -o");
        }
        if let Some(other) = of_output.insert(path, &job.model) {
            let (one, two) = (other.display(), job.model.display());
            let message = format!("{one} and {two} would both be written to {}", path.display());
            return usage(message, "compile them one by one, or rename one");
        }
    }
    Ok(jobs)
}

fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// The report for people: stages with their seconds, then counts.
fn summary(report: &Report) -> String {
    let mut stages = Table::default();
    for stage in &report.seconds {
        stages.row([stage.name, &seconds(stage.seconds)]);
    }
    stages.row(["total", &seconds(report.seconds.iter().map(|s| s.seconds).sum())]);

    let mut facts = Table::default();
    let (mesh, file) = (&report.mesh, &report.file);
    facts.row(["triangles", &count(mesh.triangles)]);
    nonzero(&mut facts, "degenerate (never hit)", mesh.degenerate);
    nonzero(&mut facts, "duplicate", mesh.duplicate);
    nonzero(&mut facts, "elements skipped", mesh.skipped);
    nonzero(&mut facts, "boundary edges", mesh.boundary_edges);
    nonzero(&mut facts, "non-manifold edges", mesh.non_manifold_edges);
    if let Some(found) = &report.coordinates {
        facts.row(["coordinates", &format!("{} bits", found.bits)]);
        facts.row(["vertices moved by at most", &found.displacement.to_string()]);
    }
    if let Some(marks) = &report.marks {
        facts.row(["suitable nodes", &format!("{} of {}", count(marks.suitable), count(marks.nodes))]);
    }
    if let Some(tets) = &report.tets {
        facts.row(["nodes chosen", &count(tets.chosen)]);
        facts.row(["tet leaves", &count(file.tet_leaves)]);
        facts.row(["triangles in tet leaves", &count(file.tet_triangles)]);
        facts.row(["tetrahedra", &count(tets.tets)]);
        facts.row(["Steiner points", &count(tets.steiner_points)]);
        nonzero(&mut facts, "nodes split after failure", tets.split);
        nonzero(&mut facts, "nodes left to the BVH", tets.given_up);
    }
    facts.row(["file", &bytes(file.bytes)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes)]);
    facts.row(["bytes a triangle", &format!("{:.1}", file.resident_bytes_per_triangle)]);
    format!("{}\n{}{}\n", stages.render(), facts.render(), worker_note(report))
}

pub(super) fn nonzero(table: &mut Table, name: &str, n: u64) {
    if n > 0 {
        table.row([name, &count(n)]);
    }
}

/// Why chosen nodes were not tetrahedralized, if no worker did it.
fn worker_note(report: &Report) -> String {
    note(report.tets.as_ref().map(|t| &t.worker))
}

/// Why there are no tetrahedra, if the worker is the reason.
pub(super) fn note(worker: Option<&WorkerStatus>) -> String {
    match worker {
        Some(WorkerStatus::Missing { hint }) => format!("note: no tetrahedralization worker: {hint}\n"),
        Some(WorkerStatus::Unusable { reason }) => {
            format!("note: tetrahedralization worker unusable: {reason}\n")
        }
        _ => String::new(),
    }
}
