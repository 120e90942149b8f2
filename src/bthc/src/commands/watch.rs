//! Watching: compiles again whenever a file changes.

use super::compile_one::compile_one;
use super::depfile::inputs;
use super::job::{Job, JobContext};
use super::threads::with_threads;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use bth_compile::Monitor;
use bth_compile::pipeline::CompileOptions;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// Time between two polls of the files. Polling works on every file system, including network ones.
const PAUSE: Duration = Duration::from_millis(200);

/// Modification time and size of each file of a job; `None` for a missing file.
type Fingerprint = Vec<(PathBuf, Option<(SystemTime, u64)>)>;

/// Compiles the jobs, then again those whose files change, until it is cancelled. Errors are
/// printed, and the job is compiled again when its files change.
///
/// # Errors
/// Cancelled, or standard output closed.
pub(super) fn run(context: &mut JobContext<'_>, jobs: &[Job], progress: &Progress) -> Result<(), Failure> {
    let mut seen: Vec<Option<Fingerprint>> = jobs.iter().map(|_| None).collect();
    loop {
        for (job, seen) in jobs.iter().zip(&mut seen) {
            let files = fingerprint(context, job);
            if seen.as_ref() == Some(&files) {
                continue;
            }
            // A program that is still writing the file gets time to finish.
            if seen.is_some() {
                std::thread::sleep(PAUSE / 4);
            }
            *seen = Some(fingerprint(context, job));
            // Known rays are a file, too.
            match context.args.options(progress) {
                Ok(options) => {
                    let objects_memory = context.options.objects_memory;
                    context.options = CompileOptions { objects_memory, ..options };
                }
                Err(failure) => {
                    failure.print();
                    continue;
                }
            }
            match with_threads(context.args.threads, || compile_one(context, job, progress))? {
                Ok(_) if context.args.quiet => {}
                Ok(done) => output::text(&format!("{}\n", done.line))?,
                Err(Failure::Compile(bth_compile::Error::Cancelled)) => break,
                Err(failure) => failure.print(),
            }
        }
        if progress.cancelled() {
            return Err(bth_compile::Error::Cancelled.into());
        }
        std::thread::sleep(PAUSE);
    }
}

fn fingerprint(context: &JobContext<'_>, job: &Job) -> Fingerprint {
    // Of a scene that cannot be read only the file itself is watched, until it can be read.
    let files = inputs(context, job).unwrap_or_else(|_| vec![job.model.clone()]);
    let state = |path: &PathBuf| {
        let m = std::fs::metadata(path).ok()?;
        Some((m.modified().ok()?, m.len()))
    };
    files.into_iter().map(|path| (path.clone(), state(&path))).collect()
}
