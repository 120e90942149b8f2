//! Errors: messages, codes, and exit codes.

use serde_json::json;
use std::io::Write;
use std::path::PathBuf;
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
    /// A scene manifest that does not follow the format (exit code 3, or 4 when it could not be read).
    BadManifest(bth_scene::Error),
    /// A scene or model that could not be compiled (exit code 3, or 4 when it could not be read).
    Source { path: PathBuf, message: String, hint: String, exit: u8 },
    /// A picture of the surroundings that cannot be used (exit code 3) or read (exit code 4).
    Environment { path: PathBuf, message: String, exit: u8 },
    /// The picture could not be written (exit code 4).
    File { path: PathBuf, message: String },
    /// There is no window, or it stopped working (exit code 4).
    Window(String),
    /// Standard output was closed by its reader, which is no error.
    ClosedOutput,
}

impl From<std::io::Error> for Failure {
    /// Errors of standard output.
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::BrokenPipe => Self::ClosedOutput,
            _ => Self::File { path: "standard output".into(), message: error.to_string() },
        }
    }
}

impl From<bth::Error> for Failure {
    fn from(error: bth::Error) -> Self {
        Self::Runtime(error)
    }
}

impl From<bth_scene::Error> for Failure {
    fn from(error: bth_scene::Error) -> Self {
        Self::BadManifest(error)
    }
}

impl Failure {
    fn parts(&self) -> (&str, u8, String) {
        match self {
            Self::Usage(message) => ("BTH-U001", 2, format!("BTH-U001: {message}")),
            Self::Runtime(error) => (
                error.code().as_str(),
                if error.code() == bth::Code::Read { 4 } else { 3 },
                error.to_string(),
            ),
            Self::BadManifest(error) => {
                let exit = if error.code == bth_scene::error::code::READ { 4 } else { 3 };
                (error.code, exit, error.to_string())
            }
            Self::Source { path, message, hint, exit } => {
                ("BTH-P003", *exit, format!("{}: BTH-P003: {message} (hint: {hint})", path.display()))
            }
            Self::Environment { path, message, exit } => {
                let hint = "--env takes a picture in Radiance format (.hdr) over longitude and latitude; without it there is a sky";
                ("BTH-P006", *exit, format!("{}: BTH-P006: {message} (hint: {hint})", path.display()))
            }
            Self::Lacks { file, what, hint } => {
                ("BTH-P001", 3, format!("{}: BTH-P001: {what} (hint: {hint})", file.display()))
            }
            Self::File { path, message } => {
                ("BTH-P002", 4, format!("{}: BTH-P002: {message}", path.display()))
            }
            Self::Window(message) => {
                let hint = "a window needs a display (DISPLAY or WAYLAND_DISPLAY) and the libraries libX11, libXcursor, libXi and libxkbcommon-x11; -o writes pictures without";
                ("BTH-P004", 4, format!("BTH-P004: {message} (hint: {hint})"))
            }
            Self::ClosedOutput => ("", 0, String::new()),
        }
    }

    /// Prints the error, with `--json` as an object too, and returns the exit code.
    pub(crate) fn report(&self, wants_json: bool) -> ExitCode {
        let (code, exit_code, message) = self.parts();
        if exit_code != 0 {
            // Where the outputs are closed, the exit code is all that can be reported.
            let _ = writeln!(std::io::stderr().lock(), "error: {message}");
            if wants_json {
                let error = json!({"error": {"code": code, "message": message, "exit_code": exit_code}});
                let _ = writeln!(std::io::stdout().lock(), "{error:#}");
            }
        }
        ExitCode::from(exit_code)
    }
}

/// Reports a wrong command line, or shows help or the version.
pub(crate) fn usage(error: &clap::Error, wants_json: bool) -> ExitCode {
    // Where the output is closed, the exit code is all that can be reported.
    let _ = error.print();
    if !error.use_stderr() {
        return ExitCode::SUCCESS;
    }
    if wants_json {
        let text = error.to_string();
        let first = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let error = json!({"error": {"code": "BTH-U001", "message": first, "exit_code": 2}});
        let _ = writeln!(std::io::stdout().lock(), "{error:#}");
    }
    ExitCode::from(2)
}
