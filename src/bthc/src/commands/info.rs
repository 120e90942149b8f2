//! `bthc info`: shows the contents of a compiled file.

use super::holes::{Holes, holes};
use super::scene::is_gltf;
use crate::args::Info;
use crate::failure::Failure;
use crate::output;
use crate::table::{Table, bytes, count};
use bth::Isa;
use bth_format::File;
use bth_format::layout::kind;
use bth_format::layout::{
    FREE_BINS, FREE_SECTORS, FreeBins, FreeSectors, MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, NONE, RecordKind,
    SectionEntry,
};
use bth_format::object::ObjectView;
use bth_import::gltf::scene::{self, ImportOptions};
use serde_json::{Value, json};
use std::path::Path;

pub(crate) fn run(args: &Info) -> Result<(), Failure> {
    if let Some(model) = args.file.as_ref().filter(|file| is_gltf(file)) {
        return gltf(model, args.json);
    }
    let file = args.file.as_ref().map(File::read).transpose()?;
    let named = |failure| match (failure, &args.file) {
        (Failure::Runtime(error), Some(path)) => Failure::Runtime(error.in_file(path)),
        (other, _) => other,
    };
    if args.json {
        let mut value = file.as_ref().map_or_else(|| Ok(json!({})), describe).map_err(named)?;
        if args.cpu {
            value["cpu"] = cpu();
        }
        return Ok(output::json(&value)?);
    }
    let mut text = file.as_ref().map_or_else(|| Ok(String::new()), summary).map_err(named)?;
    if args.cpu {
        text.push_str(&format!("{:#}\n", cpu()));
    }
    Ok(output::text(&text)?)
}

/// Shows what of a glTF file becomes a scene by default, and what is skipped.
fn gltf(model: &Path, json: bool) -> Result<(), Failure> {
    let options = ImportOptions::default();
    let (manifest, report) = scene::import(model, "model", &options, &bth_import::Silent)?;
    if json {
        return Ok(output::json(&json!({"import": report, "last_frame": manifest.frames.last,
            "rate": manifest.frames.rate}))?);
    }
    let mut facts = super::import::facts(&report);
    facts.row(["frames", &format!("0 to {} at {}/s", manifest.frames.last, manifest.frames.rate)]);
    for what in &report.ignored {
        facts.row(["ignored", &what.escape_debug().to_string()]);
    }
    Ok(output::text(&format!("{}\n", facts.render()))?)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

fn record(view: &ObjectView<'_>) -> &'static str {
    RecordKind::from_code(view.header.record).map_or("none", RecordKind::name)
}

/// The provenance record, as JSON if it is JSON, else as text.
fn provenance(file: &File) -> Value {
    file.provenance().map_or(Value::Null, |text| serde_json::from_str(text).unwrap_or_else(|_| text.into()))
}

fn describe(file: &File) -> Result<Value, Failure> {
    let section = |s: bth_format::file::SectionView<'_>| {
        let e = s.entry;
        let object = (e.object != NONE).then_some(e.object);
        json!({"kind": kind::name(e.kind), "object": object, "offset": e.offset, "bytes": e.length,
            "stride": e.stride, "count": e.count, "hash": hex(&e.hash)})
    };
    let object = |i: u32| -> Result<Value, Failure> {
        let view = file.object(i)?;
        let h = view.header;
        Ok(json!({"lower": h.lower, "upper": h.upper, "triangles": h.triangles, "dropped": h.dropped,
            "depth": h.depth, "coordinates": view.grid.map_or(32, |grid| grid.bits as u32),
            "displacement": h.displacement, "positions": if view.exact.is_empty() { "f32" } else { "f64" },
            "anchor": view.anchor, "record": record(&view), "tet_leaves": view.tet_leaves.len(),
            "tets": view.records.len(), "tet_triangles": view.tet_faces.len(),
            "holes": holes(&view).map(|h| json!({"triangles": h.triangles, "opaque": h.shares[0],
                "transparent": h.shares[1], "unknown": h.shares[2]})),
            "frames": file.sequence(i).times.len(),
            "free_directions": free_directions(&view),
            "name": file.object_name(i), "groups": groups(&view),
            "materials": (0..view.materials.len() as u32).map(|m| view.material_name(m)).collect::<Vec<_>>(),
            "parameters": materials(file, i),
            "geometry": !view.triangles.is_empty(), "normals": view.normals.len(), "uvs": view.uvs.len()}))
    };
    let header = file.header();
    Ok(json!({
        "bytes": header.file_length,
        "resident_bytes": file.resident_bytes(),
        "format_version": version(header.writer_version),
        "minimum_reader_version": version(header.minimum_reader_version),
        "content_id": hex(&file.content_id()),
        "objects": (0..file.object_count()).map(object).collect::<Result<Vec<_>, _>>()?,
        "scene": scene_of(file)?,
        "sections": file.sections().map(section).collect::<Vec<_>>(),
        "provenance": provenance(file),
    }))
}

/// Shares of what is known about free directions: triangles with any, free bins among their bins,
/// and sectors of their sides with at least each level. Null where nothing is known.
fn free_directions(view: &ObjectView<'_>) -> Value {
    let Some(levels) = view.free_levels.first() else { return Value::Null };
    let (mut rows, mut known, mut bins, mut beyond) = (0u64, 0u64, 0u64, [0u64; FreeSectors::LEVELS]);
    while let Some(of_row) = view.known_free(rows as usize) {
        rows += 1;
        known += u64::from(!of_row.is_nothing());
        bins += u64::from((of_row.bins.0 & FreeBins::ALL).count_ones());
        for (sectors, sector) in
            of_row.sectors.iter().flat_map(|side| (0..FREE_SECTORS).map(move |i| (side, i)))
        {
            let level = sectors.level(sector);
            beyond[..level].iter_mut().for_each(|count| *count += 1);
        }
    }
    let (triangles, sides) = (rows as f64, if view.free.is_empty() { 2.0 } else { 1.0 });
    json!({"triangles": known as f64 / triangles, "bins": bins as f64 / (triangles * FREE_BINS as f64),
        "beyond": beyond.map(|count| count as f64 / (sides * triangles * FREE_SECTORS as f64)),
        "levels": levels.distance, "bytes": rows as usize * view.free_kind().1})
}

/// The groups of an object with their numbers of triangles; empty where the file keeps none.
fn groups(view: &ObjectView<'_>) -> Vec<Value> {
    let rows = (0..view.groups.len() as u32).zip(view.triangles_of_groups());
    rows.map(|(group, triangles)| {
        let material = view.material_of(group);
        json!({"name": view.group_name(group), "triangles": triangles, "material": material})
    })
    .collect()
}

/// Names of alpha modes, by their codes.
const ALPHA_MODES: [&str; 3] = ["opaque", "mask", "blend"];

/// How the materials of an object look; empty where the file keeps no more than their names.
fn materials(file: &File, object: u32) -> Vec<Value> {
    let texture = |row: u32| (row != NONE).then_some(row);
    let rows = file.materials(object).parameters.iter();
    rows.map(|p| {
        json!({"base_color": p.base_color, "emissive": p.emissive, "double_sided": p.flags & MATERIAL_DOUBLE_SIDED != 0,
            "unlit": p.flags & MATERIAL_UNLIT != 0, "alpha_cutoff": p.alpha_cutoff,
            "alpha": ALPHA_MODES.get(p.alpha_mode as usize),
            "base_color_texture": texture(p.base_color_texture), "emissive_texture": texture(p.emissive_texture)})
    })
    .collect()
}

/// Most groups of an object that the table shows.
const SHOWN_GROUPS: usize = 40;

/// A table of the groups of all objects; empty where the file keeps none.
fn groups_table(file: &File) -> Result<String, Failure> {
    let mut table = Table::default();
    table.row(["object", "group", "name", "material", "triangles"]);
    let mut rows = 0;
    for object in 0..file.object_count() {
        let view = file.object(object)?;
        let name = file.object_name(object);
        let shown = if name.is_empty() { object.to_string() } else { name.escape_debug().to_string() };
        let counts = view.triangles_of_groups();
        for group in 0..view.groups.len().min(SHOWN_GROUPS) {
            let row = group as u32;
            let material = view.material_of(row).map_or("", |material| view.material_name(material));
            let (name, material) = (view.group_name(row).escape_debug(), material.escape_debug());
            let cells = [shown.clone(), row.to_string(), name.to_string(), material.to_string()];
            let [object, group, name, material] = cells.each_ref().map(String::as_str);
            table.row([object, group, name, material, &count(counts[row as usize])]);
            rows += 1;
        }
        if view.groups.len() > SHOWN_GROUPS {
            let rest = format!("{} more, see --json", view.groups.len() - SHOWN_GROUPS);
            table.row([shown.as_str(), "", &rest, "", ""]);
        }
    }
    Ok(if rows == 0 { String::new() } else { format!("{}\n", table.render()) })
}

/// The scene; null without scene sections.
fn scene_of(file: &File) -> Result<Value, Failure> {
    let Some(view) = file.check_scene()? else { return Ok(Value::Null) };
    let scene = &view.scene[0];
    let names = |count: usize, name: &dyn Fn(u32) -> String| (0..count as u32).map(name).collect::<Vec<_>>();
    Ok(json!({
        "first_frame": scene.first_frame, "last_frame": scene.last_frame, "rate": scene.rate,
        "camera": (scene.camera != NONE).then(|| view.camera_name(scene.camera)),
        "nodes": view.nodes.len(), "instances": view.instances.len(), "tracks": view.tracks.len(),
        "deformers": view.deformers.len(),
        "keys": view.times.len(),
        "cameras": names(view.cameras.len(), &|i| view.camera_name(i).to_owned()),
        "lights": names(view.lights.len(), &|i| view.light_name(i).to_owned()),
    }))
}

fn version(code: u32) -> String {
    format!("{}.{}", code >> 16, code & 0xffff)
}

fn summary(file: &File) -> Result<String, Failure> {
    let header = file.header();
    let mut facts = Table::default();
    facts.row(["format", &version(header.writer_version)]);
    facts.row(["content id", &hex(&file.content_id()[..16])]);
    facts.row(["file", &bytes(header.file_length)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes())]);
    for object in 0..file.object_count() {
        add_object(&mut facts, file, object)?;
    }
    if let Some(view) = file.check_scene()? {
        let scene = &view.scene[0];
        facts.row(["nodes", &count(view.nodes.len() as u64)]);
        facts.row(["instances", &count(view.instances.len() as u64)]);
        facts.row(["tracks", &count(view.tracks.len() as u64)]);
        facts.row(["objects that deform", &count(view.deformers.len() as u64)]);
        facts.row(["frames", &format!("{} to {} at {}/s", scene.first_frame, scene.last_frame, scene.rate)]);
        for camera in 0..view.cameras.len() as u32 {
            facts.row(["camera", &view.camera_name(camera).escape_debug().to_string()]);
        }
    }
    let mut sections = Table::default();
    sections.row(["section", "rows", "size"]);
    for section in file.sections() {
        let e = section.entry;
        sections.row([kind::name(e.kind), &count(e.count), &bytes(e.length)]);
    }
    let made = file.provenance().map_or(String::new(), |text| format!("\n{}\n", printable(text)));
    Ok(format!("{}\n{}{}{made}", facts.render(), groups_table(file)?, sections.render()))
}

/// Adds the facts of an object, behind a row that tells which it is where the file has several.
fn add_object(facts: &mut Table, file: &File, object: u32) -> Result<(), Failure> {
    let view = file.object(object)?;
    if file.object_count() > 1 {
        let name = file.object_name(object).escape_debug();
        facts.row(["object", format!("{object} {name}").trim_end()]);
    }
    facts.row(["triangles", &count(view.header.triangles.into())]);
    facts.row(["dropped", &count(view.header.dropped.into())]);
    facts.row(["depth", &count(view.header.depth.into())]);
    if let Some(grid) = &view.grid {
        facts.row(["coordinates", &format!("{} bits", grid.bits as u32)]);
        facts.row(["vertices moved by at most", &view.header.displacement.to_string()]);
    }
    if !view.exact.is_empty() {
        let [x, y, z] = view.anchor;
        facts.row(["positions", &format!("f64; leaves are f32, relative to {x}, {y}, {z}")]);
    }
    if let Some(Holes { triangles, shares: [opaque, transparent, unknown] }) = holes(&view) {
        facts.row(["triangles with holes", &count(triangles)]);
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        facts.row(["  of their area opaque", &percent(opaque)]);
        facts.row(["  transparent", &percent(transparent)]);
        facts.row(["  unknown", &percent(unknown)]);
    }
    let sequence = file.sequence(object);
    if let ([first, ..], [.., last]) = (sequence.times, sequence.times) {
        let frames = format!("{} from {first} to {last} s", sequence.times.len());
        facts.row(["frames of its vertices", &frames]);
    }
    facts.row(["tet leaves", &count(view.tet_leaves.len() as u64)]);
    facts.row(["triangles in tet leaves", &count(view.tet_faces.len() as u64)]);
    facts.row(["tetrahedra", &count(view.records.len() as u64)]);
    facts.row(["record", record(&view)]);
    let own = |e: &&SectionEntry| e.object == object && file.is_traced(e);
    let traced: u64 = file.sections().map(|s| s.entry).filter(own).map(|e| e.length).sum();
    let per_triangle = traced as f64 / f64::from(view.header.triangles.max(1));
    facts.row(["bytes a triangle", &format!("{per_triangle:.1}")]);
    Ok(())
}

/// JSON without characters that would change the state of a terminal.
fn printable(json: &str) -> String {
    let escaped = |c: char| match c {
        '"' | '\\' | '\'' => c.to_string(),
        _ => c.escape_debug().to_string(),
    };
    json.chars().map(escaped).collect()
}

/// The processor's features that kernels may use.
fn cpu() -> Value {
    #[cfg(target_arch = "x86_64")]
    let features = json!({
        "sse4.1": is_x86_feature_detected!("sse4.1"),
        "avx2": is_x86_feature_detected!("avx2"),
        "fma": is_x86_feature_detected!("fma"),
        "avx512f": is_x86_feature_detected!("avx512f"),
        "avx512vl": is_x86_feature_detected!("avx512vl"),
        "avx512dq": is_x86_feature_detected!("avx512dq"),
        "avx512bw": is_x86_feature_detected!("avx512bw"),
    });
    #[cfg(not(target_arch = "x86_64"))]
    let features = json!({});
    let available: Vec<String> =
        Isa::ALL.iter().filter(|isa| isa.is_available()).map(Isa::to_string).collect();
    json!({
        "architecture": std::env::consts::ARCH,
        "isa": Isa::chosen().to_string(),
        "available": available,
        "features": features,
    })
}
