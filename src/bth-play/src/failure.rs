//! Errors: messages, codes, and exit codes.

use bth_files::Diagnosis;
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
    /// What `bthc` reported of a scene or model that it could not compile.
    Compiler(Box<Diagnosis>),
    /// A scene or model for which `bthc` could not be run (exit code 3).
    Source { path: PathBuf, message: String },
    /// A picture of the surroundings that cannot be used (exit code 3) or read (exit code 4).
    Environment { path: PathBuf, message: String, exit: u8 },
    /// A video that ffmpeg does not write (exit code 4).
    Video { path: PathBuf, message: String },
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
        self.diagnosis().map_or(Ok(()), |diagnosis| diagnosis.fmt(f))
    }
}

impl Failure {
    /// A file or folder that could not be written.
    pub(crate) fn file(path: &Path, message: &dyn Display) -> Self {
        Self::File { path: path.into(), message: message.to_string() }
    }

    /// The error as it is reported; `None` if it is not an error.
    fn diagnosis(&self) -> Option<Diagnosis> {
        let found = match self {
            Self::Usage(message) => Diagnosis::usage(message).with_hint("see bth-play --help"),
            Self::Runtime(error) => error.into(),
            Self::Compiler(diagnosis) => (**diagnosis).clone(),
            Self::Source { path, message } => {
                let name = path.to_string_lossy();
                let quote = if name.contains(char::is_whitespace) { "\"" } else { "" };
                let hint =
                    format!("run: bthc compile {quote}{name}{quote} -o scene.bth, then play scene.bth");
                Diagnosis::new(3, "BTH-P003", message).at(path).with_hint(&hint)
            }
            Self::Environment { path, message, exit } => {
                Diagnosis::new(*exit, "BTH-P006", message).at(path).with_hint(
                    "--env takes a picture in Radiance format (.hdr) over longitude and latitude; \
                     without it there is a sky",
                )
            }
            Self::Lacks { file, what, hint } => Diagnosis::new(3, "BTH-P001", *what).at(file).with_hint(hint),
            Self::Video { path, message } => Diagnosis::new(4, "BTH-P007", message)
                .at(path)
                .with_hint("install ffmpeg with libx264, or write .apng, .gif, .y4m or numbered pictures"),
            Self::File { path, message } => Diagnosis::new(4, "BTH-P002", message)
                .at(path)
                .with_hint("name a place where files can be written and that has room"),
            Self::Window(message) => Diagnosis::new(4, "BTH-P004", message).with_hint(
                "a window needs a display (DISPLAY or WAYLAND_DISPLAY) and the libraries libX11, \
                 libXcursor, libXi and libxkbcommon-x11; -o writes pictures without",
            ),
            Self::Threads(message) => Diagnosis::new(5, "BTH-L090", message).with_hint(
                "ask for fewer threads (--threads), or let the user have more processes (ulimit -u) \
                 and memory",
            ),
            Self::Panic(message) => {
                Diagnosis::new(70, "BTH-X090", format!("internal error: panicked: {message}"))
                    .with_hint("please report this")
            }
            Self::ClosedOutput => return None,
        };
        Some(found)
    }

    /// Prints the error, with `--json` as an object too, and returns the exit code.
    pub(crate) fn report(&self, wants_json: bool) -> ExitCode {
        self.diagnosis().map_or(ExitCode::SUCCESS, |diagnosis| diagnosis.report(wants_json))
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

/// Reports a wrong command line, or shows help or the version.
pub(crate) fn usage(error: &clap::Error, wants_json: bool) -> ExitCode {
    let printed = error.print().and_then(|()| std::io::stdout().flush());
    if !error.use_stderr() {
        return printed.map_or_else(|e| Failure::from(e).report(wants_json), |()| ExitCode::SUCCESS);
    }
    // Where standard error is closed, the exit code is all that can be reported.
    if wants_json {
        Diagnosis::of_usage(&error.to_string()).print_json();
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
            let diagnosis = failure.diagnosis().unwrap();
            assert_eq!((diagnosis.code.as_str(), diagnosis.exit_code), ("BTH-X090", 70));
            let expected =
                format!("BTH-X090: internal error: panicked: {message} (hint: please report this)");
            assert_eq!(failure.to_string(), expected);
        }
        assert!(without_panic(|| Ok(())).is_ok());
    }
}
