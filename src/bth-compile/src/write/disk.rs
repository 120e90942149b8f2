//! Files whose bytes are read when they are written to another file, so that they need not be in
//! memory.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Bytes that are read at a time.
const PIECE: u64 = 4 << 20;

/// A file on disk.
#[derive(Debug)]
pub(crate) struct DiskFile {
    path: PathBuf,
    /// The file if it is kept open, so that it may lose its name.
    open: Option<Mutex<File>>,
}

/// The error for a file that cannot be read again.
#[derive(Debug)]
pub(crate) struct Unread {
    pub(crate) path: PathBuf,
    /// The error of the system; `None` if the file does not have the bytes that it had before.
    pub(crate) why: Option<Error>,
}

impl std::fmt::Display for Unread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let path = self.path.display();
        match &self.why {
            Some(why) => write!(f, "{path} cannot be read: {why}"),
            None => write!(f, "{path} is damaged, or changed while it was read"),
        }
    }
}

impl std::error::Error for Unread {}

impl DiskFile {
    /// A file that is opened whenever it is read.
    pub(crate) fn at(path: &Path) -> Self {
        Self { path: path.to_owned(), open: None }
    }

    /// A file that stays open.
    pub(crate) fn open(path: &Path, file: File) -> Self {
        Self { path: path.to_owned(), open: Some(Mutex::new(file)) }
    }

    /// Passes on bytes that have this hash, in pieces.
    ///
    /// # Errors
    /// [`Unread`] when they cannot be read or have another hash, and errors of `take`.
    pub(crate) fn read(
        &self,
        range: Range<u64>,
        hash: [u8; 16],
        take: &mut dyn FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        match &self.open {
            Some(file) => self.read_from(&lock(file), range, hash, take),
            None => {
                self.read_from(&File::open(&self.path).map_err(|e| self.unread(Some(e)))?, range, hash, take)
            }
        }
    }

    fn read_from(
        &self,
        mut file: &File,
        range: Range<u64>,
        hash: [u8; 16],
        take: &mut dyn FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        let failed = |e: Error| self.unread(Some(e).filter(|e| e.kind() != ErrorKind::UnexpectedEof));
        file.seek(SeekFrom::Start(range.start)).map_err(failed)?;
        let mut left = range.end - range.start;
        let mut piece = vec![0; left.min(PIECE) as usize];
        let mut hasher = blake3::Hasher::new();
        while left > 0 {
            let piece = &mut piece[..left.min(PIECE) as usize];
            file.read_exact(piece).map_err(failed)?;
            hasher.update(piece);
            take(piece)?;
            left -= piece.len() as u64;
        }
        if hasher.finalize().as_bytes()[..16] == hash { Ok(()) } else { Err(self.unread(None)) }
    }

    fn unread(&self, why: Option<Error>) -> Error {
        Error::new(ErrorKind::InvalidData, Unread { path: self.path.clone(), why })
    }

    /// Appends bytes to a file that is kept open. Returns where they are.
    ///
    /// # Errors
    /// Errors of the system.
    pub(crate) fn append(&self, bytes: &[u8]) -> Result<Range<u64>> {
        let open = self.open.as_ref().ok_or_else(|| Error::other("the file is not open"))?;
        let mut file = &*lock(open);
        let first = file.seek(SeekFrom::End(0))?;
        file.write_all(bytes)?;
        Ok(first..first + bytes.len() as u64)
    }
}

fn lock(file: &Mutex<File>) -> std::sync::MutexGuard<'_, File> {
    file.lock().unwrap_or_else(PoisonError::into_inner)
}
