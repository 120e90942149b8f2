//! The bytes of a source file, the progress of its reader, and errors at places in it.

use std::cell::Cell;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::monitor::Monitor;

/// Rows that a reader reads between two calls of the monitor: a few milliseconds.
const ROWS_BETWEEN_CHECKS: u64 = 1 << 16;

/// A source file in memory.
pub(crate) struct Source<'a> {
    /// Where it was read from, for messages.
    pub(crate) path: &'a Path,
    /// All its bytes.
    pub(crate) data: &'a [u8],
    /// Receives progress and warnings.
    pub(crate) monitor: &'a dyn Monitor,
    reported: Cell<u64>,
}

impl<'a> Source<'a> {
    /// Returns a source before anything is read.
    pub(crate) fn new(path: &'a Path, data: &'a [u8], monitor: &'a dyn Monitor) -> Self {
        Source { path, data, monitor, reported: Cell::new(0) }
    }

    /// Does the same as [`Self::progress`], but only for one row in [`ROWS_BETWEEN_CHECKS`].
    #[inline]
    pub(crate) fn tick(&self, row: u64, bytes: usize) -> Result<()> {
        if row.is_multiple_of(ROWS_BETWEEN_CHECKS) { self.progress(bytes) } else { Ok(()) }
    }

    /// Reports how many bytes are read so far, and fails once the user cancelled.
    pub(crate) fn progress(&self, bytes: usize) -> Result<()> {
        let bytes = (bytes as u64).max(self.reported.get());
        self.monitor.advance(bytes - self.reported.replace(bytes));
        self.monitor.check()
    }

    /// Refuses the pointer that Git LFS puts instead of a file that was not fetched. Its text would
    /// be a valid OBJ without faces.
    pub(crate) fn fetched(&self) -> Result<()> {
        if !self.data.starts_with(b"version https://git-lfs.github.com/") {
            return Ok(());
        }
        let message = "expected a model, found the pointer of Git LFS to one";
        Err(self.error("BTH-I001", message, "run `git lfs pull`"))
    }

    /// An error of the file as a whole.
    pub(crate) fn error(&self, code: &'static str, message: impl Into<String>, hint: &str) -> Error {
        input_error(code, Place::File(self.path.to_owned()), message, hint)
    }

    /// An error at a line, from 1.
    pub(crate) fn error_at_line(
        &self,
        code: &'static str,
        line: u64,
        message: impl Into<String>,
        hint: &str,
    ) -> Error {
        input_error(code, self.line(line), message, hint)
    }

    /// An error at a byte, from 0.
    pub(crate) fn error_at_byte(
        &self,
        code: &'static str,
        byte: usize,
        message: impl Into<String>,
        hint: &str,
    ) -> Error {
        input_error(code, self.byte(byte), message, hint)
    }

    /// An error in a named part.
    pub(crate) fn error_in_part(
        &self,
        code: &'static str,
        part: impl Into<String>,
        message: impl Into<String>,
        hint: &str,
    ) -> Error {
        input_error(code, Place::Part(self.path.to_owned(), part.into()), message, hint)
    }

    /// The place of a line, from 1.
    pub(crate) fn line(&self, line: u64) -> Place {
        Place::Line(self.path.to_owned(), line)
    }

    /// The place of a byte, from 0.
    pub(crate) fn byte(&self, byte: usize) -> Place {
        Place::Byte(self.path.to_owned(), byte as u64)
    }
}

/// An error of a source.
pub(crate) fn input_error(code: &'static str, place: Place, message: impl Into<String>, hint: &str) -> Error {
    Error::Input { code, place, message: message.into(), hint: hint.to_owned() }
}

/// All bytes of a source, which must be a regular file.
///
/// # Errors
/// `BTH-O001` when it cannot be read.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    bth_files::regular_file(path).and_then(|_| std::fs::read(path)).map_err(|e| cannot_read(path, &e))
}

/// The first bytes of a file next to a model, at most `most`.
///
/// # Errors
/// `BTH-O001` when it cannot be read or is no regular file.
pub(crate) fn read_at_most(path: &Path, most: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let file = bth_files::regular_file(path).and_then(|_| std::fs::File::open(path));
    let read = file.and_then(|file| file.take(most).read_to_end(&mut bytes));
    read.map(|_| bytes).map_err(|e| cannot_read(path, &e))
}

fn cannot_read(path: &Path, e: &std::io::Error) -> Error {
    Error::File { code: "BTH-O001", path: path.to_owned(), message: format!("cannot read: {e}") }
}

/// Code: the file is cut off. Use it with [`TRUNCATED_HINT`].
pub(crate) const TRUNCATED: &str = "BTH-I003";
/// Code: a texture, an image or a material library that cannot be read.
pub(crate) const IMAGE: &str = "BTH-I016";
/// Hint for a file that is cut off.
pub(crate) const TRUNCATED_HINT: &str = "the file is cut off; copy or export it again";
/// Code: the text or structure does not follow the format.
pub(crate) const MALFORMED: &str = "BTH-I002";
/// Code: a coordinate of a used position is not finite.
pub(crate) const NON_FINITE: &str = "BTH-I004";
/// Code: an index refers to a row that does not exist.
pub(crate) const INDEX: &str = "BTH-I005";
/// Code: a variant of the format that is not supported.
pub(crate) const UNSUPPORTED: &str = "BTH-I006";
/// Hint for a text file that does not follow its format.
pub(crate) const MALFORMED_HINT: &str = "correct the file there, or export it again";
/// Hint for an index out of range.
pub(crate) const INDEX_HINT: &str = "export the model again; its faces do not belong to its vertices";
