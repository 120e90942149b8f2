//! Where the results of the compiler are kept.

use crate::options::Keywords;
use bth_cache::Store;
use bth_compile::cached::Cache;
use bth_compile::error::for_callers;
use pyo3::exceptions::{PyOSError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use std::ffi::CString;
use std::path::{Path, PathBuf};

/// Where results are kept.
#[derive(FromPyObject)]
enum CacheKeyword {
    Switch(bool),
    Folder(PathBuf),
}

/// A number of bytes, or words such as `20GiB`.
#[derive(FromPyObject)]
enum Size {
    Bytes(u64),
    Text(String),
}

/// The store that the keywords name; `default` is whether there is one if they name none.
pub(crate) fn store(keywords: &Keywords<'_, '_>, default: bool) -> PyResult<Option<Store>> {
    let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
    let shared = keywords.value::<PathBuf>("shared_cache")?;
    let default = default || shared.is_some();
    let (folder, asked) = match keywords.value::<CacheKeyword>("cache")? {
        Some(CacheKeyword::Switch(false)) if shared.is_some() => {
            return Err(PyValueError::new_err("shared_cache: cache=False excludes it"));
        }
        Some(CacheKeyword::Switch(false)) => return Ok(None),
        None if !default || set("BTH_NO_CACHE").is_some() => return Ok(None),
        Some(CacheKeyword::Folder(folder)) => (Some(folder), true),
        Some(CacheKeyword::Switch(true)) | None => (bth_cache::folder(), false),
    };
    let Some(folder) = folder else { return Ok(None) };
    let parse = |name: &str, text: String| {
        bth_cache::parse_bytes(&text).map_err(|e| PyValueError::new_err(format!("{name}: {e}")))
    };
    let size = match (keywords.value::<Size>("cache_size")?, set("BTH_CACHE_SIZE")) {
        (Some(Size::Bytes(bytes)), _) => bytes,
        (Some(Size::Text(text)), _) => parse("cache_size", text)?,
        (None, Some(text)) => parse("BTH_CACHE_SIZE", text)?,
        (None, None) => bth_cache::DEFAULT_CAP,
    };
    let store = match Store::open(&folder, size) {
        Ok(store) => store,
        // The default folder may be one that cannot be written to.
        Err(_) if !asked => return Ok(None),
        Err(e) => return Err(PyOSError::new_err(format!("{} cannot be the cache: {e}", folder.display()))),
    };
    let is_address = |place: &Path| place.to_string_lossy().contains("://");
    let shared = match (shared, set("BTH_SHARED_CACHE").map(PathBuf::from)) {
        (Some(place), _) if is_address(&place) => {
            let message =
                format!("shared_cache: expected a folder, got {}, which only bthc knows", place.display());
            return Err(PyValueError::new_err(message));
        }
        (None, Some(place)) if is_address(&place) => {
            let message = format!(
                "going on without BTH_SHARED_CACHE: {} is no folder, and only bthc knows it",
                place.display()
            );
            warn(keywords.0.py(), &message)?;
            None
        }
        (Some(place), _) | (None, Some(place)) => Some(place),
        (None, None) => None,
    };
    Ok(Some(match shared {
        Some(folder) => store.with_remote(Box::new(bth_cache::Folder(folder))),
        None => store,
    }))
}

/// Warns the caller, which fails where warnings are errors.
pub(crate) fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    let text = CString::new(for_callers(message).replace('\0', " ")).unwrap_or_default();
    // The frame of the package is 1, the frame of its caller 2.
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2)
}

/// The cache of a model, named by its path in messages about misses.
pub(crate) fn cache<'a>(store: Option<&'a Store>, model: &Path) -> Cache<'a> {
    let subject = std::path::absolute(model).unwrap_or_else(|_| model.to_owned());
    store.map_or_else(Cache::none, |store| Cache::new(store, subject.to_string_lossy()))
}
