//! The contents of a store: list, sums, verification, removal.

use crate::evict::{is_locked, sweep};
use crate::files::{named, remove};
use crate::{Digest, Record, Statistics, Store};
use serde::Serialize;
use std::collections::{BTreeMap, HashSet};
use std::io::{Error, ErrorKind};
use std::path::Path;
use std::time::SystemTime;

/// A record and the state of its content.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// Hash of the key.
    pub id: Digest,
    /// Stage of the key.
    pub stage: String,
    /// Names and values of the key.
    pub components: Vec<(String, String)>,
    /// Hash of the content.
    pub blob: Digest,
    /// Bytes of the content.
    pub bytes: u64,
    /// Seconds since the content was last used; `None` when it is gone.
    pub idle_seconds: Option<u64>,
}

/// Sums over a store.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Inventory {
    /// Folder of the store.
    pub folder: String,
    /// Records by stage.
    pub records: BTreeMap<String, u64>,
    /// Contents.
    pub contents: u64,
    /// Bytes of records and contents.
    pub bytes: u64,
    /// Bytes that are kept.
    pub cap: u64,
    /// Hits, misses and evictions so far.
    #[serde(rename = "tally")]
    pub statistics: Statistics,
}

/// Findings of a verification.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verification {
    /// Records that were checked.
    pub records: u64,
    /// Contents that were checked.
    pub contents: u64,
    /// Bytes of them.
    pub bytes: u64,
    /// Damaged records and contents, which were removed.
    pub damaged: Vec<String>,
    /// Damaged records and contents that could not be removed, and those that may not be read, each
    /// with the reason.
    pub not_removed: Vec<String>,
    /// Files left by killed processes, which were removed.
    pub leftovers: u64,
}

/// Result of removing everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Cleared {
    /// Contents that were removed.
    pub removed: u64,
    /// Contents that stay because they are in use.
    pub in_use: u64,
    /// Contents that could not be removed.
    pub not_removed: u64,
}

impl Verification {
    /// Returns true if nothing is damaged.
    pub fn is_clean(&self) -> bool {
        self.damaged.is_empty() && self.not_removed.is_empty()
    }

    /// Removes and lists what is damaged.
    fn remove(&mut self, path: &Path) {
        match std::fs::remove_file(path) {
            Ok(()) => self.damaged.push(path.display().to_string()),
            // Another process found it, too.
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            Err(e) => self.not_removed.push(format!("{}: cannot be removed: {e}", path.display())),
        }
    }

    /// Removes and lists what cannot be read, unless another user may read it.
    fn unreadable(&mut self, path: &Path, error: &Error) {
        match error.kind() {
            // It was evicted meanwhile.
            ErrorKind::NotFound => {}
            ErrorKind::PermissionDenied => {
                self.not_removed.push(format!("{}: cannot be read: {error}", path.display()));
            }
            _ => self.remove(path),
        }
    }
}

impl Store {
    /// All records, by stage and then by time of use, the latest first.
    pub fn list(&self) -> Vec<Entry> {
        let now = SystemTime::now();
        let one = |entry: std::fs::DirEntry| {
            let id = named(&entry.path())?;
            let record = Record::from_text(&std::fs::read(entry.path()).ok()?, &id).ok()?;
            let used = std::fs::metadata(self.files.blob(&record.blob)).and_then(|m| m.modified());
            let idle = used.ok().map(|t| now.duration_since(t).unwrap_or_default().as_secs());
            Some(Entry {
                id,
                stage: record.key.stage().to_owned(),
                components: record.key.components().to_vec(),
                blob: record.blob,
                bytes: record.bytes,
                idle_seconds: idle,
            })
        };
        let mut entries: Vec<_> = self.files.below("keys").into_iter().filter_map(one).collect();
        entries.sort_by(|a, b| (&a.stage, a.idle_seconds, a.id).cmp(&(&b.stage, b.idle_seconds, b.id)));
        entries
    }

    /// Sums over the store.
    pub fn inventory(&self) -> Inventory {
        let mut inventory = Inventory {
            folder: self.folder().display().to_string(),
            cap: self.cap,
            statistics: self.statistics(),
            ..Inventory::default()
        };
        self.list().into_iter().for_each(|e| *inventory.records.entry(e.stage).or_default() += 1);
        let blobs = self.files.below("blobs");
        inventory.contents = blobs.len() as u64;
        let all =
            blobs.iter().chain(&self.files.below("keys")).map(|e| e.metadata().map_or(0, |m| m.len())).sum();
        inventory.bytes = all;
        inventory
    }

    /// Reads everything, and removes damaged entries and files left by killed processes. Stops
    /// early when `go_on`, which gets the bytes read, returns false.
    pub fn verify(&self, go_on: &dyn Fn(u64) -> bool) -> Verification {
        let mut found = Verification { leftovers: sweep(&self.files), ..Verification::default() };
        for entry in self.files.below("keys") {
            let (path, id) = (entry.path(), named(&entry.path()));
            let text = match std::fs::read(&path) {
                Ok(text) => text,
                Err(e) => {
                    found.unreadable(&path, &e);
                    continue;
                }
            };
            found.records += 1;
            found.bytes += text.len() as u64;
            if id.is_none_or(|id| Record::from_text(&text, &id).is_err()) {
                found.remove(&path);
            }
        }
        for entry in self.files.below("blobs") {
            let path = entry.path();
            let (digest, bytes) = match std::fs::File::open(&path).and_then(Digest::of_reader) {
                Ok(read) => read,
                Err(e) => {
                    found.unreadable(&path, &e);
                    continue;
                }
            };
            found.contents += 1;
            found.bytes += bytes;
            if named(&path) != Some(digest) {
                found.remove(&path);
            }
            if !go_on(bytes) {
                break;
            }
        }
        for path in found.damaged.iter().chain(&found.not_removed) {
            self.damaged(path, "found by verification");
        }
        self.flush();
        found
    }

    /// Removes everything but what is in use.
    pub fn clear(&self) -> Cleared {
        let mut done = Cleared::default();
        let mut kept = HashSet::new();
        for entry in self.files.below("blobs") {
            if is_locked(&entry.path()) {
                done.in_use += 1;
                kept.extend(named(&entry.path()));
            } else if remove(&entry.path()) {
                done.removed += 1;
            } else if entry.path().exists() {
                done.not_removed += 1;
            }
        }
        for entry in self.files.below("keys") {
            let record = named(&entry.path())
                .and_then(|id| Record::from_text(&std::fs::read(entry.path()).ok()?, &id).ok());
            if !record.is_some_and(|r| kept.contains(&r.blob)) {
                remove(&entry.path());
            }
        }
        self.files.below("last").iter().for_each(|entry| {
            remove(&entry.path());
        });
        sweep(&self.files);
        remove(&self.files.statistics());
        done
    }
}
