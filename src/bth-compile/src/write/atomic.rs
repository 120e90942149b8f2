//! Writes of whole files through `bth_files`, with the errors of the compiler.

use super::{Content, Unread};
use crate::error::{Error, Result};
use crate::source::{cannot_read, changed};
use std::path::Path;

/// Writes a file atomically: the file of that name is replaced by the whole content or not at all.
///
/// # Errors
/// `BTH-O020` with the message of the system; the target is then unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    bth_files::replace(path, |out| out.write_all(bytes)).map_err(|e| cannot(path, &e))
}

/// Writes a content as [`write_atomically`] does. What was kept in temporary files is removed part
/// by part, so that a large file does not need room twice.
///
/// # Errors
/// The errors of [`write_atomically`]; for files that are copied into it `BTH-O001` when they
/// cannot be read and `BTH-O002` when they have changed.
pub fn write_content(path: &Path, content: Content) -> Result<()> {
    bth_files::replace(path, |out| content.write_last(out))
        .map_err(|e| unread(&e).unwrap_or_else(|| cannot(path, &e)))
}

/// The error for a file that cannot be read again, if it is that.
pub(crate) fn unread(error: &std::io::Error) -> Option<Error> {
    let Unread { path, why } = error.get_ref()?.downcast_ref()?;
    Some(match why {
        Some(why) => cannot_read(path, why),
        None => changed(path),
    })
}

fn cannot(path: &Path, error: &std::io::Error) -> Error {
    Error::File { code: "BTH-O020", path: path.to_owned(), message: format!("cannot write: {error}") }
}
