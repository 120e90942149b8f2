//! Eviction: the oldest contents by time of use first, never contents that a process has mapped.

use crate::files::{Files, named, remove};
use crate::record::Record;
use bth_files::SUFFIX;
use serde::Serialize;
use std::fs::{DirEntry, File, TryLockError};
use std::path::Path;
use std::time::SystemTime;

/// Result of an eviction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Evicted {
    /// Contents that were removed.
    pub entries: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Contents that would have been removed, were they not in use.
    pub in_use: u64,
    /// Contents that should have been removed and could not be.
    pub not_removed: u64,
    /// Unfinished files and locks of killed processes that were removed.
    pub leftovers: u64,
    /// Bytes that are left.
    pub left_bytes: u64,
}

/// Removes contents until `cap` bytes are left, then the records that led to them.
pub(crate) fn evict(files: &Files, cap: u64) -> Evicted {
    let mut done = Evicted { leftovers: sweep(files), ..Evicted::default() };
    let size = |entry: &DirEntry| entry.metadata().map_or(0, |m| m.len());
    let records = files.below("keys");
    done.left_bytes = records.iter().map(size).sum();
    let mut blobs: Vec<_> = files
        .below("blobs")
        .iter()
        .filter_map(|e| e.metadata().ok().and_then(|m| Some((m.modified().ok()?, m.len(), e.path()))))
        .collect();
    done.left_bytes += blobs.iter().map(|(_, bytes, _)| bytes).sum::<u64>();
    if done.left_bytes <= cap {
        return done;
    }
    blobs.sort();
    let mut oldest_left = None;
    for (used, bytes, path) in blobs {
        if done.left_bytes <= cap {
            oldest_left = Some(used);
            break;
        }
        if is_locked(&path) {
            done.in_use += 1;
        } else if remove(&path) {
            done.entries += 1;
            done.bytes += bytes;
            done.left_bytes -= bytes;
        } else if path.exists() {
            done.not_removed += 1;
        }
    }
    for entry in records {
        let bytes = size(&entry);
        if is_useless(files, &entry, oldest_left) && remove(&entry.path()) {
            done.left_bytes -= bytes;
        }
    }
    done
}

/// Returns true if a record's content is gone, or the record is damaged. One whose content is not
/// kept goes with contents of its age.
fn is_useless(files: &Files, entry: &DirEntry, oldest_left: Option<SystemTime>) -> bool {
    let path = entry.path();
    let (Some(id), Ok(text)) = (named(&path), std::fs::read(&path)) else { return false };
    match Record::from_text(&text, &id) {
        Ok(record) if record.whole => !files.blob(&record.blob).exists(),
        Ok(_) => {
            let used = entry.metadata().and_then(|m| m.modified()).ok();
            oldest_left.is_none_or(|oldest| used.is_none_or(|used| used < oldest))
        }
        Err(_) => true,
    }
}

/// Returns true if another process has a lock on a file. Where there are no locks nothing is
/// locked.
pub(crate) fn is_locked(path: &Path) -> bool {
    let file = File::open(path);
    file.is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

/// Removes unfinished files and locks of killed processes.
pub(crate) fn sweep(files: &Files) -> u64 {
    let mut removed = 0;
    for name in ["keys", "blobs", "last", "locks"] {
        for entry in files.below(name) {
            let unfinished = entry.file_name().as_encoded_bytes().ends_with(SUFFIX.as_bytes());
            if (unfinished || name == "locks") && !is_locked(&entry.path()) && remove(&entry.path()) {
                removed += 1;
            }
        }
    }
    removed
}
