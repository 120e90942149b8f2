//! The provenance section: tool version, options and source content. No paths and no times, so that equal input gives
//! equal bytes.

use super::{CompileOptions, Structure};
use crate::error::{Error, Result};
use crate::tets;
use serde_json::json;

/// Version of TetGen that a compilation used.
pub(super) fn tetgen(report: Option<&tets::TetReport>) -> Option<&str> {
    match &report?.worker {
        tets::WorkerStatus::Ready { tetgen } => Some(tetgen),
        _ => None,
    }
}

/// The text of the provenance section of a single object.
pub(super) fn of_model(
    source_blake3: &str,
    format: &str,
    tetgen: Option<&str>,
    options: &CompileOptions,
) -> Result<String> {
    text(json!({
        "tool": "bthc",
        "version": env!("CARGO_PKG_VERSION"),
        "tetgen": tetgen,
        "source": {"format": format, "blake3": source_blake3},
        "options": options_json(options),
    }))
}

/// The text of the provenance section of a scene; `sources` are the format and BLAKE3 of each source.
pub(crate) fn of_scene(
    sources: &[(String, String)],
    tetgen: Option<&str>,
    options: &CompileOptions,
) -> Result<String> {
    let source = |(format, blake3): &(String, String)| json!({"format": format, "blake3": blake3});
    text(json!({
        "tool": "bthc",
        "version": env!("CARGO_PKG_VERSION"),
        "tetgen": tetgen,
        "sources": sources.iter().map(source).collect::<Vec<_>>(),
        "options": options_json(options),
    }))
}

fn options_json(options: &CompileOptions) -> serde_json::Value {
    let mut json = json!({
        "structure": options.structure,
        "quality": options.bvh.quality,
        "attributes": options.attributes,
        "tets": options.record.name(),
        "selection": (options.structure == Structure::Bth).then_some(&options.costs),
        "keep_subtrees": options.keep_subtrees,
        "geometry": options.geometry,
    });
    if options.deformable {
        json["deformable"] = json!(true);
    }
    if options.names {
        json["names"] = json!(true);
    }
    if options.materials {
        json["materials"] = json!(true);
    }
    if options.lenient_materials {
        json["lenient_materials"] = json!(true);
    }
    if options.coordinates != Default::default() {
        json["coordinates"] = json!(options.coordinates);
    }
    if options.structure != Structure::Bth {
        if options.costs.for_scene {
            json["for_scene"] = json!(true);
        }
        if let Some(rays) = &options.costs.rays {
            json["rays"] = json!(rays.hash());
        }
    }
    if options.alpha != Default::default() {
        json["alpha"] = json!(options.alpha);
    }
    json
}

fn text(value: serde_json::Value) -> Result<String> {
    serde_json::to_string(&value).map_err(|e| Error::Internal {
        code: "BTH-X080",
        message: format!("provenance cannot be written: {e}"),
    })
}
