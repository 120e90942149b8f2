//! Objects whose vertices move: sequences of models, and models with a vertex cache.

use crate::error::{Result, code};
use crate::model::{SequenceFrames, SequenceTiming, Source};
use crate::read_path::path;
use crate::table::Table;

/// Keys of an object.
pub(crate) const OBJECT_KEYS: &[&str] = &[
    "name",
    "model",
    "mesh",
    "deforms",
    "joint",
    "without_joints",
    "node",
    "file",
    "object",
    "sequence",
    "vertex_cache",
    "rate",
    "start",
    "color",
    "material",
];

/// The source of an object with a sequence; `None` for others.
pub(crate) fn sequence(table: &Table<'_>) -> Result<Option<Source>> {
    let Some(value) = table.get("sequence") else { return Ok(None) };
    for key in ["model", "mesh", "deforms", "joint", "node", "file", "object", "vertex_cache"] {
        table.exclude("sequence", key)?;
    }
    let timing = timing(table)?;
    if value.is_array() {
        let files = value.array()?.iter().map(path).collect::<Result<Vec<_>>>()?;
        if files.is_empty() {
            return Err(value.not_allowed("at least one file", "none"));
        }
        return Ok(Some(Source::Sequence { frames: SequenceFrames::Listed(files), timing }));
    }
    let pattern = path(&value)?;
    let (folder, name) = pattern.rsplit_once('/').unwrap_or(("", &pattern));
    let run = name.trim_start_matches(|c| c != '#').trim_end_matches(|c| c != '#');
    if folder.contains('#') || run.is_empty() || run.contains(|c| c != '#') {
        let message = format!("expected a file's name with one run of `#`, found \"{pattern}\"");
        let hint = "write # in the place of the digits of the frame's number, or list the files";
        return Err(value.error(code::PATH, message, hint));
    }
    Ok(Some(Source::Sequence { frames: SequenceFrames::Numbered(pattern), timing }))
}

/// The source of an object with a vertex cache; `None` for others.
pub(crate) fn vertex_cache(table: &Table<'_>) -> Result<Option<Source>> {
    let Some(cache) = table.get("vertex_cache") else {
        for key in ["rate", "start"] {
            if let Some(value) = table.get(key) {
                let message = format!("`{key}` belongs to objects with `sequence` or `vertex_cache`");
                return Err(value.error(code::CONFLICT, message, "remove it"));
            }
        }
        return Ok(None);
    };
    for key in ["deforms", "joint", "node", "file", "object"] {
        table.exclude("vertex_cache", key)?;
    }
    let (path, cache) = (path(&table.need("model")?)?, path(&cache)?);
    Ok(Some(Source::Cached { path, mesh: index(table, "mesh")?, cache, timing: timing(table)? }))
}

/// The number of a part of a file.
pub(crate) fn index(table: &Table<'_>, key: &'static str) -> Result<Option<u32>> {
    table.get(key).map(|v| v.integer(0..=i64::from(u32::MAX - 1)).map(|n| n as u32)).transpose()
}

fn timing(table: &Table<'_>) -> Result<SequenceTiming> {
    let rate = table.get("rate").map(|v| v.number_that("a number above 0", |n| n > 0.0)).transpose()?;
    let start = table.get("start").map(|v| v.number()).transpose()?;
    Ok(SequenceTiming { rate, start: start.unwrap_or(0.0) })
}
