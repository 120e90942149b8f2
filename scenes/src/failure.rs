//! The errors of the program: a message on standard error and an exit code, never a backtrace.

use bth_scenes::write;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Exit codes, as the help lists them.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    2  wrong usage
    4  a file or folder could not be written";

/// Why a command did not succeed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Arguments that cannot be used (exit code 2).
    Usage { message: String, hint: String },
    /// A file or folder that could not be written (exit code 4).
    File { path: PathBuf, source: std::io::Error },
    /// Standard output was closed by its reader (`bth-scenes list | head`), which is no error.
    ClosedOutput,
}

impl From<std::io::Error> for Failure {
    /// Converts errors of standard output; [`Failure::file`] makes errors of files.
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            ErrorKind::BrokenPipe => Self::ClosedOutput,
            _ => Self::file(Path::new("standard output"), error),
        }
    }
}

impl From<write::Error> for Failure {
    fn from(error: write::Error) -> Self {
        match error {
            write::Error::Write { path, source } => Self::File { path, source },
            write::Error::Extension(path) => {
                let message = format!(
                    "expected an output that ends with .obj, .ply or .stl, found {:?}",
                    path.display().to_string()
                );
                Self::Usage { message, hint: "the extension chooses the format".to_owned() }
            }
        }
    }
}

impl Failure {
    /// A file or folder that could not be written.
    pub(crate) fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File { path: path.into(), source }
    }

    /// Prints the error and returns the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        let (exit_code, message) = match self {
            Self::Usage { message, hint } => (2, format!("BTH-U001: {message} (hint: {hint})")),
            Self::File { path, source } => {
                let hint = "name a folder that is there and may be written, on a disk that has room";
                (4, format!("{}: BTH-O020: cannot write: {source} (hint: {hint})", path.display()))
            }
            Self::ClosedOutput => return ExitCode::SUCCESS,
        };
        // Where standard error is closed, the exit code is all that can be reported.
        let _ = writeln!(std::io::stderr().lock(), "error: {message}");
        ExitCode::from(exit_code)
    }
}
