//! Errors of manifests, each with a stable code, a place and a hint.

use std::path::PathBuf;

/// Result of reading a manifest.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a manifest cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}: {code}: {message} (hint: {hint})", self.place())]
pub struct Error {
    /// Stable code, one of [`code`].
    pub code: &'static str,
    /// The manifest.
    pub path: PathBuf,
    /// Line, from 1; 0 for an error of the file as a whole.
    pub line: usize,
    /// Column in characters, from 1; 0 with line 0.
    pub column: usize,
    /// What was expected and what was found.
    pub message: String,
    /// How to correct it.
    pub hint: String,
}

impl Error {
    /// The manifest, with line and column where they are known.
    pub fn place(&self) -> String {
        match (self.path.display(), self.line) {
            (path, 0) => path.to_string(),
            (path, line) => format!("{path}:{line}:{}", self.column),
        }
    }
}

impl From<&Error> for bth_files::Diagnosis {
    /// Exit code 4 for a manifest that cannot be read, else 3.
    fn from(error: &Error) -> Self {
        let known = |number: usize| (number > 0).then_some(number as u64);
        let exit_code = if error.code == code::READ { 4 } else { 3 };
        let diagnosis = Self::new(exit_code, error.code, &error.message).at(&error.path);
        Self { line: known(error.line), column: known(error.column), ..diagnosis.with_hint(&error.hint) }
    }
}

/// The codes of [`Error`]; their meanings never change.
pub mod code {
    /// The file cannot be read.
    pub const READ: &str = "BTH-M001";
    /// It is not TOML, or not UTF-8.
    pub const SYNTAX: &str = "BTH-M002";
    /// A key that the format does not have.
    pub const UNKNOWN_KEY: &str = "BTH-M003";
    /// A value of another type.
    pub const TYPE: &str = "BTH-M004";
    /// A value that the format does not allow.
    pub const VALUE: &str = "BTH-M005";
    /// A required key is missing.
    pub const MISSING_KEY: &str = "BTH-M006";
    /// A manifest of another version.
    pub const VERSION: &str = "BTH-M007";
    /// A name that is empty or used twice.
    pub const NAME: &str = "BTH-M008";
    /// A reference to a name that does not exist.
    pub const REFERENCE: &str = "BTH-M009";
    /// A node that is its own ancestor.
    pub const CYCLE: &str = "BTH-M010";
    /// A path that leaves the manifest's folder.
    pub const PATH: &str = "BTH-M011";
    /// Times or values of a track that do not fit together.
    pub const TRACK: &str = "BTH-M012";
    /// Two keys that exclude each other.
    pub const CONFLICT: &str = "BTH-M013";
}
