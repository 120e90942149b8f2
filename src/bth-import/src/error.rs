//! Errors of importing and compiling, each with a stable code, a place and a hint.

use std::path::PathBuf;

/// Result of functions that import or compile.
pub type Result<T> = std::result::Result<T, Error>;

/// A place in a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File(PathBuf),
    /// A line of a text file, from 1.
    Line(PathBuf, u64),
    /// A byte of a binary file, from 0.
    Byte(PathBuf, u64),
    /// A named part, such as a glTF accessor or node.
    Part(PathBuf, String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::File(p) => write!(f, "{}", p.display()),
            Place::Line(p, n) => write!(f, "{}:{n}", p.display()),
            Place::Byte(p, n) => write!(f, "{}: byte {n}", p.display()),
            Place::Part(p, s) => write!(f, "{}: {s}", p.display()),
        }
    }
}

/// An error of importing or compiling.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The source cannot be used; programs exit with code 3.
    #[error("{place}: {code}: {message}{}", hint_text(hint))]
    Input {
        /// Stable code, `BTH-I…`.
        code: &'static str,
        /// Where the fault is.
        place: Place,
        /// What was expected and what was found.
        message: String,
        /// What the user can do, or empty.
        hint: String,
    },
    /// A file could not be read or written; programs exit with code 4.
    #[error("{}: {code}: {message}", path.display())]
    File {
        /// Stable code, `BTH-O…`.
        code: &'static str,
        /// Which file.
        path: PathBuf,
        /// The error that the system reported.
        message: String,
    },
    /// The model exceeds a limit of the file format; programs exit with code 5.
    #[error("{code}: {message}")]
    Limit {
        /// Stable code, `BTH-L…`.
        code: &'static str,
        /// Which limit, and the model's figure.
        message: String,
    },
    /// The result failed the compiler's own checks, which is a defect of the compiler; programs exit with code 70.
    #[error("{code}: internal error: {message} (please report this)")]
    Internal {
        /// Stable code, `BTH-X…`.
        code: &'static str,
        /// What does not hold.
        message: String,
    },
    /// The user cancelled; programs exit with code 130.
    #[error("cancelled")]
    Cancelled,
}

fn hint_text(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!(" (hint: {hint})") }
}
