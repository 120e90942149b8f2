//! Paths in a manifest.

use crate::error::{Result, code};
use crate::limits::MAX_PATH;
use crate::table::Value;

/// A path that stays within the manifest's folder on every system.
pub(crate) fn path(value: &Value<'_>) -> Result<String> {
    let text = value.string()?;
    if text.len() > MAX_PATH {
        let message = format!("expected a path of at most {MAX_PATH} bytes, found {}", text.len());
        return Err(value.error(code::PATH, message, "use shorter names of folders"));
    }
    let inside = |part: &str| !part.is_empty() && part != "." && part != "..";
    if text.split('/').all(inside) && !text.contains(['\\', ':', '\0']) {
        return Ok(text.to_owned());
    }
    let message = format!("expected a path within the manifest's folder, found \"{text}\"");
    let hint =
        "write a relative path with `/` between folders, without `..`; put the file below the manifest";
    Err(value.error(code::PATH, message, hint))
}
