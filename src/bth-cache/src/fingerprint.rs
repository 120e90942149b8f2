//! Fingerprints of output files: identity, length and time of change of a file with the hash of its
//! content, so that a large file need not be read to find out that it is unchanged.

use crate::files::Files;
use crate::record::{seal, unseal};
use crate::{Digest, Store};
use bth_files::{FileState, OpenFile};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Smaller files have no fingerprint: reading them costs no more.
const LARGE: u64 = 4 << 20;
/// Upper bound on the time resolution of file systems, except for those that store whole seconds.
const STEP: Duration = Duration::from_millis(20);

/// The state of a file after it was written, and its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Fingerprint {
    device: u64,
    inode: u64,
    bytes: u64,
    changed: (i64, i64),
    blob: Digest,
}

impl Store {
    /// The hash of a file's content, if a fingerprint was stored for it and the file has not been
    /// changed since.
    pub fn content_of(&self, path: &Path) -> Option<Digest> {
        let fingerprint = read(&self.files, path)?;
        (Fingerprint::of(path, fingerprint.blob) == Some(fingerprint)).then_some(fingerprint.blob)
    }

    /// As [`Store::content_of`] for a file already opened by that path, which may have been
    /// replaced since.
    pub fn content_of_open(&self, path: &Path, opened: &OpenFile) -> Option<Digest> {
        let fingerprint = read(&self.files, path)?;
        (Fingerprint::from_state(opened.state(), fingerprint.blob) == Some(fingerprint))
            .then_some(fingerprint.blob)
    }

    /// Stores the fingerprint of a large file that has just been written.
    pub fn store_fingerprint(&self, path: &Path, blob: Digest) {
        let Some(fingerprint) = Fingerprint::of(path, blob).filter(|s| s.bytes >= LARGE) else { return };
        // A change within the same clock step would get the same time of change: wait until the
        // step is over.
        std::thread::sleep(STEP.saturating_sub(fingerprint.age()));
        if Fingerprint::of(path, blob) != Some(fingerprint) {
            return;
        }
        if let Ok(line) = serde_json::to_string(&fingerprint) {
            let place = self.files.last(&subject(path));
            let _ = std::fs::remove_file(&place);
            let _ = bth_files::write_once(&place, seal(line).as_bytes());
        }
    }
}

fn subject(path: &Path) -> Digest {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    Digest::of(&[b"stamp\0", path.as_os_str().as_encoded_bytes()].concat())
}

fn read(files: &Files, path: &Path) -> Option<Fingerprint> {
    serde_json::from_str(unseal(&std::fs::read(files.last(&subject(path))).ok()?).ok()?).ok()
}

impl Fingerprint {
    fn of(path: &Path, blob: Digest) -> Option<Self> {
        Self::from_state(FileState::of(&std::fs::metadata(path).ok()?), blob)
    }

    fn from_state(FileState { device, inode, bytes, changed }: FileState, blob: Digest) -> Option<Self> {
        // Times in whole seconds are too coarse, and on systems other than Unix programs can set
        // them.
        (cfg!(unix) && changed.1 != 0).then_some(Self { device, inode, bytes, changed, blob })
    }

    /// Time since the change; zero when the clock of a remote file system is ahead of this
    /// machine's.
    fn age(&self) -> Duration {
        let (seconds, nanos) = self.changed;
        let changed =
            UNIX_EPOCH + Duration::new(seconds.try_into().unwrap_or(0), nanos.try_into().unwrap_or(0));
        SystemTime::now().duration_since(changed).unwrap_or_default()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn any_change_invalidates_a_fingerprint_even_one_that_restores_the_modification_time() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("cache"), 1 << 30).unwrap();
        let path = folder.path().join("file");
        let content = vec![7u8; LARGE as usize];
        let digest = Digest::of(&content);
        std::fs::write(&path, &content).unwrap();
        assert_eq!(store.content_of(&path), None);
        store.store_fingerprint(&path, digest);
        assert_eq!(store.content_of(&path), Some(digest));
        let opened = OpenFile::open(&path).unwrap();
        assert_eq!(store.content_of_open(&path, &opened), Some(digest));
        let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
        std::fs::write(&path, vec![8u8; LARGE as usize]).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
        assert_eq!(store.content_of(&path), None);
        assert_eq!(store.content_of_open(&path, &OpenFile::open(&path).unwrap()), None);
        std::fs::write(&path, b"small").unwrap();
        store.store_fingerprint(&path, Digest::of(b"small"));
        assert_eq!(store.content_of(&path), None, "small files are read");
    }
}
