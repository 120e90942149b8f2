//! A compilation job: a model, where its compiled file goes, and what is reported about it.

use crate::args::Compile;
use crate::failure::Failure;
use bth_cache::{Digest, Record, Store};
use bth_compile::Shard;
use bth_compile::cached::Cache;
use bth_compile::pipeline::CompileOptions;
use bth_compile::write;
use serde_json::Value;
use std::borrow::Cow;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A model and where its compiled file goes.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) model: PathBuf,
    /// True if the model came from standard input; then its file is a temporary one.
    pub(super) is_input: bool,
    pub(super) target: Target,
}

/// CompileOptions and cache, which all jobs share.
pub(super) struct JobContext<'a> {
    pub(super) args: &'a Compile,
    pub(super) options: CompileOptions,
    pub(super) store: Option<Store>,
    /// The shard of the only job whose work is compiled into the cache.
    pub(super) shard: Option<Shard>,
}

/// Where a compiled file goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    File(PathBuf),
    Stdout,
    Cache,
}

/// What is reported about a finished job.
pub(super) struct JobReport {
    pub(super) json: Value,
    /// The report of a single job, several lines.
    pub(super) text: String,
    /// The report of one of many jobs, one line.
    pub(super) line: String,
}

/// Name of standard input in the places of errors.
const STANDARD_INPUT: &str = "standard input";

impl Job {
    /// An error of this job. The temporary file of a model from standard input is not a place that
    /// users know.
    pub(super) fn failure(&self, failure: Failure) -> Failure {
        match self.is_input {
            true => failure.with_name(&self.model, Path::new(STANDARD_INPUT)),
            false => failure,
        }
    }

    /// The name of the model in reports: as it was given.
    pub(super) fn name(&self) -> Cow<'_, str> {
        match self.is_input {
            true => "-".into(),
            false => self.model.to_string_lossy(),
        }
    }
}

impl Target {
    /// Returns true if the bytes of a compiled file that the cache holds must be written to the
    /// target.
    pub(super) fn needs(&self, record: &Record, store: Option<&Store>) -> bool {
        match self {
            Self::File(path) => !contains(path, record, store),
            Self::Stdout => true,
            // The record may exist without its content, or with a damaged one, which must then be
            // compiled again.
            Self::Cache => store.and_then(|store| store.pin(record)).is_none(),
        }
    }

    /// The file, if it is one.
    pub(super) fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Stdout | Self::Cache => None,
        }
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Stdout => "standard output".to_owned(),
            Self::Cache => "the cache".to_owned(),
        }
    }
}

/// Returns true if a file has the content of a record, by its fingerprint in the store, or else by
/// reading it.
fn contains(path: &Path, record: &Record, store: Option<&Store>) -> bool {
    if store.and_then(|store| store.content_of(path)) == Some(record.blob) {
        return true;
    }
    let same_size = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() == record.bytes);
    let same = || {
        let found = match record.whole {
            true => File::open(path).and_then(Digest::of_reader).ok().map(|(digest, _)| digest),
            false => write::name_if_whole(path),
        };
        found == Some(record.blob)
    };
    let same = same_size && same();
    if let (true, Some(store)) = (same, store) {
        store.store_fingerprint(path, record.blob);
    }
    same
}

/// The cache of a job; without a store one that keeps nothing.
pub(super) fn cache<'a>(context: &'a JobContext<'_>, job: &Job) -> Cache<'a> {
    // All models from standard input have one name, since the cache keeps something for every name.
    let subject = match job.is_input {
        true => PathBuf::from("-"),
        false => std::path::absolute(&job.model).unwrap_or_else(|_| job.model.clone()),
    };
    match &context.store {
        Some(store) => Cache::new(store, subject.to_string_lossy()),
        None => Cache::none(),
    }
}
