//! What was written to a file outside of the store, so that an unchanged large file need not be read again to know
//! that it is unchanged.

use crate::files::Files;
use crate::opened::State;
use crate::record::{seal, unseal};
use crate::{Digest, Opened, Store};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Smaller files are read: that costs no more than keeping a stamp.
const LARGE: u64 = 4 << 20;
/// No file system of today counts time in longer steps than this, but for those that count seconds.
const STEP: Duration = Duration::from_millis(20);

/// A file as it was left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Stamp {
    device: u64,
    inode: u64,
    bytes: u64,
    changed: (i64, i64),
    blob: Digest,
}

impl Store {
    /// The content of a file, if it was noted when the file was written and the file has not been touched since.
    pub fn stamped(&self, path: &Path) -> Option<Digest> {
        let stamp = read(&self.files, path)?;
        (Stamp::of(path, stamp.blob) == Some(stamp)).then_some(stamp.blob)
    }

    /// As [`Store::stamped`], of a file that has been opened by that path: others may have replaced it since.
    pub fn stamped_opened(&self, path: &Path, opened: &Opened) -> Option<Digest> {
        let stamp = read(&self.files, path)?;
        (Stamp::from_state(opened.state(), stamp.blob) == Some(stamp)).then_some(stamp.blob)
    }

    /// Notes the content of a large file that was written just now.
    pub fn stamp(&self, path: &Path, blob: Digest) {
        let Some(stamp) = Stamp::of(path, blob).filter(|s| s.bytes >= LARGE) else { return };
        // A change within the same step of the clock would have the same time; this makes later ones have a later one.
        std::thread::sleep(STEP.saturating_sub(stamp.age()));
        if Stamp::of(path, blob) != Some(stamp) {
            return;
        }
        if let Ok(line) = serde_json::to_string(&stamp) {
            let place = self.files.last(&subject(path));
            let _ = std::fs::remove_file(&place);
            let _ = crate::atomic::write_once(&place, seal(line).as_bytes());
        }
    }
}

fn subject(path: &Path) -> Digest {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    Digest::of(&[b"stamp\0", path.as_os_str().as_encoded_bytes()].concat())
}

fn read(files: &Files, path: &Path) -> Option<Stamp> {
    serde_json::from_str(unseal(&std::fs::read(files.last(&subject(path))).ok()?).ok()?).ok()
}

impl Stamp {
    fn of(path: &Path, blob: Digest) -> Option<Self> {
        Self::from_state(State::of(&std::fs::metadata(path).ok()?), blob)
    }

    fn from_state(State { device, inode, bytes, changed }: State, blob: Digest) -> Option<Self> {
        // File systems that count whole seconds are too coarse, and elsewhere times can be set at will.
        (cfg!(unix) && changed.1 != 0).then_some(Self { device, inode, bytes, changed, blob })
    }

    /// Time since the change by the clock of this machine; none if the file's machine has another.
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
    fn any_change_ends_a_stamp_also_one_that_restores_the_time() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("cache"), 1 << 30).unwrap();
        let path = folder.path().join("file");
        let content = vec![7u8; LARGE as usize];
        let digest = Digest::of(&content);
        std::fs::write(&path, &content).unwrap();
        assert_eq!(store.stamped(&path), None);
        store.stamp(&path, digest);
        assert_eq!(store.stamped(&path), Some(digest));
        let opened = Opened::open(&path).unwrap();
        assert_eq!(store.stamped_opened(&path, &opened), Some(digest));
        let modified = std::fs::metadata(&path).unwrap().modified().unwrap();
        std::fs::write(&path, vec![8u8; LARGE as usize]).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_modified(modified).unwrap();
        assert_eq!(store.stamped(&path), None);
        assert_eq!(store.stamped_opened(&path, &Opened::open(&path).unwrap()), None);
        std::fs::write(&path, b"small").unwrap();
        store.stamp(&path, Digest::of(b"small"));
        assert_eq!(store.stamped(&path), None, "small files are read");
    }
}
