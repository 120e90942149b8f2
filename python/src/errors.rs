//! Exceptions.

use bth_compile::error::for_callers;
use pyo3::create_exception;
use pyo3::exceptions::{
    PyIndexError, PyKeyboardInterrupt, PyLookupError, PyOSError, PyRuntimeError, PyValueError,
};
use pyo3::prelude::*;
use std::path::Path;

create_exception!(
    bth,
    Error,
    PyValueError,
    "A model or a compiled file cannot be used. Its attribute `code` is stable, such as 'BTH-F001'."
);

/// An exception with a code.
fn coded(code: &str, message: String) -> PyErr {
    let error = Error::new_err(for_callers(&message));
    Python::attach(|py| {
        // Without the attribute the message still has the code.
        let _ = error.value(py).setattr("code", code);
    });
    error
}

/// The exception for an error of the file format: `OSError` where a file cannot be read, else
/// `bth.Error`.
pub(crate) fn format_error(error: &bth_format::Error) -> PyErr {
    let code = error.code().as_str();
    let text = error.to_string();
    if code.starts_with("BTH-O") { PyOSError::new_err(text) } else { coded(code, text) }
}

/// The exception for a point at which no ray can start, and its row if there are several.
pub(crate) fn start_error(row: Option<usize>, error: &bth_format::Error) -> PyErr {
    let place = row.map_or(String::new(), |row| format!(" {row}"));
    coded(error.code().as_str(), format!("start{place}: {error}"))
}

/// The exception for a file that cannot be written: the subclass of `OSError` for the number that
/// the system gives.
pub(crate) fn write_error(path: &Path, error: &std::io::Error) -> PyErr {
    match error.raw_os_error() {
        Some(number) => {
            let text = error.to_string();
            let reason = text.split(" (os error").next().unwrap_or_default().to_owned();
            PyOSError::new_err((number, reason, path.as_os_str().to_owned()))
        }
        None => PyOSError::new_err(format!("{}: cannot write: {error}", path.display())),
    }
}

/// The exception for an error of the compiler.
pub(crate) fn compile_error(error: bth_compile::Error) -> PyErr {
    use bth_compile::Error as Failure;
    let text = for_callers(&error.to_string());
    match error {
        Failure::Input { code, .. } | Failure::Limit { code, .. } => coded(code, text),
        Failure::File { .. } => PyOSError::new_err(text),
        Failure::Internal { .. } => PyRuntimeError::new_err(text),
        Failure::Cancelled => PyKeyboardInterrupt::new_err("cancelled"),
    }
}

/// Fails unless an index is below a count.
pub(crate) fn check_index(name: &str, index: u32, count: u32) -> PyResult<()> {
    match index < count {
        true => Ok(()),
        false => Err(PyIndexError::new_err(format!("{name} {index} of {count}"))),
    }
}

/// The exception where a file does not keep the positions of triangles.
pub(crate) fn no_geometry() -> PyErr {
    PyLookupError::new_err(
        "the file has no positions of triangles: compile it without geometry=False (--no-geometry)",
    )
}
