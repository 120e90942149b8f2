//! Writes to standard output, standard error and files.

use anyhow::{Context, Result};
use std::io::{IsTerminal, Write};
use std::path::Path;

/// Prints a page and saves files. Does each even if the other fails: what was measured may have
/// taken hours.
pub(crate) fn print_and_save(page: &str, save: impl FnOnce() -> Result<()>) -> Result<()> {
    let printed = std::io::stdout().lock().write_all(page.as_bytes());
    save()?;
    Ok(printed?)
}

/// Writes a file, whole or not at all, and the folders that it is in. On failure a former file
/// stays.
pub(crate) fn write(path: &Path, text: &str) -> Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    bth_files::replace(path, |file| file.write_all(text.as_bytes()))
        .with_context(|| path.display().to_string())
}

/// Prints a message to standard error.
pub(crate) fn note(what: &str) {
    // Nothing can be done when standard error is closed.
    let _ = writeln!(std::io::stderr().lock(), "{what}");
}

/// Replaces the line on a terminal that names the current step; an empty text clears it.
pub(crate) fn progress(what: impl AsRef<str>) {
    let mut to = std::io::stderr().lock();
    if to.is_terminal() {
        let _ = write!(to, "\r\x1b[K{}", what.as_ref()).and_then(|()| to.flush());
    }
}
