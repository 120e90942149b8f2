//! `bthc info` of a model that is not compiled: what reading it finds.

use super::{groups_table, point};
use crate::commands::import;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::table::{Table, count};
use bth_compile::Monitor;
use bth_import::gltf::scene::{self, ImportOptions};
use bth_import::{Mesh, Report, Silent, Wanted};
use serde_json::{Value, json};
use std::path::Path;

/// Reads a model, of a glTF, FBX or 3MF file also what becomes a scene by default and what is
/// skipped. Returns the JSON and the text.
pub(super) fn tell(path: &Path, as_json: bool) -> Result<(Value, String), Failure> {
    let progress = Progress::new(as_json);
    let wanted = Wanted { groups: true, ..Wanted::default() };
    if !bth_import::is_scene(path) {
        let (mesh, report) = bth_import::import(path, wanted, &progress)?;
        return Ok(found(&mesh, &report));
    }
    let (manifest, of_scene) = scene::import(path, "model", &ImportOptions::default(), &Silent)?;
    let (mut json, text) = match bth_import::import(path, wanted, &Silent) {
        Ok((mesh, report)) => found(&mesh, &report),
        // A scene may have what one mesh cannot, such as instancing.
        Err(error) => {
            progress.warn(&format!("no box and groups, since it cannot be read as one mesh: {error}"));
            (json!({}), String::new())
        }
    };
    let mut facts = import::facts(&of_scene);
    facts.row(["frames", &format!("0 to {} at {}/s", manifest.frames.last, manifest.frames.rate)]);
    of_scene.ignored.iter().for_each(|what| facts.row(["ignored", what]));
    json["import"] = json!(of_scene);
    json["last_frame"] = json!(manifest.frames.last);
    json["rate"] = json!(manifest.frames.rate);
    Ok((json, if text.is_empty() { facts.render() } else { format!("{}\n{text}", facts.render()) }))
}

/// What is told of a mesh.
fn found(mesh: &Mesh, report: &Report) -> (Value, String) {
    let (lower, upper) = bounds(mesh);
    let mut facts = Table::default();
    facts.row(["format", &report.format]);
    facts.row(["triangles", &count(report.triangles)]);
    facts.row(["positions", &count(report.positions)]);
    if report.triangles > 0 {
        facts.row(["lower", &point(&lower)]);
        facts.row(["upper", &point(&upper)]);
    }
    if mesh.exact.is_some() {
        facts.row(["kept as", "f64, since f32 would move positions"]);
    }
    facts.count("polygons", report.polygons);
    facts.count("elements skipped", report.skipped);
    facts.count("degenerate (never hit)", report.degenerate);
    facts.count("duplicate", report.duplicate);
    facts.count("boundary edges", report.boundary_edges);
    facts.count("non-manifold edges", report.non_manifold_edges);
    facts.count("components", report.components);
    let groups = mesh.groups.clone().unwrap_or_default();
    let mut triangles = vec![0u64; groups.groups.len()];
    let ends = groups.runs.iter().skip(1).map(|run| run[0]).chain([mesh.triangles.len() as u32]);
    groups.runs.iter().zip(ends).for_each(|(run, end)| triangles[run[1] as usize] += u64::from(end - run[0]));
    let rows = groups.groups.iter().zip(&triangles);
    let listed = rows.clone().map(
        |(group, triangles)| json!({"name": group.name, "triangles": triangles, "material": group.material}),
    );
    let json = json!({"model": report, "lower": lower, "upper": upper,
        "groups": listed.collect::<Vec<_>>(), "materials": groups.materials});
    let material = |row: Option<u32>| row.map_or("", |row| groups.materials[row as usize].as_str());
    let rows = rows.map(|(group, triangles)| (group.name.as_str(), material(group.material), *triangles));
    (json, facts.render() + &groups_table(rows))
}

/// The box of all positions; zeros of a mesh without positions.
fn bounds(mesh: &Mesh) -> ([f64; 3], [f64; 3]) {
    let rounded = || mesh.positions.iter().map(|p| p.map(f64::from)).collect();
    let all: Vec<[f64; 3]> = mesh.exact.as_ref().map_or_else(rounded, |exact| exact.positions.clone());
    let first = all.first().copied().unwrap_or_default();
    all.iter().fold((first, first), |(lower, upper), p| {
        (std::array::from_fn(|k| lower[k].min(p[k])), std::array::from_fn(|k| upper[k].max(p[k])))
    })
}
