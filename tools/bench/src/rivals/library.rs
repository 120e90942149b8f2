//! Shared libraries of rivals, loaded at run time so that nothing is needed to build.
#![allow(unsafe_code)]

use anyhow::{Context, Result, anyhow};
use libloading::Library;
use std::path::{Path, PathBuf};

/// Loads the library that an environment variable names, or the one of this name in the folder that
/// `tools/bench/rivals` fills. It is never unloaded, so its functions may be kept.
///
/// # Safety
/// The library's initializers must be sound to run: true of those that the variables are documented for.
///
/// # Errors
/// If there is no such library or it cannot be loaded.
pub(super) unsafe fn load(variable: &str, file: &str) -> Result<&'static Library> {
    let path = match std::env::var_os(variable) {
        Some(path) => PathBuf::from(path),
        None => installed(file)
            .ok_or_else(|| anyhow!("not installed (run tools/bench/rivals, or set {variable})"))?,
    };
    // The path is made canonical, as a library finds others that it needs in its own folder, not in that of a link.
    let path = path.canonicalize().with_context(|| format!("{variable} names no file"))?;
    // SAFETY: handed on to the caller.
    let library = unsafe { Library::new(path) }?;
    Ok(Box::leak(Box::new(library)))
}

/// Looks into the folder `rivals` beside the folder of this program, and beside that of the tests.
fn installed(file: &str) -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    program
        .ancestors()
        .skip(2)
        .take(2)
        .map(|target: &Path| target.join("rivals").join(file))
        .find(|p| p.exists())
}
