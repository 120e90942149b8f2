//! Progress on a terminal; silent in a pipe.

use std::io::{IsTerminal, Write};

/// Replaces the line that names the current step; an empty text clears it.
pub(crate) fn show(what: impl AsRef<str>) {
    let mut to = std::io::stderr().lock();
    if to.is_terminal() {
        // Nothing can be done when standard error is closed.
        let _ = write!(to, "\r\x1b[K{}", what.as_ref()).and_then(|()| to.flush());
    }
}
