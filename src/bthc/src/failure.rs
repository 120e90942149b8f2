//! Errors: exit codes, messages, and JSON for `--json`.

use crate::output;
use serde_json::json;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

/// Why a command did not succeed.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The compiler's own errors.
    Compile(bth_compile::Error),
    /// The runtime's errors: a compiled file that cannot be used.
    Runtime(bth::Error),
    /// A scene manifest that cannot be used (exit code 3, or 4 when it could not be read).
    Manifest(bth_scene::Error),
    /// Arguments that do not fit together (exit code 2).
    Usage { message: String, hint: &'static str },
    /// Jobs failed whose errors are printed already; the exit code of the first.
    Reported(u8),
    /// A check failed; the findings are printed already.
    Check,
    /// Standard output was closed by its reader (`bthc ... | head`), which is no error.
    ClosedOutput,
}

impl From<bth_compile::Error> for Failure {
    fn from(error: bth_compile::Error) -> Self {
        Self::Compile(error)
    }
}

impl From<std::io::Error> for Failure {
    /// Errors of standard output; those of files are made with [`Failure::file`].
    fn from(error: std::io::Error) -> Self {
        if error.kind() == std::io::ErrorKind::BrokenPipe {
            Self::ClosedOutput
        } else {
            Self::file("BTH-O091", Path::new("standard output"), &error)
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
        Self::Manifest(error)
    }
}

impl Failure {
    /// A file that could not be read or written.
    pub(crate) fn file(code: &'static str, path: &Path, message: &dyn std::fmt::Display) -> Self {
        Self::Compile(bth_compile::Error::File { code, path: path.into(), message: message.to_string() })
    }
    /// An instruction set that cannot be used, named on the command line or by the environment.
    pub(crate) fn isa(error: &bth::IsaError, in_environment: bool) -> Self {
        let hint = match in_environment {
            true => "unset BTH_ISA, or see `bthc info --cpu`",
            false => "leave --isa out, or see `bthc info --cpu`",
        };
        Self::Usage { message: error.to_string(), hint }
    }
    /// A ray file that cannot be used.
    pub(crate) fn ray_file(path: &Path, byte: u64, message: String, hint: &str) -> Self {
        Self::Compile(bth_compile::Error::Input {
            code: "BTH-I090",
            place: bth_compile::error::Place::Byte(path.into(), byte),
            message,
            hint: hint.into(),
        })
    }

    /// With another name of a file in the place of the error.
    pub(crate) fn with_name(mut self, file: &Path, name: &Path) -> Self {
        use bth_compile::Error;
        use bth_compile::error::Place;
        let path = match &mut self {
            Self::Compile(Error::File { path, .. }) => path,
            Self::Compile(Error::Input { place, .. }) => match place {
                Place::File(path) | Place::Line(path, _) | Place::Byte(path, _) | Place::Part(path, _) => {
                    path
                }
            },
            _ => return self,
        };
        if path == file {
            name.clone_into(path);
        }
        self
    }

    pub(crate) fn exit_code(&self) -> u8 {
        use bth_compile::Error;
        match self {
            Self::Check => 1,
            Self::Reported(code) => *code,
            // Options that exclude each other.
            Self::Usage { .. } | Self::Compile(Error::Limit { code: "BTH-L033", .. }) => 2,
            Self::Compile(Error::Input { .. }) => 3,
            Self::Compile(Error::File { .. }) => 4,
            Self::Compile(Error::Limit { .. }) => 5,
            Self::Compile(Error::Internal { .. }) => 70,
            Self::Compile(Error::Cancelled) => 130,
            Self::Runtime(error) if error.code() == bth::Code::Read => 4,
            Self::Runtime(_) => 3,
            Self::Manifest(error) if error.code == bth_scene::error::code::READ => 4,
            Self::Manifest(_) => 3,
            Self::ClosedOutput => 0,
        }
    }

    /// The error as JSON: `code`, `message`, and where known `place` and `hint`.
    pub(crate) fn json(&self) -> serde_json::Value {
        match self {
            Self::Compile(error) => compile_json(error),
            Self::Runtime(error) => runtime_json(error),
            Self::Manifest(error) => {
                let known = |number: usize| (number > 0).then_some(number);
                json!({"code": error.code, "place": error.path.to_string_lossy(), "line": known(error.line),
                    "column": known(error.column), "message": error.message, "hint": error.hint})
            }
            Self::Usage { message, hint } => json!({"code": "BTH-U001", "message": message, "hint": hint}),
            Self::Check | Self::Reported(_) | Self::ClosedOutput => serde_json::Value::Null,
        }
    }

    /// As [`Self::json`], with `exit_code`: what stands at `error` with `--json`.
    pub(crate) fn json_with_exit_code(&self) -> serde_json::Value {
        let mut error = self.json();
        error["exit_code"] = self.exit_code().into();
        error
    }

    /// Prints the error, with `--json` as an object too, and returns the exit code.
    pub(crate) fn report(&self, wants_json: bool) -> ExitCode {
        if !matches!(self, Self::Check | Self::Reported(_) | Self::ClosedOutput) {
            self.print();
            if wants_json {
                print_json_error(self.json_with_exit_code());
            }
        }
        ExitCode::from(self.exit_code())
    }

    /// Prints the error on standard error.
    pub(crate) fn print(&self) {
        let text = match self {
            Self::Check | Self::Reported(_) | Self::ClosedOutput => return,
            Self::Compile(error) => error.to_string(),
            Self::Runtime(error) => error.to_string(),
            Self::Manifest(error) => error.to_string(),
            Self::Usage { message, hint } => format!("BTH-U001: {message} (hint: {hint})"),
        };
        output::error(&text);
    }
}

/// An error of the compiler as JSON.
fn compile_json(error: &bth_compile::Error) -> serde_json::Value {
    use bth_compile::Error;
    match error {
        Error::Input { code, place, message, hint } => {
            json!({"code": code, "place": place.to_string(), "message": message, "hint": hint})
        }
        Error::File { code, path, message } => json!({"code": code, "place": path.to_string_lossy(),
            "message": message, "hint": error.hint()}),
        Error::Limit { code, message } => json!({"code": code, "message": message, "hint": error.hint()}),
        Error::Internal { code, message } => json!({"code": code, "message": message}),
        Error::Cancelled => json!({"code": "BTH-C000", "message": "cancelled"}),
    }
}

/// An error of the runtime as JSON.
pub(crate) fn runtime_json(error: &bth::Error) -> serde_json::Value {
    json!({
        "code": error.code().as_str(),
        "place": error.path().map(|p| p.to_string_lossy()),
        "byte": error.offset(),
        "message": error.to_string(),
        "expected": error.expected(),
        "found": error.found(),
        "hint": error.hint(),
    })
}

fn print_json_error(error: serde_json::Value) {
    // Where standard output is closed, the exit code is all that can be reported.
    let _ = output::json(&json!({ "error": error }));
}

/// Reports a wrong command line, or shows help or the version.
pub(crate) fn usage(error: &clap::Error, wants_json: bool) -> ExitCode {
    let printed = error.print().and_then(|()| std::io::stdout().flush());
    if !error.use_stderr() {
        return printed.map_or_else(|e| Failure::from(e).report(wants_json), |()| ExitCode::SUCCESS);
    }
    // Where standard error is closed, the exit code is all that can be reported.
    if wants_json {
        let first =
            error.to_string().lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned();
        print_json_error(json!({"code": "BTH-U001", "message": first, "exit_code": 2}));
    }
    ExitCode::from(2)
}
