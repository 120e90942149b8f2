//! Compiles again whenever a file changes.

use super::compile_one::compile_one;
use super::depfile::inputs;
use super::job::{Job, JobContext};
use super::threads::with_threads;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use bth_compile::Monitor;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// Between two looks at the files. Looking works on every file system, network ones included.
const PAUSE: Duration = Duration::from_millis(200);

/// What a file looks like from outside.
type Look = Vec<(PathBuf, Option<(SystemTime, u64)>)>;

/// Compiles the jobs, then again those whose files change, until it is cancelled. Errors are shown and waited out.
///
/// # Errors
/// Cancelled, or standard output closed.
pub(super) fn run(context: &JobContext<'_>, jobs: &[Job], progress: &Progress) -> Result<(), Failure> {
    let mut seen: Vec<Option<Look>> = jobs.iter().map(|_| None).collect();
    loop {
        for (job, seen) in jobs.iter().zip(&mut seen) {
            let files = look(context, job);
            if seen.as_ref() == Some(&files) {
                continue;
            }
            // A program that is still writing is given the time to finish.
            if seen.is_some() {
                std::thread::sleep(PAUSE / 4);
            }
            *seen = Some(look(context, job));
            match with_threads(context.args.threads, || compile_one(context, job, progress))? {
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

fn look(context: &JobContext<'_>, job: &Job) -> Look {
    // A scene that cannot be read is looked at until it can.
    let files = inputs(context, job).unwrap_or_else(|_| vec![job.model.clone()]);
    let state = |path: &PathBuf| {
        let m = std::fs::metadata(path).ok()?;
        Some((m.modified().ok()?, m.len()))
    };
    files.into_iter().map(|path| (path.clone(), state(&path))).collect()
}
