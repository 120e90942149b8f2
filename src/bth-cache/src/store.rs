//! The store: find, read, pin and put.

use crate::evict::{Evicted, evict};
use crate::files::{Files, named, remove, touch};
use crate::lock::{WorkLock, same_file};
use crate::{Digest, Key, Record, Remote, Statistics, last_keys};
use bth_files::{create_folders, write_once_by};
use serde_json::Value;
use std::collections::HashSet;
use std::fs::File;
use std::io::{ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A process evicts after it has written this share of the cap, as the divisor.
const SHARE: u64 = 64;
/// Longest time between evictions by any process.
const LONG_UNCHECKED: Duration = Duration::from_secs(600);

/// What is wrong with a content that was changed.
const OTHER_HASH: &str = "its bytes do not have the hash that names it";

/// A store; see the crate's page.
pub struct Store {
    folder: PathBuf,
    pub(crate) files: Files,
    pub(crate) cap: u64,
    remote: Mutex<Option<Box<dyn Remote>>>,
    /// Names of contents in the shared store that were found damaged, and are replaced when they
    /// are made again.
    damaged_there: Mutex<HashSet<String>>,
    notes: Mutex<Vec<String>>,
    statistics: Mutex<Statistics>,
    written: AtomicU64,
}

/// A verified content that is not evicted while this value lives.
#[derive(Debug)]
pub struct Pin {
    /// The file, which is never written to again.
    pub path: PathBuf,
    /// The same file, open for reading.
    pub file: File,
}

impl Store {
    /// A store in a folder, which is made; `cap` bytes are kept.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn open(folder: &Path, cap: u64) -> Result<Self> {
        Ok(Self {
            folder: folder.to_owned(),
            files: Files::open(folder)?,
            cap,
            remote: Mutex::new(None),
            damaged_there: Mutex::default(),
            notes: Mutex::default(),
            statistics: Mutex::default(),
            written: AtomicU64::new(0),
        })
    }

    /// As [`Store::open`] of a folder that is a store already, or empty: what is named by mistake
    /// is left as it is.
    ///
    /// # Errors
    /// When it is neither, or cannot be read.
    pub fn open_existing(folder: &Path, cap: u64) -> Result<Self> {
        match Files::may_be_in(folder)? {
            true => Self::open(folder, cap),
            false => Err(std::io::Error::new(ErrorKind::NotFound, "it has other files, and none of a cache")),
        }
    }

    /// With a shared store behind it, which is read on a miss and to which every put is copied.
    /// When it fails, there is a note, and this process goes on without it.
    #[must_use]
    pub fn with_remote(self, remote: Box<dyn Remote>) -> Self {
        *lock(&self.remote) = Some(remote);
        self
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The record of a key, checked.
    pub fn find(&self, key: &Key) -> Option<Record> {
        self.find_id(&key.id())
    }

    /// The record of a key by the key's hash, checked.
    pub fn find_id(&self, id: &Digest) -> Option<Record> {
        self.local_record(id).or_else(|| {
            let text = self.fetch(&name("keys", id))?;
            match Record::from_text(&text, id) {
                Ok(record) => {
                    let _ = self.write(&self.files.key(id), &|out| out.write_all(&text));
                    Some(record)
                }
                Err(why) => {
                    self.damaged(&format!("record {} of the shared store", id.hex()), why);
                    None
                }
            }
        })
    }

    fn local_record(&self, id: &Digest) -> Option<Record> {
        let path = self.files.key(id);
        let text = std::fs::read(&path).ok()?;
        Record::from_text(&text, id).map_err(|why| self.drop_damaged(&path, why)).ok()
    }

    /// The content of a record, checked. `None` when it was evicted or is damaged; damaged content
    /// is removed, with a note.
    pub fn read(&self, record: &Record) -> Option<Vec<u8>> {
        let path = self.files.blob(&record.blob);
        if let Ok(bytes) = std::fs::read(&path) {
            if Digest::of(&bytes) == record.blob {
                touch(&path);
                return Some(bytes);
            }
            self.drop_damaged(&path, OTHER_HASH);
        }
        let there = name("blobs", &record.blob);
        let bytes = self.fetch(&there)?;
        if Digest::of(&bytes) != record.blob {
            lock(&self.damaged_there).insert(there);
            self.damaged(
                &format!("content {} of the shared store", record.blob.hex()),
                "it has another hash",
            );
            return None;
        }
        lock(&self.statistics).shared_hits += 1;
        // The bytes can be used even if they cannot be kept.
        let _ = self.write(&path, &|out| out.write_all(&bytes));
        Some(bytes)
    }

    /// As [`Store::read`], into memory that `read` takes from the file's path and `bytes` shows:
    /// for contents that need another alignment than bytes do. `copy` takes what comes from the
    /// shared store.
    pub fn read_as<T>(
        &self,
        record: &Record,
        read: impl FnOnce(&Path) -> Option<T>,
        copy: impl FnOnce(&[u8]) -> Option<T>,
        bytes: impl FnOnce(&T) -> &[u8],
    ) -> Option<T> {
        let path = self.files.blob(&record.blob);
        if let Some(value) = read(&path)
            && Digest::of(bytes(&value)) == record.blob
        {
            touch(&path);
            return Some(value);
        }
        // This removes and reports what is damaged.
        copy(&self.read(record)?)
    }

    /// The file of a record's content, checked, and kept from eviction; else as [`Store::read`].
    pub fn pin(&self, record: &Record) -> Option<Pin> {
        let path = self.files.blob(&record.blob);
        // Once from here, once from the shared store.
        for attempt in 0..2 {
            if let Ok(file) = File::open(&path) {
                // Without locks what is mapped may lose its name, which local file systems take
                // well.
                let _ = file.lock_shared();
                if same_file(&file, &path) {
                    match Digest::of_reader(&file) {
                        Ok((digest, _)) if digest == record.blob => {
                            touch(&path);
                            return Some(Pin { path, file });
                        }
                        _ => self.drop_damaged(&path, OTHER_HASH),
                    }
                }
            }
            if attempt == 0 {
                self.read(record)?;
            }
        }
        None
    }

    /// Bytes that are kept.
    pub fn cap(&self) -> u64 {
        self.cap
    }

    /// The file of a record's content, whether it is there or not.
    pub fn path(&self, record: &Record) -> PathBuf {
        self.files.blob(&record.blob)
    }

    /// Returns true if the content of a record is there; not whether it is whole.
    pub fn holds(&self, record: &Record) -> bool {
        self.files.blob(&record.blob).is_file()
    }

    /// Keeps a content under a key.
    ///
    /// # Errors
    /// When it cannot be written; the store is then as it was.
    pub fn put(&self, key: &Key, bytes: &[u8], report: Value) -> Result<Record> {
        self.put_written(key, &|out| out.write_all(bytes), report)
    }

    /// Keeps what `write` writes under a key. It is called more than once, so that the content need
    /// not be in memory, but for a shared store.
    ///
    /// # Errors
    /// Errors of `write`, or when it cannot be written; the store is then as it was.
    pub fn put_written(
        &self,
        key: &Key,
        write: &dyn Fn(&mut dyn Write) -> Result<()>,
        report: Value,
    ) -> Result<Record> {
        let (blob, bytes) = Digest::of_written(write)?;
        let record = Record { key: key.clone(), blob, bytes, whole: true, report };
        self.put_content(&record, write)?;
        let text = self.put_record(&record)?;
        if lock(&self.remote).is_some() {
            let there = name("blobs", &record.blob);
            let is_damaged = lock(&self.damaged_there).remove(&there);
            let mut content = Vec::new();
            write(&mut content)?;
            self.share(&there, &content, is_damaged);
        }
        self.share(&name("keys", &key.id()), text.as_bytes(), true);
        Ok(record)
    }

    /// Keeps only the name and length of a key's content, for contents that are quickly put
    /// together from others. `blob` is a hash that determines the content.
    ///
    /// # Errors
    /// The same as [`Store::put`].
    pub fn put_name(&self, key: &Key, blob: Digest, bytes: u64, report: Value) -> Result<Record> {
        let record = Record { key: key.clone(), blob, bytes, whole: false, report };
        let text = self.put_record(&record)?;
        self.share(&name("keys", &key.id()), text.as_bytes(), true);
        Ok(record)
    }

    fn put_content(&self, record: &Record, content: &dyn Fn(&mut dyn Write) -> Result<()>) -> Result<()> {
        let blob = self.files.blob(&record.blob);
        let mut new = self.write(&blob, content)?;
        if !new {
            match File::open(&blob).and_then(Digest::of_reader) {
                Ok((digest, _)) if digest == record.blob => {}
                // It was evicted meanwhile.
                Err(e) if e.kind() == ErrorKind::NotFound => new = self.write(&blob, content)?,
                found => {
                    match found {
                        Ok(_) => self.drop_damaged(&blob, OTHER_HASH),
                        // The user who made it can use it, but here it is a miss.
                        Err(e) if e.kind() == ErrorKind::PermissionDenied => {
                            remove(&blob);
                        }
                        Err(_) => self.drop_damaged(&blob, "it cannot be read"),
                    }
                    new = self.write(&blob, content)?;
                    // Another process may have put it there.
                    let found = File::open(&blob).and_then(Digest::of_reader);
                    if !new && !found.is_ok_and(|(digest, _)| digest == record.blob) {
                        let what = format!("{} is in the way and cannot be removed", blob.display());
                        return Err(std::io::Error::new(ErrorKind::AlreadyExists, what));
                    }
                }
            }
        }
        touch(&blob);
        if new {
            let mut statistics = lock(&self.statistics);
            statistics.stored += 1;
            statistics.stored_bytes += record.bytes;
        }
        self.written(record.bytes);
        Ok(())
    }

    /// Writes a record; its text.
    fn put_record(&self, record: &Record) -> Result<String> {
        let (id, text) = (record.key.id(), record.to_text()?);
        let path = self.files.key(&id);
        let write = || self.write(&path, &|out| out.write_all(text.as_bytes()));
        if !write()? {
            // The content that it led to is gone, or was made a second time.
            remove(&path);
            write()?;
        }
        self.written(text.len() as u64);
        Ok(text)
    }

    /// Evicts when this process has written much.
    fn written(&self, bytes: u64) {
        if self.written.fetch_add(bytes, Ordering::Relaxed) + bytes > self.cap / SHARE {
            self.evict(self.cap);
        }
    }

    /// The right to work on a key alone; see [`WorkLock`].
    pub fn work_lock(&self, key: &Key, cancelled: &dyn Fn() -> bool) -> Option<WorkLock> {
        WorkLock::take(&self.files.lock(&key.id()), cancelled)
    }

    /// Renews the time of use of a record whose content is not kept. For other records the time of
    /// their contents counts.
    pub fn touch(&self, record: &Record) {
        if !record.whole {
            touch(&self.files.key(&record.key.id()));
        }
    }

    /// Counts hits of a stage.
    pub fn count_hits(&self, stage: &str, hits: u64) {
        lock(&self.statistics).hit(stage, hits);
    }

    /// Why a key is missing: its differences from the last key of the same source. `source` may be
    /// a path: only a hash of it is kept.
    pub fn reasons(&self, key: &Key, source: &str) -> Vec<String> {
        last_keys::reasons(&self.files, key, source)
    }

    /// Counts a miss and returns its reasons.
    pub fn count_miss(&self, key: &Key, source: &str) -> Vec<String> {
        let reasons = self.reasons(key, source);
        lock(&self.statistics).miss(key.stage(), &reasons);
        reasons
    }

    /// Stores the key as the last one of a source.
    pub fn note_last(&self, key: &Key, source: &str) {
        last_keys::note(&self.files, key, source);
    }

    /// Takes the messages for the user: damaged entries, a shared store that cannot be reached.
    pub fn take_notes(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.notes))
    }

    /// Removes contents, the longest unused first, until `cap` bytes are left, and files left by
    /// killed processes.
    pub fn evict(&self, cap: u64) -> Evicted {
        self.written.store(0, Ordering::Relaxed);
        let evicted = evict(&self.files, cap);
        let mut statistics = lock(&self.statistics);
        statistics.evictions += evicted.entries;
        statistics.evicted_bytes += evicted.bytes;
        let _ = File::create(self.files.statistics().with_extension("checked"));
        evicted
    }

    /// The statistics of all processes, this one included.
    pub fn statistics(&self) -> Statistics {
        self.flush();
        Statistics::read(&self.files)
    }

    pub(crate) fn flush(&self) {
        let statistics = std::mem::take(&mut *lock(&self.statistics));
        // Lost counts cost nothing else.
        let _ = statistics.append(&self.files);
    }

    fn write(&self, path: &Path, content: &dyn Fn(&mut dyn Write) -> Result<()>) -> Result<bool> {
        match write_once_by(path, content) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                create_folders(&self.folder, path.parent().unwrap_or(Path::new(".")))?;
                write_once_by(path, content)
            }
            done => done,
        }
    }

    fn drop_damaged(&self, path: &Path, why: &str) {
        remove(path);
        let what = if named(path).is_some() { path.display().to_string() } else { "an entry".to_owned() };
        self.damaged(&what, why);
    }

    pub(crate) fn damaged(&self, what: &str, why: &str) {
        lock(&self.statistics).damaged += 1;
        lock(&self.notes).push(format!("cache: {what} is damaged ({why}); it is not used"));
    }

    fn fetch(&self, name: &str) -> Option<Vec<u8>> {
        let mut remote = lock(&self.remote);
        let got = remote.as_ref()?.get(name);
        got.unwrap_or_else(|e| {
            self.give_up(&mut remote, &e);
            None
        })
    }

    fn share(&self, name: &str, bytes: &[u8], overwrite: bool) {
        let mut remote = lock(&self.remote);
        let put = remote.as_ref().map_or(Ok(()), |place| place.put(name, bytes, overwrite));
        if let Err(e) = put {
            self.give_up(&mut remote, &e);
        }
    }

    fn give_up(&self, remote: &mut Option<Box<dyn Remote>>, error: &std::io::Error) {
        if let Some(gone) = remote.take()
            // Cancelled: no note, since nothing continues.
            && error.kind() != ErrorKind::Interrupted
        {
            let name = gone.name();
            lock(&self.notes).push(format!("cache: going on without the shared store {name}: {error}"));
        }
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        let unchecked = || {
            let checked = std::fs::metadata(self.files.statistics().with_extension("checked"));
            let age = checked.and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
            age.is_none_or(|age| age > LONG_UNCHECKED)
        };
        if self.written.load(Ordering::Relaxed) > 0 && unchecked() {
            self.evict(self.cap);
        }
        self.flush();
    }
}

impl std::fmt::Debug for Store {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Store").field("folder", &self.folder).field("cap", &self.cap).finish_non_exhaustive()
    }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The name of an entry, as in the folder but with slashes on all systems.
fn name(kind: &str, digest: &Digest) -> String {
    let hex = digest.hex();
    format!("{kind}/{}/{hex}", &hex[..2])
}
