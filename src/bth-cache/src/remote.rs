//! A second store behind the first, shared by machines: read on a miss, written on a build.

use std::io::{Error, ErrorKind, Result};
use std::path::PathBuf;

/// A store of named bytes. Names are such as `keys/ab/abcd…`; the bytes of a name never change, and
/// readers check what they read.
pub trait Remote: Send + Sync {
    /// The bytes of a name, if the store has it.
    ///
    /// # Errors
    /// When the store cannot be reached.
    fn get(&self, name: &str) -> Result<Option<Vec<u8>>>;
    /// Keeps bytes under a name; `overwrite` replaces those that are there.
    ///
    /// # Errors
    /// When the store cannot be reached or is full.
    fn put(&self, name: &str, bytes: &[u8], overwrite: bool) -> Result<()>;
    /// Its name in messages.
    fn name(&self) -> String;
}

/// A folder that machines share. It needs no locks: files are written under another name and then
/// linked.
#[derive(Clone, Debug)]
pub struct Folder(pub PathBuf);

impl Remote for Folder {
    fn get(&self, name: &str) -> Result<Option<Vec<u8>>> {
        match std::fs::read(self.0.join(name)) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(e) if e.kind() == ErrorKind::NotFound && self.0.is_dir() => Ok(None),
            Err(e) => Err(e),
        }
    }

    fn put(&self, name: &str, bytes: &[u8], overwrite: bool) -> Result<()> {
        let path = self.0.join(name);
        if !self.0.is_dir() {
            return Err(Error::new(ErrorKind::NotFound, "the folder is not there"));
        }
        if let Some(folder) = path.parent() {
            bth_files::create_folders(&self.0, folder)?;
        }
        if overwrite {
            // A failure to remove shows in the write below.
            let _ = std::fs::remove_file(&path);
        }
        bth_files::write_once(&path, bytes).map(|_| ())
    }

    fn name(&self) -> String {
        self.0.display().to_string()
    }
}
