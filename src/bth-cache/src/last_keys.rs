//! The last key of each source, to explain misses. Nothing else depends on it.

use crate::files::Files;
use crate::record::{seal, unseal};
use crate::{Digest, Key};
use std::path::Path;

/// Hash of a source and a stage, so that no path is kept.
fn subject(stage: &str, source: &str) -> Digest {
    Digest::of(format!("{stage}\0{source}").as_bytes())
}

/// Why a key is missing, given the last key of the same source.
pub(crate) fn reasons(files: &Files, key: &Key, source: &str) -> Vec<String> {
    match read(&files.last(&subject(key.stage(), source))) {
        None => vec!["new".to_owned()],
        Some(last) if last == *key => vec!["evicted".to_owned()],
        Some(last) => key.differences(&last),
    }
}

/// Stores the last key of a source.
pub(crate) fn note(files: &Files, key: &Key, source: &str) {
    let path = files.last(&subject(key.stage(), source));
    if read(&path).as_ref() == Some(key) {
        return;
    }
    if let Ok(line) = serde_json::to_string(key) {
        let _ = std::fs::remove_file(&path);
        let _ = bth_files::write_once(&path, seal(line).as_bytes());
    }
}

fn read(path: &Path) -> Option<Key> {
    serde_json::from_str(unseal(&std::fs::read(path).ok()?).ok()?).ok()
}
