//! Standard output and standard error.

use bth_files::printable;
use serde::Serialize;
use std::io::{Result, StdoutLock, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// True if something was printed on standard output, or is being printed.
static BEGUN: AtomicBool = AtomicBool::new(false);

/// Returns true if something was printed on standard output, or is being printed.
pub(crate) fn has_begun() -> bool {
    BEGUN.load(Ordering::Relaxed)
}

/// Notes that something is going to be printed on standard output.
pub(crate) fn begin() {
    BEGUN.store(true, Ordering::Relaxed);
}

/// Standard output, locked.
pub(crate) fn stdout() -> StdoutLock<'static> {
    begin();
    std::io::stdout().lock()
}

/// Prints text as it is.
pub(crate) fn text(text: &str) -> Result<()> {
    let mut out = stdout();
    out.write_all(text.as_bytes())?;
    out.flush()
}

/// Prints one JSON object and a newline.
pub(crate) fn json(value: &impl Serialize) -> Result<()> {
    let mut line = serde_json::to_string_pretty(value)?;
    line.push('\n');
    text(&line)
}

/// Prints an error; nothing can be done when standard error is closed.
pub(crate) fn error(message: &str) {
    let _ = writeln!(std::io::stderr().lock(), "error: {}", printable(message));
}

/// Prints a warning.
pub(crate) fn warning(message: &str) {
    let _ = writeln!(std::io::stderr().lock(), "warning: {}", printable(message));
}
