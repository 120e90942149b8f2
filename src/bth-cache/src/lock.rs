//! Work that is done once by many processes, where the file system has locks.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Between two tries to get a lock that another process has.
const PAUSE: Duration = Duration::from_millis(20);

/// Exclusive lock on the work for a key; released when dropped, or when the process ends in any
/// way.
#[derive(Debug)]
pub struct WorkLock {
    path: PathBuf,
    /// True if another process held the lock before: it may have stored the result.
    pub waited: bool,
    _file: File,
}

impl WorkLock {
    /// Waits for the lock. `None` when cancelled, or where there are no locks: then work may be
    /// done twice, which costs time and nothing else.
    pub(crate) fn take(path: &Path, cancelled: &dyn Fn() -> bool) -> Option<Self> {
        let mut waited = false;
        loop {
            let file = File::options().write(true).create(true).truncate(false).open(path).ok()?;
            match file.try_lock() {
                // The previous holder may have removed the name meanwhile; then other processes
                // lock another file.
                Ok(()) if same_file(&file, path) => {
                    return Some(Self { path: path.to_owned(), waited, _file: file });
                }
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    waited = true;
                    if cancelled() {
                        return None;
                    }
                    std::thread::sleep(PAUSE);
                }
                Err(TryLockError::Error(_)) => return None,
            }
        }
    }
}

impl Drop for WorkLock {
    fn drop(&mut self) {
        // Before the lock is released with the file: no process can hold the locks of both the old
        // and a new file.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Returns true if a name still leads to an open file.
#[cfg(unix)]
pub(crate) fn same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |m: std::fs::Metadata| (m.dev(), m.ino());
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(open), Ok(named)) => identity(open) == identity(named),
        _ => false,
    }
}

/// Elsewhere open files keep their names.
#[cfg(not(unix))]
pub(crate) fn same_file(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn one_at_a_time_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let (inside, most) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..20 {
                        let lock = WorkLock::take(&path, &|| false).unwrap();
                        most.fetch_max(inside.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                        std::thread::yield_now();
                        inside.fetch_sub(1, Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert_eq!(most.load(Ordering::SeqCst), 1);
        assert!(!path.exists());
    }

    #[test]
    fn waiting_can_be_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let held = WorkLock::take(&path, &|| false).unwrap();
        assert!(!held.waited);
        assert!(WorkLock::take(&path, &|| true).is_none());
    }
}
