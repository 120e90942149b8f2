//! Fingerprints of output files: identity, length and time of change of a file with the hash of its
//! content, so that a large file need not be read to find out that it is unchanged.

use crate::files::Files;
use crate::record::{seal, unseal};
use crate::{Digest, Store};
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
    /// The fingerprint of a file. No program can set its time of change, which the system sets on
    /// every change of content, name or attributes. `None` where times are in whole seconds, which
    /// are too coarse, and on systems other than Unix, which have no time of change.
    #[cfg(unix)]
    fn of(path: &Path, blob: Digest) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;
        let m = std::fs::metadata(path).ok()?;
        let changed = (m.ctime(), m.ctime_nsec());
        (changed.1 != 0).then_some(Self { device: m.dev(), inode: m.ino(), bytes: m.len(), changed, blob })
    }

    #[cfg(not(unix))]
    fn of(_: &Path, _: Digest) -> Option<Self> {
        None
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
        let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
        std::fs::write(&path, vec![8u8; LARGE as usize]).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
        assert_eq!(store.content_of(&path), None);
        std::fs::write(&path, b"small").unwrap();
        store.store_fingerprint(&path, Digest::of(b"small"));
        assert_eq!(store.content_of(&path), None, "small files are read");
    }
}
