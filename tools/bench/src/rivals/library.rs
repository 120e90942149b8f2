//! Shared libraries of rivals, loaded at run time so that nothing is needed to build.
#![allow(unsafe_code)]

use anyhow::{Context, Result, anyhow};
use libloading::Library;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Loads the library that an environment variable names, or the one of this name in the folder that
/// `tools/bench/rivals` fills. It is never unloaded, so its functions may be kept.
///
/// # Safety
/// The library's initializers must be sound to run, as in the libraries that the variables name.
pub(super) unsafe fn load(variable: &str, file: &str) -> Result<&'static Library> {
    let path = match std::env::var_os(variable) {
        Some(path) => PathBuf::from(path),
        None => installed(file)
            .ok_or_else(|| anyhow!("not installed (run tools/bench/rivals, or set {variable})"))?,
    };
    // Canonical, as a library finds others that it needs next to itself, not next to a link.
    let path = path.canonicalize().with_context(|| format!("{variable} names no file"))?;
    // SAFETY: handed on to the caller.
    let library = unsafe { Library::new(path) }?;
    Ok(Box::leak(Box::new(library)))
}

/// The functions of a library, loaded once.
pub(super) type Api<T> = OnceLock<std::result::Result<T, String>>;

/// The functions of a library, loaded if they are not yet.
pub(super) fn once<T>(api: &'static Api<T>, load: fn() -> Result<T>) -> Result<&'static T> {
    let api = api.get_or_init(|| load().map_err(|e| format!("{e:#}")));
    api.as_ref().map_err(|e| anyhow!("{e}"))
}

/// Looks into the folder `rivals` next to the folder of this program or of the tests.
pub(crate) fn installed(file: &str) -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    let folders = program.ancestors().skip(2).take(2);
    folders.map(|target: &Path| target.join("rivals").join(file)).find(|p| p.exists())
}
