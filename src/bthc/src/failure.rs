//! Why a command did not succeed.

use crate::output;
use bth_files::Diagnosis;
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
    /// For errors of standard output; [`Failure::file`] is for files.
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

    /// The error as it is reported; `None` if nothing is left to report.
    pub(crate) fn diagnosis(&self) -> Option<Diagnosis> {
        match self {
            Self::Compile(error) => Some(error.into()),
            Self::Runtime(error) => Some(error.into()),
            Self::Manifest(error) => Some(error.into()),
            Self::Usage { message, hint } => Some(Diagnosis::usage(message).with_hint(hint)),
            Self::Check | Self::Reported(_) | Self::ClosedOutput => None,
        }
    }

    pub(crate) fn exit_code(&self) -> u8 {
        match self {
            Self::Check => 1,
            Self::Reported(code) => *code,
            _ => self.diagnosis().map_or(0, |diagnosis| diagnosis.exit_code),
        }
    }

    /// Prints the error, with `--json` as an object too, and returns the exit code.
    pub(crate) fn report(&self, wants_json: bool) -> ExitCode {
        match self.diagnosis() {
            Some(diagnosis) => {
                output::fail();
                diagnosis.report(wants_json)
            }
            None => ExitCode::from(self.exit_code()),
        }
    }

    /// Prints the error on standard error.
    pub(crate) fn print(&self) {
        if let Some(diagnosis) = self.diagnosis() {
            diagnosis.print();
        }
    }
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
