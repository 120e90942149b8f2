//! The compilation of one job.

use super::job::{Job, JobContext, JobReport, cache};
use super::summary::summary;
use super::{deliver, scene};
use crate::failure::Failure;
use bth_compile::Monitor;
use bth_compile::monitor::Recording;
use bth_compile::pipeline;
use bth_compile::scene::ShardReport;
use serde_json::Value;

/// Compiles a model or scene, or takes it from the cache, and brings it to its target. The report
/// has the warnings, also from earlier compilations whose results are taken.
///
/// # Errors
/// If it cannot be compiled or written.
pub(super) fn compile_one(
    context: &JobContext<'_>,
    job: &Job,
    monitor: &dyn Monitor,
) -> Result<JobReport, Failure> {
    let recording = Recording::with_notices(monitor);
    let mut report = compile_job(context, job, &recording).map_err(|failure| job.failure(failure))?;
    if ["/report/mesh/triangles", "/scene/triangles"]
        .iter()
        .any(|at| report.json.pointer(at) == Some(&0.into()))
    {
        recording.warn(&format!("{} has no triangles, so no ray hits it", job.name()));
    }
    // Those that are kept with the result are among them.
    for part in ["report", "scene"] {
        report.json.get_mut(part).and_then(Value::as_object_mut).map(|kept| kept.remove("warnings"));
    }
    report.json["warnings"] = recording.warnings().into();
    Ok(report)
}

fn compile_job(context: &JobContext<'_>, job: &Job, monitor: &dyn Monitor) -> Result<JobReport, Failure> {
    if scene::is_scene(&job.model, context.args) {
        return scene::compile(context, job, monitor);
    }
    let cache = cache(context, job);
    if let Some(shard) = context.shard {
        scene::check_store(context)?;
        let parts = pipeline::compile_parts(&job.model, &context.options, &cache, shard, monitor)?;
        if parts.is_some() || !shard.has(0) {
            let parts = parts.unwrap_or_default();
            return scene::shard_report(job, &cache, ShardReport { objects: 0, parts });
        }
    }
    let needed = |record: &_| job.target.needs(record, context.store.as_ref());
    let mut outcome = pipeline::compile_cached(&job.model, &context.options, &cache, &needed, monitor)?;
    let files = || {
        let mut files = bth_compile::source::files(&job.model, context.options.looks())?;
        files.extend(context.args.selection.rays.clone());
        Ok(files)
    };
    let mut report = deliver::deliver(context, job, &mut outcome, &cache, &files)?;
    report.json["report"] = outcome.report;
    if let Some(built) = &outcome.built {
        let known_rays = context.options.costs.rays.as_ref().map_or(0, |rays| rays.count() as u64);
        report.text = format!("{}{}", summary(built, known_rays), report.text);
    }
    Ok(report)
}
