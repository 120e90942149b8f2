//! Standard output and standard error.

use bth_files::printable;
use serde::Serialize;
use std::io::{Result, StdoutLock, Write};
use std::sync::atomic::{AtomicU8, Ordering};

/// What was printed, and by whom: one of the numbers below.
static STATE: AtomicU8 = AtomicU8::new(SILENT);
/// Nothing was printed on standard output.
const SILENT: u8 = 0;
/// Something was printed on standard output, or is being printed.
const BEGUN: u8 = 1;
/// The error that ends the program is being reported.
const FAILING: u8 = 2;
/// A signal ends the program: only its thread prints.
const INTERRUPTED: u8 = 3;

/// Notes what is going to be printed. Where a signal ends the program, waits for the end.
fn enter(state: u8) {
    let entered = STATE.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |before| match before {
        INTERRUPTED => None,
        _ => Some(before.max(state)),
    });
    while entered.is_err() {
        std::thread::park();
    }
}

/// Notes that the error is going to be reported that ends the program.
pub(crate) fn fail() {
    enter(FAILING);
}

/// What the handler of a signal finds that ends the program.
pub(crate) enum Interrupted {
    /// Nothing was printed, and nothing but its error will be.
    Silent,
    /// Output has begun. Who prints may wait for a reader.
    Begun,
    /// Another thread reports an error and then ends the program.
    Failing,
}

/// Notes that a signal ends the program.
pub(crate) fn interrupt() -> Interrupted {
    match STATE.compare_exchange(SILENT, INTERRUPTED, Ordering::Relaxed, Ordering::Relaxed) {
        Ok(_) => Interrupted::Silent,
        Err(FAILING) => Interrupted::Failing,
        Err(_) => Interrupted::Begun,
    }
}

/// Standard output, locked.
pub(crate) fn stdout() -> StdoutLock<'static> {
    enter(BEGUN);
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
