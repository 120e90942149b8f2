//! The provenance section: tool version, options and source content. No paths and no times, so that
//! equal input gives equal bytes.

use crate::error::{Error, Result};
use crate::options::{CompileOptions, Structure};
use crate::tets::WorkerStatus;
use serde_json::{Value, json};

/// Version of TetGen that a compilation used, by the status of the worker that it needed.
fn tetgen(worker: Option<&WorkerStatus>) -> Option<&str> {
    match worker? {
        WorkerStatus::Ready { tetgen } => Some(tetgen),
        _ => None,
    }
}

/// The text of the provenance section of a single object.
pub(super) fn of_model(
    blake3: &str,
    format: &str,
    worker: Option<&WorkerStatus>,
    options: &CompileOptions,
) -> Result<String> {
    text(("source", json!({"format": format, "blake3": blake3})), worker, options)
}

/// The text of the provenance section of a scene; `sources` are the format and BLAKE3 of each
/// source.
pub(crate) fn of_scene(
    sources: &[(String, String)],
    worker: Option<&WorkerStatus>,
    options: &CompileOptions,
) -> Result<String> {
    let source = |(format, blake3): &(String, String)| json!({"format": format, "blake3": blake3});
    let sources = sources.iter().map(source).collect::<Vec<_>>().into();
    text(("sources", sources), worker, options)
}

fn text(
    (name, source): (&str, Value),
    worker: Option<&WorkerStatus>,
    options: &CompileOptions,
) -> Result<String> {
    let mut json = json!({
        "tool": "bthc",
        "version": env!("CARGO_PKG_VERSION"),
        "tetgen": tetgen(worker),
        "options": options_json(options),
    });
    json[name] = source;
    serde_json::to_string(&json).map_err(|e| Error::Internal {
        code: "BTH-X080",
        message: format!("provenance cannot be written: {e}"),
    })
}

fn options_json(options: &CompileOptions) -> Value {
    let mut json = json!({
        "structure": options.structure,
        "quality": options.bvh.quality,
        "attributes": options.attributes,
        "selection": (options.structure == Structure::Bth).then_some(&options.costs),
        "geometry": options.geometry,
    });
    let is_bth = options.structure == Structure::Bth;
    let flags = [
        ("deformable", options.deformable),
        ("names", options.names),
        ("materials", options.materials),
        ("lenient_materials", options.lenient_materials),
    ];
    for (name, _) in flags.into_iter().filter(|(_, is_set)| *is_set) {
        json[name] = json!(true);
    }
    if options.coordinates != Default::default() {
        json["coordinates"] = json!(options.coordinates);
    }
    if let Some(rays) = options.costs.rays.as_ref().filter(|_| !is_bth) {
        json["rays"] = json!(rays.hash());
    }
    if options.alpha != Default::default() {
        json["alpha"] = json!(options.alpha);
    }
    json
}
