//! Stages by way of the cache: what they made before is taken from there.
//!
//! `keys` says what each stage depends on, `sources` what a model's files are, `rows` how results become
//! bytes and `results` which. A result that is damaged or does not decode is made again; a cache that
//! cannot be written costs time and nothing else.

mod keys;
mod log;
mod results;
mod rows;
mod sources;
mod tree;

pub(crate) use keys::{
    ObjectKeys, bvh, extension, file, geometry, marks, mesh, outline, scene, tets_of_node,
};
pub use log::{Log, Miss};
pub(crate) use results::MeshFacts;
pub(crate) use rows::{Parts, Rows};
pub use sources::{SourceDigest, files};
pub(crate) use tree::Topology;

use crate::error::Result;
use crate::monitor::Monitor;
use crate::tets;
use bth_cache::{Digest, Key, Record, Store, WorkLock};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::{Mutex, OnceLock, PoisonError};

/// A result that can be kept.
pub(crate) trait Stored: Sized {
    /// Its rows.
    fn rows(&self, to: &mut Rows);
    /// From its rows; `None` when they are not what they should be.
    fn from_rows(from: &mut Parts<'_>) -> Option<Self>;
}

/// The cache of a compilation, or none.
pub struct Cache<'a> {
    store: Option<&'a Store>,
    /// What stands for the source when misses are explained.
    subject: String,
    log: Mutex<Log>,
    tetgen: OnceLock<Option<String>>,
}

impl<'a> Cache<'a> {
    /// Nothing is kept.
    pub fn none() -> Self {
        Self { store: None, subject: String::new(), log: Mutex::default(), tetgen: OnceLock::new() }
    }

    /// Results go to a store. `subject` stands for what is compiled, such as its absolute path: by it a miss is
    /// explained; no result depends on it.
    pub fn new(store: &'a Store, subject: impl Into<String>) -> Self {
        Self { store: Some(store), subject: subject.into(), ..Self::none() }
    }

    /// What was found and what was not.
    pub fn log(&self) -> Log {
        self.log.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The store.
    pub fn store(&self) -> Option<&'a Store> {
        self.store
    }

    /// The tetrahedralizer that this compilation will use, as it stands in keys. Asked once; starting the worker takes
    /// some milliseconds. `None` when it does not work: then nothing that needs it is kept.
    pub(crate) fn tetgen(&self, options: &tets::Options, monitor: &dyn Monitor) -> Result<Option<&str>> {
        if self.tetgen.get().is_none() {
            let found = tets::version(options, monitor)?;
            let _ = self.tetgen.set(found);
        }
        Ok(self.tetgen.get().and_then(Option::as_deref))
    }

    /// The record of a key. Not counted: it may be of no use without its content.
    pub(crate) fn find(&self, key: &Key, monitor: &dyn Monitor) -> Option<Record> {
        let store = self.store?;
        let found = store.find(key);
        notes(store, monitor);
        found
    }

    /// What a key has that the last one of the same subject had not.
    pub(crate) fn reasons(&self, key: &Key, part: &str) -> Vec<String> {
        self.store.map_or(Vec::new(), |store| store.reasons(key, &self.subject_of(part)))
    }

    /// The content of a record.
    pub(crate) fn read(&self, record: &Record, monitor: &dyn Monitor) -> Option<Vec<u8>> {
        let store = self.store?;
        let bytes = store.read(record);
        notes(store, monitor);
        bytes
    }

    /// The content of a record as a file, of which nothing but its hash, header and table has been checked.
    pub(crate) fn open(&self, record: &Record, monitor: &dyn Monitor) -> Option<bth_format::File> {
        let store = self.store?;
        let copy = |bytes: &[u8]| bth_format::File::from_bytes(bytes).ok();
        let file =
            store.read_as(record, |path| bth_format::File::read(path).ok(), copy, bth_format::File::bytes);
        notes(store, monitor);
        file
    }

    /// Whether the content of a record is there.
    pub(crate) fn holds(&self, record: &Record) -> bool {
        self.store.is_some_and(|store| store.holds(record))
    }

    /// Record and content of a key, counted as hit or miss. `part` tells apart what has the same subject.
    pub(crate) fn fetch(&self, key: &Key, part: &str, monitor: &dyn Monitor) -> Option<(Record, Vec<u8>)> {
        let found = self.find(key, monitor).and_then(|record| {
            let bytes = self.read(&record, monitor)?;
            Some((record, bytes))
        });
        match &found {
            Some(_) => self.hit(key, part),
            None => self.miss(key, part),
        }
        found
    }

    /// Keeps a content, and says so when that fails.
    pub(crate) fn put(
        &self,
        key: &Key,
        part: &str,
        bytes: &[u8],
        report: &impl Serialize,
        monitor: &dyn Monitor,
    ) -> Option<Record> {
        let store = self.store?;
        let report = serde_json::to_value(report).map_err(std::io::Error::from);
        self.say(key, part, report.and_then(|report| store.put(key, bytes, report)), monitor)
    }

    /// Keeps only what a content is called; see [`Store::put_name`].
    pub(crate) fn put_name(
        &self,
        key: &Key,
        (blob, bytes): (Digest, u64),
        report: &serde_json::Value,
        monitor: &dyn Monitor,
    ) -> Option<Record> {
        self.say(key, "", self.store?.put_name(key, blob, bytes, report.clone()), monitor)
    }

    /// Keeps a content that is of use on this machine only, and of which no miss is ever explained.
    pub(crate) fn keep_here(&self, key: &Key, bytes: &[u8], monitor: &dyn Monitor) {
        let Some(store) = self.store else { return };
        self.warn_of(store.put_here(key, bytes, serde_json::Value::Null), monitor);
    }

    fn say(
        &self,
        key: &Key,
        part: &str,
        kept: std::io::Result<Record>,
        monitor: &dyn Monitor,
    ) -> Option<Record> {
        let store = self.store?;
        store.note_last(key, &self.subject_of(part));
        self.warn_of(kept, monitor)
    }

    /// Passes on what was kept; says so, once, when something could not be.
    fn warn_of(&self, kept: std::io::Result<Record>, monitor: &dyn Monitor) -> Option<Record> {
        let store = self.store?;
        notes(store, monitor);
        match kept {
            Ok(record) => Some(record),
            Err(e) => {
                let first = !std::mem::replace(&mut self.lock_log().failed, true);
                if first {
                    monitor.warn(&format!("cache: {} cannot be written: {e}", store.folder().display()));
                }
                None
            }
        }
    }

    /// The right to work on a key alone, where that can be had.
    pub(crate) fn work(&self, key: &Key, monitor: &dyn Monitor) -> Result<Option<WorkLock>> {
        let lock = self.store.and_then(|store| store.work_lock(key, &|| monitor.cancelled()));
        monitor.check()?;
        Ok(lock)
    }

    /// What a stage makes: from the cache, else built and kept. `from_bytes` gives nothing for what cannot be used.
    pub(crate) fn stage<T, R: Serialize + DeserializeOwned>(
        &self,
        key: impl FnOnce() -> Key,
        part: &str,
        monitor: &dyn Monitor,
        from_bytes: impl FnOnce(&[u8]) -> Option<T>,
        to_bytes: impl FnOnce(&T) -> Vec<u8>,
        build: impl FnOnce() -> Result<(T, R)>,
    ) -> Result<(T, R)> {
        if self.store.is_none() {
            return build();
        }
        let key = key();
        if let Some((record, bytes)) = self.fetch(&key, part, monitor)
            && let Some(value) = from_bytes(&bytes)
            && let Ok(report) = serde_json::from_value(record.report)
        {
            return Ok((value, report));
        }
        let (value, report) = build()?;
        self.put(&key, part, &to_bytes(&value), &report, monitor);
        Ok((value, report))
    }

    /// Counts a hit.
    pub(crate) fn hit(&self, key: &Key, part: &str) {
        if let Some(store) = self.store {
            // Of a scene's thousand objects only those that were built are noted.
            if part.is_empty() {
                store.note_last(key, &self.subject_of(part));
            }
        }
        self.hits(key.stage(), 1);
    }

    /// Counts hits of a stage.
    pub(crate) fn hits(&self, stage: &str, hits: u64) {
        if let Some(store) = self.store.filter(|_| hits > 0) {
            store.count_hits(stage, hits);
            *self.lock_log().hits.entry(stage.to_owned()).or_default() += hits;
        }
    }

    /// Counts a miss, and says what differs.
    pub(crate) fn miss(&self, key: &Key, part: &str) {
        if let Some(store) = self.store {
            let because = store.count_miss(key, &self.subject_of(part));
            self.lock_log().misses.push(Miss {
                stage: key.stage().to_owned(),
                part: part.to_owned(),
                because,
            });
        }
    }

    fn subject_of(&self, part: &str) -> String {
        format!("{}#{part}", self.subject)
    }

    fn lock_log(&self) -> std::sync::MutexGuard<'_, Log> {
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The bytes of a result.
pub(crate) fn encode<T: Stored>(value: &T) -> Vec<u8> {
    let mut rows = Rows::default();
    value.rows(&mut rows);
    rows.finish()
}

/// A result from its bytes; `None` unless all of them are used.
pub(crate) fn decode<T: Stored>(bytes: &[u8]) -> Option<T> {
    let mut parts = Parts::new(bytes);
    let value = T::from_rows(&mut parts)?;
    parts.is_empty().then_some(value)
}

/// Passes on what the store has to say.
fn notes(store: &Store, monitor: &dyn Monitor) {
    store.take_notes().iter().for_each(|note| monitor.warn(note));
}
