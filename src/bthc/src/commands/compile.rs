//! `bthc compile`: models and scenes into BTH files.

use super::compile_one::compile_one;
use super::job::{Job, JobContext, JobReport, Target};
use super::threads::with_threads;
use super::{deliver, depfile, dry_run, jobs, scene, watch};
use crate::args::Compile;
use crate::failure::Failure;
use crate::output;
use crate::overwrite::{self, Outputs};
use crate::progress::{self, Progress, Quiet};
use bth_compile::Monitor;
use bth_compile::pipeline::CompileOptions;
use serde_json::json;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

pub(crate) fn run(args: &Compile) -> Result<(), Failure> {
    let stdin;
    let mut models = args.models.clone();
    let from_input = models.iter().position(|m| m.as_os_str() == "-");
    if args.jobs.end_with_input {
        if from_input.is_some() {
            let message = "a model from standard input ends with it".to_owned();
            return Err(Failure::Usage { message, hint: "leave --end-with-input out" });
        }
        progress::end_with_input()?;
    }
    if let Some(i) = from_input {
        if args.output.is_none() && !args.keeping.in_cache {
            let message = "a model from standard input has no name that the output could have".to_owned();
            return Err(Failure::Usage { message, hint: "name the output with -o" });
        }
        stdin = deliver::standard_input(args.jobs.format.as_deref())?;
        stdin.path().clone_into(&mut models[i]);
    }
    let mut jobs = plan(args, &models, from_input)?;
    check_rays(args, &jobs)?;
    let progress = Progress::new(args.quiet || args.json);
    warn_of_options(args, &jobs, &progress);
    let store = args.keeping.store(&|text| progress.warn(text))?;
    let options = CompileOptions {
        objects_memory: jobs::memory_of_objects(args, jobs.len()),
        ..args.options(&progress)?
    };
    let is_shared =
        matches!(&jobs[..], [job] if job.target == Target::Cache || scene::is_scene(&job.model, args));
    let shard = args.jobs.shard.filter(|_| is_shared);
    let mut context = JobContext { args, options, store, shard };
    check_outputs(&context, &jobs)?;
    if let Some(shard) = args.jobs.shard.filter(|_| !is_shared) {
        let mut numbers = 0..;
        jobs.retain(|_| numbers.next().is_some_and(|number| shard.has(number)));
    }
    if args.jobs.dry_run {
        return dry_run::show(&context, &jobs, progress);
    }
    if args.jobs.watch {
        return watch::run(&mut context, &jobs, &progress);
    }
    all(&context, &jobs, progress)
}

/// Compiles all jobs, writes the dependency file, and prints the reports.
fn all(context: &JobContext<'_>, jobs: &[Job], progress: Progress) -> Result<(), Failure> {
    let args = context.args;
    let is_told = !args.json && !args.quiet;
    let results = if let [job] = jobs {
        let done = with_threads(args.threads, || compile_one(context, job, &progress)).flatten();
        drop(progress);
        vec![done]
    } else {
        let progress = progress.of_jobs(jobs.len() as u64);
        jobs::run(args, jobs, |job, threads| {
            let name = job.name();
            let monitor = Quiet::new(&progress, Path::new(&*name));
            let done = with_threads(threads, || compile_one(context, job, &monitor)).flatten();
            if let Ok(done) = &done
                && is_told
            {
                progress.print(&done.line);
            }
            progress.done();
            done
        })
    };
    let failed = results.iter().find_map(|result| result.as_ref().err());
    let (code, error) = (failed.map(Failure::exit_code), failed.and_then(Failure::diagnosis));
    match code {
        // Before the reports, since with --json an error takes their place.
        None => write_dependencies(context, jobs)?,
        Some(_) => output::fail(),
    }
    if let [Ok(done)] = results.as_slice()
        && is_told
        && jobs[0].target != Target::Stdout
    {
        output::text(&done.text)?;
    }
    let report = |(job, result): (&Job, Result<JobReport, Failure>)| match result {
        Ok(done) => done.json,
        Err(failure) => {
            failure.print();
            json!({"model": job.name(), "error": failure.diagnosis()})
        }
    };
    let mut all = json!({"jobs": jobs.iter().zip(results).map(report).collect::<Vec<_>>()});
    if args.json {
        if let Some(error) = error {
            all["error"] = json!(error);
        }
        output::json(&all)?;
    }
    code.map_or(Ok(()), |code| Err(Failure::Reported(code)))
}

/// Writes the dependency file, if there is to be one.
fn write_dependencies(context: &JobContext<'_>, jobs: &[Job]) -> Result<(), Failure> {
    match &context.args.jobs.depfile {
        Some(path) => depfile::write(path, context, jobs),
        None => Ok(()),
    }
}

/// Fails if an output would replace a file that is read, or the dependency file an output.
fn check_outputs(context: &JobContext<'_>, jobs: &[Job]) -> Result<(), Failure> {
    let depfile = context.args.jobs.depfile.as_deref();
    let outputs: Vec<&Path> = jobs.iter().filter_map(|job| job.target.path()).collect();
    if let Some(depfile) = depfile {
        let place = overwrite::place(depfile);
        if let Some(output) = outputs.iter().find(|output| overwrite::place(output) == place) {
            let message =
                format!("{} would be both the compiled file and the dependency file", output.display());
            return Err(Failure::Usage { message, hint: "name another file with --depfile" });
        }
        overwrite::check(depfile, &outputs)?;
    }
    // What refers to other files is read only where an output is there already.
    let there = Outputs::new(outputs.iter().copied().chain(depfile));
    if there.is_empty() {
        return Ok(());
    }
    // A manifest alone is compared when it is compiled, so that it is read once.
    let is_compared_later = |job: &Job| jobs.len() == 1 && scene::is_manifest(&job.model);
    for job in jobs.iter().filter(|job| !is_compared_later(job)) {
        // A source that cannot be read is reported when it is compiled.
        let inputs = depfile::inputs(context, job).unwrap_or_else(|_| vec![job.model.clone()]);
        there.check(&inputs)?;
    }
    Ok(())
}

/// Fails if known rays are given for anything but one model.
fn check_rays(args: &Compile, jobs: &[Job]) -> Result<(), Failure> {
    if args.selection.rays.is_none() {
        return Ok(());
    }
    let usage = |message: String, hint| Err(Failure::Usage { message, hint });
    match jobs {
        [job] if scene::is_scene(&job.model, args) => usage(
            format!("--rays are rays through one model, and {} is a scene", job.model.display()),
            "compile its models one by one and refer to the compiled files, or make one model of a glTF file with --flatten",
        ),
        [_] => Ok(()),
        _ => usage(
            format!("--rays are rays through one model, and there are {}", jobs.len()),
            "compile them one by one",
        ),
    }
}

/// Warns of options that have no effect on these models.
fn warn_of_options(args: &Compile, jobs: &[Job], monitor: &dyn Monitor) {
    // Other models than scenes are flat as they are.
    if args.flatten
        && let Some(job) = jobs.iter().find(|job| scene::is_scene(&job.model, args))
    {
        monitor.warn(&format!("--flatten has no effect on {}, which is a manifest", job.model.display()));
    }
    let is_gltf_scene = |job: &Job| bth_import::is_scene(&job.model) && scene::is_scene(&job.model, args);
    if let Some(option) = args.gltf.given()
        && !jobs.iter().any(is_gltf_scene)
    {
        monitor.warn(&format!(
            "{option} has no effect: no model is a glTF, FBX or 3MF file that is compiled as a scene"
        ));
    }
    if !jobs.iter().any(|job| scene::is_scene(&job.model, args)) {
        let poses = args.selection.settings.iter().any(|setting| setting.name() == "poses");
        if poses {
            monitor.warn("--set poses has no effect: no model is a scene");
        }
    }
    if args.jobs.format.is_some() && !jobs.iter().any(|job| job.is_input) {
        monitor.warn("--format has no effect: no model comes from standard input");
    }
    if args.output.is_some()
        && args.jobs.shard.is_some()
        && let [job] = jobs
        && scene::is_scene(&job.model, args)
    {
        monitor.warn("--output has no effect: --shard compiles the objects of a scene into the cache only");
    }
}

/// A job for each model; fails if outputs coincide with each other or with a model.
/// `from_input` is the number of the model that came from standard input.
fn plan(args: &Compile, models: &[PathBuf], from_input: Option<usize>) -> Result<Vec<Job>, Failure> {
    let usage = |message: String, hint| Err(Failure::Usage { message, hint });
    let into_folder = args.output.as_ref().filter(|o| models.len() > 1 || o.is_dir());
    let target = |model: &PathBuf| match (&args.output, into_folder) {
        _ if args.keeping.in_cache => Target::Cache,
        (Some(output), _) if output.as_os_str() == "-" => Target::Stdout,
        (_, Some(folder)) => {
            Target::File(folder.join(model.with_extension("bth").file_name().unwrap_or_default()))
        }
        (Some(output), None) => Target::File(output.clone()),
        (None, None) => Target::File(model.with_extension("bth")),
    };
    let job = |(i, model): (usize, &PathBuf)| Job {
        model: model.clone(),
        is_input: from_input == Some(i),
        target: target(model),
    };
    let jobs: Vec<Job> = models.iter().enumerate().map(job).collect();
    if jobs.iter().any(|job| job.target == Target::Stdout) && (jobs.len() > 1 || args.json) {
        return usage(
            "standard output takes one compiled file and nothing else".to_owned(),
            "name a file with -o",
        );
    }
    if args.jobs.depfile.is_some() && jobs.iter().any(|job| job.target == Target::Stdout) {
        let message = "a dependency file names the output, and standard output has no name".to_owned();
        return usage(message, "name a file with -o");
    }
    if args.jobs.watch && (from_input.is_some() || jobs.iter().any(|job| job.target == Target::Stdout)) {
        let message =
            "--watch reads and writes files again and again, and standard input and output pass once";
        return usage(message.to_owned(), "name a model and with -o an output");
    }
    if let Some(folder) = into_folder
        && !folder.is_dir()
    {
        let message = format!("{} is no folder, and there are {} models", folder.display(), models.len());
        return usage(message, "name a folder that is there with -o");
    }
    let mut of_output = HashMap::new();
    for job in &jobs {
        let Target::File(path) = &job.target else { continue };
        if let Some(other) = of_output.insert(overwrite::place(path), &job.model) {
            let (one, two) = (other.display(), job.model.display());
            let message = format!("{one} and {two} would both be written to {}", path.display());
            return usage(message, "compile them one by one, or rename one");
        }
    }
    Ok(jobs)
}
