//! Temporary folders, which go with the program, also where it is cancelled and ends at once.

use std::fs::File;
use std::io::Result;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The folders that are there.
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn folders() -> MutexGuard<'static, Vec<PathBuf>> {
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A folder with one file, which is removed with this.
pub(crate) struct TemporaryFile {
    folder: PathBuf,
    path: PathBuf,
}

impl TemporaryFile {
    /// Creates a file of this name in a new folder.
    ///
    /// # Errors
    /// What the system reports.
    pub(crate) fn new(name: &Path) -> Result<(Self, File)> {
        // Locked until both are there, so that who removes the folder removes all of it.
        let mut folders = folders();
        let folder = tempfile::Builder::new().prefix("bthc-").tempdir()?;
        let path = folder.path().join(name);
        let file = File::create(&path)?;
        let folder = folder.keep();
        folders.push(folder.clone());
        Ok((Self { folder, path }, file))
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        // What cannot be removed stays; there is nobody to tell.
        let _ = std::fs::remove_dir_all(&self.folder);
        folders().retain(|folder| *folder != self.folder);
    }
}

/// Removes all folders and ends the program.
pub(crate) fn exit(code: u8) -> ! {
    // Kept locked, so that no other folder begins.
    let folders = folders();
    for folder in folders.iter() {
        let _ = std::fs::remove_dir_all(folder);
    }
    std::process::exit(code.into());
}
