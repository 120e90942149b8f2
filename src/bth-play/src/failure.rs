//! Errors: messages, codes, and exit codes.

use bth_files::printable;
use serde_json::{Value, json};
use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Why there is no picture.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Options that do not fit together (exit code 2).
    Usage(String),
    /// A compiled file that cannot be used (exit code 3, or 4 when it could not be read).
    Runtime(bth::Error),
    /// A compiled file that lacks what the mode needs (exit code 3).
    Lacks { file: PathBuf, what: &'static str, hint: &'static str },
    /// What `bthc` reported as JSON of a scene or model that it could not compile, and its exit code.
    Compiler { error: Value, exit: u8 },
    /// A scene or model for which `bthc` could not be run (exit code 3).
    Source { path: PathBuf, message: String },
    /// A picture of the surroundings that cannot be used (exit code 3) or read (exit code 4).
    Environment { path: PathBuf, message: String, exit: u8 },
    /// The picture could not be written (exit code 4).
    File { path: PathBuf, message: String },
    /// There is no window, or it stopped working (exit code 4).
    Window(String),
    /// The system starts no more threads (exit code 5).
    Threads(String),
    /// The program panicked, which is a defect of it (exit code 70).
    Panic(String),
    /// Standard output was closed by its reader, which is no error.
    ClosedOutput,
}

impl From<std::io::Error> for Failure {
    /// Errors of standard output.
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::BrokenPipe => Self::ClosedOutput,
            _ => Self::file(Path::new("standard output"), &error),
        }
    }
}

impl From<bth::Error> for Failure {
    fn from(error: bth::Error) -> Self {
        Self::Runtime(error)
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.json().map_or(Ok(()), |(error, _)| f.write_str(&text_of(&error)))
    }
}

impl Failure {
    /// A file or folder that could not be written.
    pub(crate) fn file(path: &Path, message: &dyn Display) -> Self {
        Self::File { path: path.into(), message: message.to_string() }
    }

    /// The error as JSON, with `code`, `message` and where known `place` and `hint`, as those of `bthc`; and the exit code. `None` if it is no
    /// error.
    fn json(&self) -> Option<(Value, u8)> {
        let found = match self {
            Self::Usage(message) => {
                (json!({"code": "BTH-U001", "message": message, "hint": "see bth-play --help"}), 2)
            }
            Self::Runtime(error) => {
                let error_json = json!({
                    "code": error.code().as_str(),
                    "place": error.path().map(|p| p.to_string_lossy()),
                    "byte": error.offset(),
                    "message": error.to_string(),
                    "expected": error.expected(),
                    "found": error.found(),
                    "hint": error.hint(),
                });
                (error_json, if error.code() == bth::Code::Read { 4 } else { 3 })
            }
            Self::Compiler { error, exit } => (error.clone(), *exit),
            Self::Source { path, message } => {
                let name = path.to_string_lossy();
                let quote = if name.contains(char::is_whitespace) { "\"" } else { "" };
                let hint =
                    format!("run: bthc compile {quote}{name}{quote} -o scene.bth, then play scene.bth");
                (located("BTH-P003", path, message, &hint), 3)
            }
            Self::Environment { path, message, exit } => {
                let hint = "--env takes a picture in Radiance format (.hdr) over longitude and latitude; without it there is a sky";
                (located("BTH-P006", path, message, hint), *exit)
            }
            Self::Lacks { file, what, hint } => (located("BTH-P001", file, what, hint), 3),
            Self::File { path, message } => {
                let hint = "name a place where files can be written and that has room";
                (located("BTH-P002", path, message, hint), 4)
            }
            Self::Window(message) => {
                let hint = "a window needs a display (DISPLAY or WAYLAND_DISPLAY) and the libraries libX11, libXcursor, libXi and libxkbcommon-x11; -o writes pictures without";
                (json!({"code": "BTH-P004", "message": message, "hint": hint}), 4)
            }
            Self::Threads(message) => {
                let hint = "ask for fewer threads (--threads), or let the user have more processes (ulimit -u) and memory";
                (json!({"code": "BTH-L090", "message": message, "hint": hint}), 5)
            }
            Self::Panic(message) => {
                let message = format!("internal error: panicked: {message}");
                (json!({"code": "BTH-X090", "message": message, "hint": "please report this"}), 70)
            }
            Self::ClosedOutput => return None,
        };
        Some(found)
    }

    /// Prints the error, with `--json` as an object too, and returns the exit code.
    pub(crate) fn report(&self, wants_json: bool) -> ExitCode {
        let Some((mut error, exit_code)) = self.json() else { return ExitCode::SUCCESS };
        // Where the outputs are closed, the exit code is all that can be reported.
        let _ = writeln!(std::io::stderr().lock(), "error: {}", printable(&text_of(&error)));
        if wants_json {
            error["exit_code"] = exit_code.into();
            let _ = writeln!(std::io::stdout().lock(), "{:#}", json!({ "error": error }));
        }
        ExitCode::from(exit_code)
    }
}

/// Does `work`, and makes a panic in it an error.
pub(crate) fn without_panic(work: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    // What the panic leaves behind is only removed.
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        // The message was printed when it was raised.
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        Err(Failure::Panic(text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_default()))
    })
}

fn located(code: &str, path: &Path, message: &str, hint: &str) -> Value {
    json!({"code": code, "place": path.to_string_lossy(), "message": message, "hint": hint})
}

/// An error as a line of text: place, code, message and hint.
pub(crate) fn text_of(error: &Value) -> String {
    let field = |name: &str| error[name].as_str().unwrap_or_default();
    let (code, message) = (field("code"), field("message"));
    // The messages of the runtime name everything.
    if message.contains(code) {
        return message.to_owned();
    }
    let mut text = String::new();
    if !field("place").is_empty() {
        text += field("place");
        for part in [&error["line"], &error["column"]].iter().filter_map(|part| part.as_u64()) {
            text += &format!(":{part}");
        }
        text += ": ";
    }
    text += &format!("{code}: {message}");
    if !field("hint").is_empty() {
        text += &format!(" (hint: {})", field("hint"));
    }
    text
}

/// Reports a wrong command line, or shows help or the version.
pub(crate) fn usage(error: &clap::Error, wants_json: bool) -> ExitCode {
    let printed = error.print().and_then(|()| std::io::stdout().flush());
    if !error.use_stderr() {
        return printed.map_or_else(|e| Failure::from(e).report(wants_json), |()| ExitCode::SUCCESS);
    }
    // Where standard error is closed, the exit code is all that can be reported.
    if wants_json {
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let error = json!({"error": {"code": "BTH-U001", "message": first, "exit_code": 2}});
        let _ = writeln!(std::io::stdout().lock(), "{error:#}");
    }
    ExitCode::from(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_internal_error() {
        let number = 7;
        for (panicked, message) in [
            (without_panic(|| panic!("no {number}")), "no 7"),
            (without_panic(|| panic!("constant")), "constant"),
            (without_panic(|| std::panic::panic_any(number)), ""),
        ] {
            let failure = panicked.unwrap_err();
            let (error, exit) = failure.json().unwrap();
            assert_eq!((error["code"].as_str(), exit), (Some("BTH-X090"), 70));
            let expected =
                format!("BTH-X090: internal error: panicked: {message} (hint: please report this)");
            assert_eq!(failure.to_string(), expected);
        }
        assert!(without_panic(|| Ok(())).is_ok());
    }
}
