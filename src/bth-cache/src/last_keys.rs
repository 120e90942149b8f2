//! The last key of each source, so that a miss can be explained. Only a hint: who loses it loses nothing else.

use crate::files::Files;
use crate::record::{seal, unseal};
use crate::{Digest, Key};
use std::path::Path;

/// What stands for a source and a stage: a hash, so that no path is kept.
fn subject(stage: &str, source: &str) -> Digest {
    Digest::of(format!("{stage}\0{source}").as_bytes())
}

/// Why a key is not there, given the one that the same source had before.
pub(crate) fn reasons(files: &Files, key: &Key, source: &str) -> Vec<String> {
    match read(&files.last(&subject(key.stage(), source))) {
        None => vec!["new".to_owned()],
        Some(last) if last == *key => vec!["evicted".to_owned()],
        Some(last) => key.differences(&last),
    }
}

/// Notes the key of a source.
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
