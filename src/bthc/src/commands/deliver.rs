//! Brings a compiled file to its target: to its path unless that is up to date, to standard output,
//! or only into the cache.

use super::job::{Job, JobContext, JobReport, Target};
use crate::failure::Failure;
use crate::output;
use crate::table::{bytes, seconds};
use crate::temporary::TemporaryFile;
use bth_cache::{Record, Store};
use bth_compile::cached::Cache;
use bth_compile::pipeline::CachedCompilation;
use bth_compile::write::{self, Content};
use serde_json::json;
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

/// Brings the outcome of a job to its target. `inputs` are the files that it was made from.
///
/// # Errors
/// When it cannot be written.
pub(super) fn deliver<R>(
    context: &JobContext<'_>,
    job: &Job,
    outcome: &mut CachedCompilation<R>,
    cache: &Cache<'_>,
    inputs: &dyn Fn() -> bth_compile::Result<Vec<PathBuf>>,
) -> Result<JobReport, Failure> {
    let start = Instant::now();
    let content = outcome.content.take();
    let (written, length) = (content.is_some(), content.as_ref().map(Content::length));
    match (&job.target, content) {
        (Target::File(path), Some(content)) => {
            write::write_content(path, content)?;
            if let (Some(store), Some(record)) = (&context.store, &outcome.record) {
                store.store_fingerprint(path, record.blob);
            }
        }
        (Target::File(path), None) => {
            if job.is_input || inputs()?.iter().any(|input| modified(input) > modified(path)) {
                // Build systems compare modification times, so an output that is up to date must be
                // newer than its inputs.
                touch(path, outcome.record.as_ref(), context.store.as_ref())?;
            }
        }
        (Target::Stdout, Some(content)) => {
            let mut out = output::stdout();
            content.write_to(&mut out)?;
            out.flush()?;
        }
        (Target::Stdout | Target::Cache, _) => {}
    }
    let holds = |record: &Record| context.store.as_ref().is_some_and(|store| store.holds(record));
    // A small cache may have dropped it again.
    if job.target == Target::Cache && !outcome.record.as_ref().is_some_and(holds) {
        return Err(Failure::file(
            "BTH-O061",
            Path::new("the cache"),
            &"the compiled file could not be kept",
        ));
    }
    let (from, wrote) = match (&outcome.built, written) {
        (Some(_), _) => ("compiled", "wrote"),
        (None, true) => ("from the cache", "wrote"),
        (None, false) => ("unchanged", "up to date:"),
    };
    let size = outcome.record.as_ref().map(|r| r.bytes).or(length);
    let name = job.target.name();
    let key = outcome.record.as_ref().map(|r| r.key.id());
    let log = cache.log();
    // Scenes assembled from cached objects have no separate entry.
    let kept = outcome.record.as_ref().filter(|record| record.whole).zip(context.store.as_ref());
    let state = json!({
        "key": key,
        "hit": outcome.built.is_none(),
        "hits": log.hits,
        "misses": log.misses,
        "entry": kept.map(|(record, store)| store.path(record).to_string_lossy().into_owned()),
    });
    let took = if written { seconds(start.elapsed().as_secs_f64()) } else { String::new() };
    let mut text = if outcome.built.is_none() { format!("{from}\n") } else { String::new() };
    text.push_str(&format!("{wrote} {name}\n"));
    let mut json = json!({
        "model": job.name(),
        "output": name,
        "written": written,
        "cache": state,
    });
    if job.target == Target::Cache {
        // For programs that must not replace them.
        let is_named = |input: &&PathBuf| !job.is_input || **input != job.model;
        json["inputs"] = inputs()?.iter().filter(is_named).map(|input| input.to_string_lossy()).collect();
    }
    Ok(JobReport {
        json,
        text,
        line: format!("{name}  {from}  {}  {took}", bytes(size.unwrap_or(0))).trim_end().to_owned(),
    })
}

fn modified(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

fn touch(path: &Path, record: Option<&Record>, store: Option<&Store>) -> Result<(), Failure> {
    let failed =
        |e: std::io::Error| Failure::file("BTH-O020", path, &format!("cannot be marked as new: {e}"));
    // The owner of a read-only file may set its time, too.
    let file = File::options().append(true).open(path).or_else(|_| File::open(path)).map_err(failed)?;
    file.set_modified(SystemTime::now()).map_err(failed)?;
    if let (Some(record), Some(store)) = (record, store) {
        store.store_fingerprint(path, record.blob);
    }
    Ok(())
}

/// The model on standard input, as a file that lives as long as the value.
pub(super) fn standard_input(format: Option<&str>) -> Result<TemporaryFile, Failure> {
    let failed = |e: std::io::Error| Failure::file("BTH-O062", Path::new("standard input"), &e);
    let mut bytes = Vec::new();
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(failed)?;
    let mut name = PathBuf::from("stdin");
    if let Some(format) = format {
        name.set_extension(format);
    }
    let (temporary, mut file) = TemporaryFile::new(&name).map_err(failed)?;
    file.write_all(&bytes).map_err(failed)?;
    Ok(temporary)
}
