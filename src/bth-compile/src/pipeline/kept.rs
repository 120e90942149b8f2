//! A compilation by way of the cache.

use super::{Clock, Options, Report, Structure, compile_model, over, say};
use crate::cached::{self, Cache, Miss, SourceDigest};
use crate::error::{Error, Result};
use crate::monitor::Monitor;
use crate::write::Content;
use bth_cache::{Key, Record};
use serde::Deserialize;
use serde_json::Value;
use std::borrow::Cow;
use std::path::Path;

/// What came of a compilation.
#[derive(Debug)]
pub struct Outcome<R> {
    /// The compiled file; absent when the cache has it and it was not needed.
    pub content: Option<Content>,
    /// What the stages did, if they did anything.
    pub built: Option<R>,
    /// The record of the compiled file, if it is kept.
    pub record: Option<Record>,
    /// The report as JSON: of the compilation that made the file, whenever that was.
    pub report: Value,
}

/// What a compilation would find.
#[derive(Clone, Debug, Default)]
pub struct Foreseen {
    /// The record of the compiled file, if it is kept.
    pub record: Option<Record>,
    /// Else what differs from the last time.
    pub because: Vec<String>,
    /// Objects of a scene that would be built.
    pub parts: Vec<Miss>,
    /// Objects of a scene that are kept.
    pub kept: u64,
}

impl Foreseen {
    /// What a key would find.
    pub(crate) fn of(key: Option<&Key>, cache: &Cache<'_>, monitor: &dyn Monitor) -> Self {
        let record = key.and_then(|key| cache.find(key, monitor));
        let because = match (&record, key) {
            (Some(_), _) => Vec::new(),
            (None, Some(key)) => cache.reasons(key, ""),
            (None, None) => vec!["no cache".to_owned()],
        };
        Self { record, because, ..Self::default() }
    }
}

/// What [`compile_cached`] would find. Reads and hashes the model, and does nothing else.
///
/// # Errors
/// When the model cannot be read.
pub fn foresee(
    source: &Path,
    options: &Options,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
) -> Result<Foreseen> {
    let (_, key) = identify(source, options, cache, monitor, &mut Clock::default())?;
    Ok(Foreseen::of(key.as_ref(), cache, monitor))
}

/// Compiles a model, or takes what was made of the same content before. `needed` says whether the bytes of a file
/// that is kept are needed.
///
/// # Errors
/// As [`super::compile`]; `BTH-O002` when the model changes meanwhile.
pub fn compile_cached(
    source: &Path,
    options: &Options,
    cache: &Cache<'_>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Result<Outcome<Report>> {
    let mut clock = Clock::default();
    let (digest, key) = identify(source, options, cache, monitor, &mut clock)?;
    let outcome = through(cache, key.as_ref(), needed, monitor, || {
        let (compiled, report) = compile_model(source, &digest, options, cache, monitor, clock)?;
        Ok((compiled.bytes.into(), report, true))
    })?;
    let file = super::FileReport::deserialize(&outcome.report["file"]).ok();
    say(file.and_then(|file| over(&file, options)), monitor);
    Ok(outcome)
}

/// Hashes a model; its key, if it may be kept.
fn identify(
    source: &Path,
    options: &Options,
    cache: &Cache<'_>,
    monitor: &dyn Monitor,
    clock: &mut Clock,
) -> Result<(SourceDigest, Option<Key>)> {
    // Starting the worker takes as long as hashing a small model.
    let (digest, tetgen) = std::thread::scope(|scope| {
        let tetgen = scope.spawn(|| tetgen(options, cache, monitor));
        let digest = clock.time("hash", || SourceDigest::of(source));
        (digest, tetgen.join())
    });
    let digest = digest?;
    let tetgen = tetgen.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    let key = tetgen.map(|tetgen| cached::file(&digest, source, options, &tetgen));
    Ok((digest, key))
}

/// The tetrahedralizer as it stands in keys, if one is needed; `None` when nothing may be kept.
pub(crate) fn tetgen(options: &Options, cache: &Cache<'_>, monitor: &dyn Monitor) -> Result<Option<String>> {
    if cache.store().is_none() || options.tets.planted.is_some() {
        return Ok(None);
    }
    match options.structure {
        Structure::Bvh => Ok(Some(String::new())),
        _ => Ok(cache.tetgen(&options.tets, monitor)?.map(str::to_owned)),
    }
}

/// What a key stands for: from the cache if it is there, else built, by one process if others want the same. `build` also
/// says whether the bytes are to be kept.
pub(crate) fn through<R: serde::Serialize>(
    cache: &Cache<'_>,
    key: Option<&Key>,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
    build: impl FnOnce() -> Result<(Content, R, bool)>,
) -> Result<Outcome<R>> {
    let _working = match key {
        Some(key) => {
            if let Some(found) = kept(cache, key, needed, monitor) {
                return Ok(found);
            }
            let lock = cache.work(key, monitor)?;
            if lock.as_ref().is_some_and(|lock| lock.waited)
                && let Some(found) = kept(cache, key, needed, monitor)
            {
                return Ok(found);
            }
            cache.miss(key, "");
            lock
        }
        None => None,
    };
    let (content, built, keep) = build()?;
    let report = serde_json::to_value(&built).map_err(|e| Error::Internal {
        code: "BTH-X081",
        message: format!("the report cannot be written: {e}"),
    })?;
    let record = match (key, keep) {
        (Some(key), true) => cache.put(key, "", &joined(&content)?, &report, monitor),
        (Some(key), false) => cache.put_name(key, (content.name(), content.length()), &report, monitor),
        (None, _) => None,
    };
    Ok(Outcome { content: Some(content), built: Some(built), record, report })
}

/// All bytes of a file that was put together.
pub(crate) fn joined(content: &Content) -> Result<Cow<'_, [u8]>> {
    content.bytes().map_err(|e| Error::File {
        code: "BTH-O001",
        path: "the file that was there".into(),
        message: format!("cannot read: {e}"),
    })
}

fn kept<R>(
    cache: &Cache<'_>,
    key: &Key,
    needed: &dyn Fn(&Record) -> bool,
    monitor: &dyn Monitor,
) -> Option<Outcome<R>> {
    let mut record = cache.find(key, monitor)?;
    let content = if needed(&record) { Some(cache.read(&record, monitor)?.into()) } else { None };
    cache.hit(key, "");
    cache.store()?.touch(&record);
    let report = std::mem::take(&mut record.report);
    Some(Outcome { content, built: None, report, record: Some(record) })
}
