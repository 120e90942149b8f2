//! Errors of importing and compiling, each with a stable code, a place and a hint.

use std::path::{Path, PathBuf};

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
    #[error("{}: {code}: {message}{}", path.display(), hint_text(file_hint(code)))]
    File {
        /// Stable code, `BTH-O…`.
        code: &'static str,
        /// Which file.
        path: PathBuf,
        /// The error that the system reported.
        message: String,
    },
    /// The model exceeds a limit of the file format; programs exit with code 5.
    #[error("{code}: {message}{}", hint_text(limit_hint(code)))]
    Limit {
        /// Stable code, `BTH-L…`.
        code: &'static str,
        /// Which limit, and the model's figure.
        message: String,
    },
    /// The result failed the compiler's own checks, which is a defect of the compiler; programs
    /// exit with code 70.
    #[error("{code}: internal error: {message}{}", hint_text(DEFECT))]
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

/// The hint for a defect of the compiler.
const DEFECT: &str = "please report this";

impl Error {
    /// With the name of the model in the text, where there is no place that has it.
    pub(crate) fn of_model(self, name: &Path) -> Self {
        match self {
            Error::Limit { code, message } => {
                Error::Limit { code, message: format!("{}: {message}", name.display()) }
            }
            other => other,
        }
    }

    /// What the user can do; empty for cancellation.
    pub fn hint(&self) -> &str {
        match self {
            Error::Input { hint, .. } => hint,
            Error::File { code, .. } => file_hint(code),
            Error::Limit { code, .. } => limit_hint(code),
            Error::Internal { .. } => DEFECT,
            Error::Cancelled => "",
        }
    }
}

impl From<&Error> for bth_files::Diagnosis {
    fn from(error: &Error) -> Self {
        let diagnosis = match error {
            Error::Input { code, place, message, .. } => {
                Self { place: Some(place.to_string()), ..Self::new(3, code, message) }
            }
            Error::File { code, path, message } => Self::new(4, code, message).at(path),
            // Options that exclude each other.
            Error::Limit { code: code @ "BTH-L033", message } => Self::new(2, code, message),
            Error::Limit { code, message } => Self::new(5, code, message),
            Error::Internal { code, message } => Self::new(70, code, format!("internal error: {message}")),
            Error::Cancelled => Self::new(130, "BTH-C000", "cancelled"),
        };
        diagnosis.with_hint(error.hint())
    }
}

/// The text of an error or a warning for callers of a library: it names options of `bthc` as
/// arguments, `max_error` for `--max-error`.
pub fn for_callers(text: &str) -> String {
    // Paths come before the code, and stay as they are.
    let (place, message) = text.split_at(text.find("BTH-").unwrap_or(0));
    let mut parts = message.split("--");
    let mut changed = format!("{place}{}", parts.next().unwrap_or_default());
    for part in parts {
        if part.starts_with(|c: char| c.is_ascii_lowercase()) && changed.ends_with([' ', '(']) {
            let end = part.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(part.len());
            changed.push_str(&part[..end].replace('-', "_"));
            changed.push_str(&part[end..]);
        } else {
            changed.push_str("--");
            changed.push_str(part);
        }
    }
    changed
}

/// The hint for a file that cannot be read or written.
fn file_hint(code: &str) -> &'static str {
    match code {
        "BTH-O002" => "compile again when the file is complete",
        "BTH-O020" => "name a folder that is there and may be written, on a disk that has room",
        "BTH-O061" => "let the cache have room (--cache-size, --cache-dir), or name an output",
        "BTH-O062" => "pipe a model into the program, and let the folder for temporary files have room",
        "BTH-O063" => "name a folder that may be written, with --cache-dir or BTH_CACHE_DIR",
        "BTH-O091" => "send the output to where there is room",
        _ => "check the path and its permissions",
    }
}

/// The hint for what exceeds a limit.
fn limit_hint(code: &str) -> &'static str {
    match code {
        "BTH-L003" => {
            "make the image smaller, or compile with --lenient-materials or without --materials and --alpha"
        }
        "BTH-L004" => "leave out frames, or make several sequences of them",
        "BTH-L020" => "compile with --structure bvh, without tetrahedra",
        "BTH-L032" => "divide the scene into several with fewer objects",
        "BTH-L033" => "leave out one of these options",
        "BTH-L034" => {
            "free memory or raise its limit (ulimit -v), compile with --quality fast, or divide the model into several objects of a scene"
        }
        "BTH-L050" => "shorten the names, or divide the scene into several",
        "BTH-L090" => {
            "ask for fewer threads (bthc: --threads), or let the user have more processes (ulimit -u) and memory"
        }
        _ => "divide the model into several objects of a scene",
    }
}

fn hint_text(hint: &str) -> String {
    if hint.is_empty() { String::new() } else { format!(" (hint: {hint})") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn callers_read_of_arguments() {
        let text = "a --b-c.obj: BTH-I080: no (hint: use --structure bth, or --max-error; -- x--y --9)";
        let expected = "a --b-c.obj: BTH-I080: no (hint: use structure bth, or max_error; -- x--y --9)";
        assert_eq!(for_callers(text), expected);
        assert_eq!(for_callers("Compile with --polygons ears"), "Compile with polygons ears");
    }

    #[test]
    fn errors_of_files_and_limits_end_with_a_hint() {
        let message = || "what is wrong".to_owned();
        for code in ["BTH-O001", "BTH-O020", "BTH-O061", "BTH-O062", "BTH-O063", "BTH-O090", "BTH-O091"] {
            let error = Error::File { code, path: "a.obj".into(), message: message() };
            assert_eq!(error.to_string(), format!("a.obj: {code}: what is wrong (hint: {})", error.hint()));
            assert!(!error.hint().is_empty());
        }
        for code in ["BTH-L001", "BTH-L003", "BTH-L033", "BTH-L090", "BTH-L202"] {
            let error = Error::Limit { code, message: message() };
            assert_eq!(error.to_string(), format!("{code}: what is wrong (hint: {})", error.hint()));
            assert!(!error.hint().is_empty());
        }
    }
}
