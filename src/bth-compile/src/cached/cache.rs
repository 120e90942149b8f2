//! Access to the store: lookups and additions of results, and the log of hits and misses.

use super::log::{Log, Miss};
use super::warnings::{replay, with_warnings};
use crate::error::Result;
use crate::monitor::{Monitor, Recording};
use crate::stage::CachedStage;
use crate::tets;
use bth_cache::{Key, Pin, Record, Store, WorkLock};
use bth_files::Digest;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::Write;
use std::sync::{Mutex, OnceLock, PoisonError};

/// The cache of a compilation, or none.
pub struct Cache<'a> {
    store: Option<&'a Store>,
    /// Name of the source, under which its last keys are stored to explain misses.
    subject: String,
    log: Mutex<Log>,
    tetgen: OnceLock<Option<String>>,
}

impl<'a> Cache<'a> {
    /// A cache without a store, which keeps nothing.
    pub fn none() -> Self {
        Self { store: None, subject: String::new(), log: Mutex::default(), tetgen: OnceLock::new() }
    }

    /// Keeps results in a store. `subject` names what is compiled, such as its absolute path: a
    /// miss is explained by the last key of the same subject; no result depends on it.
    pub fn new(store: &'a Store, subject: impl Into<String>) -> Self {
        Self { store: Some(store), subject: subject.into(), ..Self::none() }
    }

    /// The hits and misses so far.
    pub fn log(&self) -> Log {
        self.log.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The store.
    pub fn store(&self) -> Option<&'a Store> {
        self.store
    }

    /// The name of the tetrahedralizer in keys, determined once because starting the worker takes
    /// some milliseconds. `None` when the worker fails; results that depend on it are not kept
    /// then.
    pub(crate) fn tetgen(&self, options: &tets::TetOptions, monitor: &dyn Monitor) -> Result<Option<&str>> {
        if self.tetgen.get().is_none() {
            let found = tets::version(options, monitor)?;
            let _ = self.tetgen.set(found);
        }
        Ok(self.tetgen.get().and_then(Option::as_deref))
    }

    /// The record of a key. Not counted as a hit, because the content may be missing.
    pub(crate) fn find(&self, key: &Key, monitor: &dyn Monitor) -> Option<Record> {
        let store = self.store?;
        let found = store.find(key);
        pass_notes(store, monitor);
        found
    }

    /// What differs from the last key of the same subject.
    pub(crate) fn reasons(&self, key: &Key, part: &str) -> Vec<String> {
        self.store.map_or(Vec::new(), |store| store.reasons(key, &self.subject_of(part)))
    }

    /// The content of a record.
    pub(crate) fn read(&self, record: &Record, monitor: &dyn Monitor) -> Option<Vec<u8>> {
        let store = self.store?;
        let bytes = store.read(record);
        pass_notes(store, monitor);
        bytes
    }

    /// The content of a record as a file. Only its hash, header and table have been checked.
    pub(crate) fn open(&self, record: &Record, monitor: &dyn Monitor) -> Option<bth_format::File> {
        let store = self.store?;
        let copy = |bytes: &[u8]| bth_format::File::from_bytes(bytes).ok();
        let file =
            store.read_as(record, |path| bth_format::File::read(path).ok(), copy, bth_format::File::bytes);
        pass_notes(store, monitor);
        file
    }

    /// The file of a record's content, which is not evicted while it is open.
    pub(crate) fn pin(&self, record: &Record, monitor: &dyn Monitor) -> Option<Pin> {
        let store = self.store?;
        let pin = store.pin(record);
        pass_notes(store, monitor);
        pin
    }

    /// Returns true if the store has the content of a record.
    pub(crate) fn holds(&self, record: &Record) -> bool {
        self.store.is_some_and(|store| store.holds(record))
    }

    /// Record and content of a key, counted as a hit. `part` tells apart what has the same subject.
    pub(crate) fn fetch(&self, key: &Key, part: &str, monitor: &dyn Monitor) -> Option<(Record, Vec<u8>)> {
        let record = self.find(key, monitor)?;
        let bytes = self.read(&record, monitor)?;
        self.hit(key, part);
        Some((record, bytes))
    }

    /// Keeps a content, with the warnings that were given while it was made; a failure is a
    /// warning.
    pub(crate) fn put(
        &self,
        key: &Key,
        part: &str,
        bytes: &[u8],
        report: &impl Serialize,
        recording: &Recording<'_>,
    ) -> Option<Record> {
        self.put_written(key, part, &|out| out.write_all(bytes), report, recording)
    }

    /// As [`Self::put`], with what `write` writes.
    pub(crate) fn put_written(
        &self,
        key: &Key,
        part: &str,
        write: &dyn Fn(&mut dyn Write) -> std::io::Result<()>,
        report: &impl Serialize,
        recording: &Recording<'_>,
    ) -> Option<Record> {
        let store = self.store?;
        let report = with_warnings(report, recording).map_err(std::io::Error::from);
        self.note_put(key, part, report.and_then(|report| store.put_written(key, write, report)), recording)
    }

    /// Keeps only the name of a content; see [`Store::put_name`].
    pub(crate) fn put_name(
        &self,
        key: &Key,
        (blob, bytes): (Digest, u64),
        report: &serde_json::Value,
        monitor: &dyn Monitor,
    ) -> Option<Record> {
        self.note_put(key, "", self.store?.put_name(key, blob, bytes, report.clone()), monitor)
    }

    /// Notes the key as the last one of its subject.
    fn note_put(
        &self,
        key: &Key,
        part: &str,
        put: std::io::Result<Record>,
        monitor: &dyn Monitor,
    ) -> Option<Record> {
        let store = self.store?;
        store.note_last(key, &self.subject_of(part));
        self.warn_once(put, monitor)
    }

    /// The record. The first failure of a compilation is reported as a warning, later ones are not
    /// reported.
    fn warn_once(&self, put: std::io::Result<Record>, monitor: &dyn Monitor) -> Option<Record> {
        let store = self.store?;
        pass_notes(store, monitor);
        match put {
            Ok(record) => Some(record),
            Err(e) => {
                let first = !std::mem::replace(&mut self.lock_log().failed, true);
                if first {
                    monitor.notice(&format!("cache: {} cannot be written: {e}", store.folder().display()));
                }
                None
            }
        }
    }

    /// The lock for building the result of a key, where the file system has locks.
    fn work(&self, key: &Key, monitor: &dyn Monitor) -> Result<Option<WorkLock>> {
        let lock = self.store.and_then(|store| store.work_lock(key, &|| monitor.cancelled()));
        monitor.check()?;
        Ok(lock)
    }

    /// The result of a stage, if the cache has it. `part` as in [`Cache::fetch`].
    pub(crate) fn take<T, R: Serialize + DeserializeOwned, S: CachedStage<T, R>>(
        &self,
        stage: &S,
        part: &str,
        monitor: &dyn Monitor,
    ) -> Option<(T, R)> {
        let key = self.store.map(|_| stage.key())?;
        let (record, bytes) = self.fetch(&key, part, monitor)?;
        let (value, report) = (stage.decode(&bytes)?, R::deserialize(&record.report).ok()?);
        replay(&record.report, monitor);
        Some((value, report))
    }

    /// The result of a stage: from the cache if it has the result, else made and kept. `part` as in
    /// [`Cache::fetch`].
    pub(crate) fn run<T, R: Serialize + DeserializeOwned, S: CachedStage<T, R>>(
        &self,
        stage: S,
        part: &str,
        monitor: &dyn Monitor,
    ) -> Result<(T, R)> {
        if let Some(found) = self.take(&stage, part, monitor) {
            return Ok(found);
        }
        let Some(key) = self.store.map(|_| stage.key()) else { return stage.run(monitor) };
        self.miss(&key, part);
        let recording = Recording::new(monitor);
        let (value, report) = stage.run(&recording)?;
        self.put(&key, part, &S::encode(&value), &report, &recording);
        Ok((value, report))
    }

    /// The value that `fetched` finds for a key, else the lock for building it, if the result may
    /// be kept. If another process holds the lock, this one waits for it and then looks the key up
    /// again.
    pub(crate) fn find_or_lock<T>(
        &self,
        (key, part): (Option<&Key>, &str),
        monitor: &dyn Monitor,
        fetched: impl Fn() -> Option<T>,
    ) -> Result<(Option<T>, Option<WorkLock>)> {
        let Some(key) = key else { return Ok((None, None)) };
        if let Some(found) = fetched() {
            return Ok((Some(found), None));
        }
        let lock = self.work(key, monitor)?;
        if lock.as_ref().is_some_and(|lock| lock.waited)
            && let Some(found) = fetched()
        {
            return Ok((Some(found), lock));
        }
        self.miss(key, part);
        Ok((None, lock))
    }

    /// Counts a hit.
    pub(crate) fn hit(&self, key: &Key, part: &str) {
        if let Some(store) = self.store {
            // A scene may have thousands of objects, so for objects only misses are stored.
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

    /// Counts a miss and logs what differs from the last key.
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

/// Passes the notes of the store to the monitor.
fn pass_notes(store: &Store, monitor: &dyn Monitor) {
    store.take_notes().iter().for_each(|note| monitor.notice(note));
}
