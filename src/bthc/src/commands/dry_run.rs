//! Dry run: shows what a compilation would do, and why.

use super::job::{Job, JobContext, Target, cache};
use super::scene;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use bth_compile::pipeline::{self, DryRun};
use serde_json::json;

/// Prints for each job what would be done.
///
/// # Errors
/// When a source cannot be read.
pub(super) fn show(context: &JobContext<'_>, jobs: &[Job], progress: Progress) -> Result<(), Failure> {
    let mut reports = Vec::new();
    let mut text = String::new();
    for job in jobs {
        let cache = cache(context, job);
        let found = match scene::is_scene(&job.model, context.args) {
            true => scene::dry_run(context, job, &cache, &progress),
            false => {
                pipeline::dry_run(&job.model, &context.options, &cache, &progress).map_err(Failure::from)
            }
        };
        let found = found.map_err(|failure| job.failure(failure))?;
        let (what, why) = action(context, job, &found);
        text.push_str(&format!("{}: {what}{}\n", job.target.name(), in_parentheses(why)));
        for part in &found.parts {
            text.push_str(&format!("  {}: compile{}\n", part.part, in_parentheses(&part.because)));
        }
        reports.push(json!({
            "model": job.name(),
            "output": job.target.name(),
            "action": what,
            "because": found.because,
            "objects": found.parts,
            "objects_kept": found.reused,
        }));
    }
    drop(progress);
    if context.args.json {
        return Ok(output::json(&json!({ "jobs": reports }))?);
    }
    Ok(output::text(&text)?)
}

/// Shows the reasons for what is done. Empty without reasons, as for parts of a scene without a
/// cache.
fn in_parentheses(reasons: &[String]) -> String {
    if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) }
}

fn action<'a>(context: &JobContext<'_>, job: &Job, found: &'a DryRun) -> (&'static str, &'a [String]) {
    match &found.record {
        Some(record) if !job.target.needs(record, context.store.as_ref()) => ("nothing to do", &[]),
        Some(_) if job.target == Target::Cache => ("make again", &found.because),
        Some(_) => ("take from the cache", &[]),
        None => ("compile", &found.because),
    }
}
