//! The layout of a store's folder.

use crate::Digest;
use bth_files::create_folders;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A time of use younger than this is not renewed.
const FRESH: Duration = Duration::from_secs(1);

/// The folders of a store.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    root: PathBuf,
}

/// Folder of the entries, named by the version of their layout.
const VERSION: &str = "v1";
/// Tag by which backup programs recognize caches (<https://bford.info/cachedir/>).
const TAG: &str = "Signature: 8a477f597d28d172789f06886806bc55\n\
    # This folder is a cache of compiled models (bthc); it may be deleted at any time.\n";

impl Files {
    /// The files of a store; its folders are made. A store with contents is read where none can be
    /// made, as on a read-only disk.
    ///
    /// # Errors
    /// When they cannot be made, and there are no contents.
    pub(crate) fn open(folder: &Path) -> std::io::Result<Self> {
        let files = Self { root: folder.join(VERSION) };
        std::fs::create_dir_all(folder)?;
        for name in ["keys", "blobs", "locks", "last"] {
            let made = create_folders(folder, &files.root.join(name));
            made.or_else(|e| if files.root.join("blobs").is_dir() { Ok(()) } else { Err(e) })?;
        }
        let tag = folder.join("CACHEDIR.TAG");
        if !tag.exists() {
            // Without the tag backups are larger, and nothing else.
            let _ = std::fs::write(tag, TAG);
        }
        Ok(files)
    }

    /// Returns true if a folder is a store or may become one: whether it has the store's folder, or
    /// is empty.
    pub(crate) fn may_be_in(folder: &Path) -> std::io::Result<bool> {
        let mut is_empty = true;
        for entry in std::fs::read_dir(folder)? {
            if entry?.file_name() == VERSION {
                return Ok(true);
            }
            is_empty = false;
        }
        Ok(is_empty)
    }

    /// The record of a key.
    pub(crate) fn key(&self, id: &Digest) -> PathBuf {
        self.sharded("keys", id)
    }

    /// A content.
    pub(crate) fn blob(&self, digest: &Digest) -> PathBuf {
        self.sharded("blobs", digest)
    }

    /// The lock for building the content of a key.
    pub(crate) fn lock(&self, id: &Digest) -> PathBuf {
        self.root.join("locks").join(id.hex())
    }

    /// The last key of a source.
    pub(crate) fn last(&self, subject: &Digest) -> PathBuf {
        self.root.join("last").join(subject.hex())
    }

    /// Counters.
    pub(crate) fn statistics(&self) -> PathBuf {
        self.root.join("tally")
    }

    /// All files below `keys`, `blobs`, `locks` or `last`.
    pub(crate) fn below(&self, name: &str) -> Vec<std::fs::DirEntry> {
        let mut found = Vec::new();
        let mut folders = vec![self.root.join(name)];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
                match entry.file_type() {
                    // A folder instead of an entry is one that cannot be used.
                    Ok(kind) if kind.is_dir() && named(&entry.path()).is_none() => folders.push(entry.path()),
                    Ok(_) => found.push(entry),
                    // It went away meanwhile.
                    Err(_) => {}
                }
            }
        }
        found
    }

    /// Spread over folders by the first two digits, since some file systems are slow with many
    /// files in one.
    fn sharded(&self, name: &str, digest: &Digest) -> PathBuf {
        let hex = digest.hex();
        self.root.join(name).join(&hex[..2]).join(hex)
    }
}

/// The digest that a file is named by.
pub(crate) fn named(path: &Path) -> Option<Digest> {
    Digest::parse(path.file_name()?.to_str()?)
}

/// Removes a file; whether this call removed it. Except on Windows, read-only files need no other
/// rights.
pub(crate) fn remove(path: &Path) -> bool {
    std::fs::remove_file(path).is_ok()
}

/// Renews the time of use. Ignores failures, so that a store that cannot be written can still be
/// read.
pub(crate) fn touch(path: &Path) {
    let Ok(file) = File::open(path) else { return };
    let used = file.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
    if used.is_none_or(|age| age > FRESH) {
        let _ = file.set_modified(SystemTime::now());
    }
}
