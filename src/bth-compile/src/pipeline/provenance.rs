//! How a file came about: tool version, options and source content. No paths and no times, so that
//! equal input gives equal bytes.

use super::Options;
use crate::error::{Error, Result};
use crate::tets;
use serde_json::json;
use std::path::Path;

/// BLAKE3 of a file's bytes, hexadecimal.
pub(super) fn hash(source: &Path) -> Result<String> {
    let failed =
        |e: std::io::Error| Error::File { code: "BTH-O080", path: source.into(), message: e.to_string() };
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(source).map_err(failed)?).map_err(failed)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// The text of the provenance section.
pub(super) fn json(
    source_blake3: &str,
    format: &str,
    tets: Option<&tets::Report>,
    options: &Options,
) -> Result<String> {
    let tetgen = match tets.map(|t| &t.worker) {
        Some(tets::WorkerStatus::Ready { tetgen }) => Some(tetgen),
        _ => None,
    };
    let value = json!({
        "tool": "bthc",
        "version": env!("CARGO_PKG_VERSION"),
        "tetgen": tetgen,
        "source": {"format": format, "blake3": source_blake3},
        "options": {
            "structure": options.structure,
            "quality": options.bvh.quality,
            "attributes": options.attributes,
            "tets": options.record.name(),
            "selection": options.costs,
            "keep_subtrees": options.keep_subtrees,
            "geometry": options.geometry,
        },
    });
    serde_json::to_string(&value).map_err(|e| Error::Internal {
        code: "BTH-X080",
        message: format!("provenance cannot be written: {e}"),
    })
}
