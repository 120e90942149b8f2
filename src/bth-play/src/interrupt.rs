//! Ctrl-C, SIGTERM and SIGHUP end the program, and no part of a file that is being written stays.

use crate::failure::Failure;
use bth_files::signals;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Exit code of a program that was cancelled.
const CANCELLED: i32 = 130;

/// The temporary files that are being written, and temporary folders.
static PARTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn parts() -> MutexGuard<'static, Vec<PathBuf>> {
    PARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens for Ctrl-C and the signals that are like it from now on. With `json` the end is reported
/// on standard output.
///
/// # Errors
/// `BTH-L090` if the thread that waits for signals cannot be started.
pub(crate) fn listen(json: bool) -> Result<(), Failure> {
    let end = move || {
        // Kept locked, so that no other file begins.
        let parts = parts();
        parts.iter().for_each(|part| remove(part));
        if json {
            let error =
                serde_json::json!({"code": "BTH-C000", "message": "cancelled", "exit_code": CANCELLED});
            // Where standard output is closed, the exit code is all that can be reported.
            let _ = crate::messages::print(&format!("{}\n", serde_json::json!({ "error": error })));
        }
        std::process::exit(CANCELLED);
    };
    match signals::install(|| ctrlc::set_handler(end)) {
        // Nothing would end the program, since the signals are taken over already.
        Err(ctrlc::Error::System(e)) => {
            Err(Failure::Threads(format!("cannot start a thread that waits for signals: {e}")))
        }
        // Else it fails only when a handler is there already, and then Ctrl-C ends the program
        // anyway.
        _ => Ok(()),
    }
}

fn remove(part: &Path) {
    // What cannot be removed stays; there is nobody to tell.
    let _ = match part.is_dir() {
        true => std::fs::remove_dir_all(part),
        false => std::fs::remove_file(part),
    };
}

/// A temporary file or folder that is removed when the program is interrupted while this lives.
pub(crate) struct Part(PathBuf);

impl Part {
    pub(crate) fn new(path: &Path) -> Self {
        parts().push(path.to_owned());
        Part(path.to_owned())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        parts().retain(|part| *part != self.0);
    }
}
