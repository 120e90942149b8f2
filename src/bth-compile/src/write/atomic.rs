//! Writes of whole files through `bth_files`, with the errors of the compiler.

use super::Content;
use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Writes a file atomically: the file of that name is replaced by the whole content or not at all.
///
/// # Errors
/// `BTH-O020` with the message of the system; the target is then unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically_with(path, |out| out.write_all(bytes))
}

/// Does the same as [`write_atomically`] for bytes that are not in memory at once.
///
/// # Errors
/// The errors of [`write_atomically`]; also when `write` fails.
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<()> {
    bth_files::replace(path, write).map_err(|e| cannot(path, &e))
}

/// Does the same as [`write_atomically`] for a content with pieces in other files, which the
/// operating system copies.
///
/// # Errors
/// The errors of [`write_atomically`]; also when such a file cannot be read or has changed.
pub fn write_content(path: &Path, content: &Content) -> Result<()> {
    bth_files::replace_file(path, |file| content.write_to(file)).map_err(|e| cannot(path, &e))
}

fn cannot(path: &Path, error: &std::io::Error) -> Error {
    Error::File { code: "BTH-O020", path: path.to_owned(), message: format!("cannot write: {error}") }
}
