//! An error as programs report it: one line of text, one JSON object, one exit code.

use crate::printable;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Why a program did not succeed. Fields that are not known are empty or `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Diagnosis {
    /// Stable code, such as `BTH-I001`.
    pub code: String,
    /// The file, and what of it, as people read it.
    pub place: Option<String>,
    /// Line, from 1.
    pub line: Option<u64>,
    /// Column in characters, from 1.
    pub column: Option<u64>,
    /// Byte, from 0.
    pub byte: Option<u64>,
    /// What is wrong.
    pub message: String,
    /// What was expected.
    pub expected: Option<String>,
    /// What was found.
    pub found: Option<String>,
    /// What the user can do.
    pub hint: Option<String>,
    /// Exit code of the program.
    pub exit_code: u8,
}

impl Diagnosis {
    /// An error with a message.
    #[must_use]
    pub fn new(exit_code: u8, code: &str, message: impl Into<String>) -> Self {
        Self { code: code.into(), message: message.into(), exit_code, ..Self::default() }
    }

    /// Wrong usage of a program: `BTH-U001`, exit code 2.
    #[must_use]
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(2, "BTH-U001", message)
    }

    /// What a parser of command lines says: the first line of its message.
    #[must_use]
    pub fn of_usage(text: &str) -> Self {
        Self::usage(text.lines().next().unwrap_or_default().trim_start_matches("error: "))
    }

    /// With the file that the error is about.
    #[must_use]
    pub fn at(self, path: &Path) -> Self {
        Self { place: Some(path.to_string_lossy().into_owned()), ..self }
    }

    /// With what the user can do, unless that is empty.
    #[must_use]
    pub fn with_hint(self, hint: &str) -> Self {
        Self { hint: (!hint.is_empty()).then(|| hint.to_owned()), ..self }
    }

    /// Prints a line on standard error. Nothing can be done where that is closed.
    pub fn print(&self) {
        let _ = writeln!(std::io::stderr().lock(), "error: {}", printable(&self.to_string()));
    }

    /// Prints the error, on standard output too as `{"error": …}` if that is asked for.
    pub fn report(&self, wants_json: bool) -> ExitCode {
        self.print();
        if wants_json {
            self.print_json();
        }
        ExitCode::from(self.exit_code)
    }

    /// Prints `{"error": …}`. Where standard output is closed, the exit code says enough.
    pub fn print_json(&self) {
        let object = std::collections::BTreeMap::from([("error", self)]);
        let text = serde_json::to_string_pretty(&object).unwrap_or_default();
        let _ = writeln!(std::io::stdout().lock(), "{text}");
    }
}

impl std::fmt::Display for Diagnosis {
    /// Place, code, message, hint. Messages of the runtime library have all of these already.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.message.contains(&self.code) {
            return f.write_str(&self.message);
        }
        if let Some(place) = &self.place {
            f.write_str(place)?;
            for number in [self.line, self.column].into_iter().flatten() {
                write!(f, ":{number}")?;
            }
            f.write_str(": ")?;
        }
        write!(f, "{}: {}", self.code, self.message)?;
        self.hint.as_ref().map_or(Ok(()), |hint| write!(f, " (hint: {hint})"))
    }
}

impl From<&bth_format::Error> for Diagnosis {
    /// Exit code 5 for a lack of memory, 4 for a file that cannot be read, else 3.
    fn from(error: &bth_format::Error) -> Self {
        let known = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        let exit_code = match error.code() {
            _ if error.is_of_memory() => 5,
            bth_format::Code::Read => 4,
            _ => 3,
        };
        Self {
            place: error.path().map(|path| path.to_string_lossy().into_owned()),
            byte: error.offset(),
            expected: known(error.expected()),
            found: known(error.found()),
            ..Self::new(exit_code, error.code().as_str(), error.to_string()).with_hint(error.hint())
        }
    }
}
