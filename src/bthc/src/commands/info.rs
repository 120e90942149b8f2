//! `bthc info`: shows the contents of a compiled file or a model.

mod model;

use super::holes::{Holes, holes};
use crate::args::Info;
use crate::failure::Failure;
use crate::output;
use crate::table::{Table, bytes, count};
use bth::Isa;
use bth_format::groups::Groups;
use bth_format::layout::kind;
use bth_format::layout::{
    FREE_BINS, FREE_SECTORS, FreeBins, FreeSectors, IDENTIFIER, MATERIAL_DOUBLE_SIDED, MATERIAL_UNLIT, NONE,
    SectionEntry,
};
use bth_format::object::ObjectView;
use bth_format::{File, SceneView};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;

pub(crate) fn run(args: &Info) -> Result<(), Failure> {
    let (mut json, mut text) = match &args.file {
        None => (json!({}), String::new()),
        Some(path) if is_compiled(path) => {
            let named = |failure| match failure {
                Failure::Runtime(error) => Failure::Runtime(error.in_file(path)),
                other => other,
            };
            let file = File::read(path)?;
            let told =
                if args.json { describe(&file).map(|json| (json, String::new())) } else { summary(&file) };
            told.map_err(named)?
        }
        Some(path) => model::tell(path, args.json)?,
    };
    if args.cpu {
        json["cpu"] = cpu();
        let mut facts = Table::default();
        let shown =
            |value: &Value| value.to_string().replace(['"', '{', '}', '[', ']'], "").replace(',', ", ");
        json["cpu"]
            .as_object()
            .into_iter()
            .flatten()
            .for_each(|(name, value)| facts.row([name, &shown(value)]));
        text.push_str(&facts.render());
    }
    Ok(if args.json { output::json(&json) } else { output::text(&text) }?)
}

/// Returns true for a file that is compiled, by its first bytes or its name; also for one that
/// cannot be read.
fn is_compiled(path: &Path) -> bool {
    let mut first = [0; IDENTIFIER.len()];
    let read = std::fs::File::open(path).map(|mut file| file.read_exact(&mut first));
    path.extension().is_some_and(|extension| extension == "bth") || read.is_err() || first == IDENTIFIER
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
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
            "anchor": view.anchor, "tet_leaves": view.tet_leaves.len(),
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
    let materials = file.materials(object);
    let gloss = |row: usize| {
        materials.gloss.get(row).map(|g| {
            json!({"metallic": g.metallic, "roughness": g.roughness,
                "metallic_roughness_texture": texture(g.metallic_roughness_texture),
                "normal_texture": texture(g.normal_texture), "occlusion_texture": texture(g.occlusion_texture)})
        })
    };
    let rows = materials.parameters.iter().enumerate();
    rows.map(|(row, p)| {
        json!({"base_color": p.base_color, "emissive": p.emissive, "double_sided": p.flags & MATERIAL_DOUBLE_SIDED != 0,
            "unlit": p.flags & MATERIAL_UNLIT != 0, "alpha_cutoff": p.alpha_cutoff,
            "alpha": ALPHA_MODES.get(p.alpha_mode as usize),
            "base_color_texture": texture(p.base_color_texture), "emissive_texture": texture(p.emissive_texture),
            "gloss": gloss(row)})
    })
    .collect()
}

/// Most groups of an object that the table shows.
const SHOWN_GROUPS: usize = 40;

/// A table of groups with their materials and numbers of triangles; empty if there are no groups.
fn groups_table<'a>(rows: impl ExactSizeIterator<Item = (&'a str, &'a str, u64)>) -> String {
    let (mut table, all) = (Table::default(), rows.len());
    table.row(["group", "name", "material", "triangles"]);
    for (i, (name, material, triangles)) in rows.take(SHOWN_GROUPS).enumerate() {
        table.row([&i.to_string(), name, material, &count(triangles)]);
    }
    if all > SHOWN_GROUPS {
        table.row(["", &format!("{} more, see --json", all - SHOWN_GROUPS), "", ""]);
    }
    if all == 0 { String::new() } else { format!("\n{}", table.render()) }
}

/// A point or a box's corner.
fn point<T: ToString>(numbers: &[T]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

/// The scene; null without scene sections.
fn scene_of(file: &File) -> Result<Value, Failure> {
    let Some(view) = file.check_scene()? else { return Ok(Value::Null) };
    let scene = &view.scene[0];
    let (instances, groups) = written_out(&view);
    let names = |count: usize, name: &dyn Fn(u32) -> String| (0..count as u32).map(name).collect::<Vec<_>>();
    Ok(json!({
        "first_frame": scene.first_frame, "last_frame": scene.last_frame, "rate": scene.rate,
        "camera": (scene.camera != NONE).then(|| view.camera_name(scene.camera)),
        "nodes": view.nodes.len(), "instances": instances, "rows": view.instances.len(), "groups": groups,
        "tracks": view.tracks.len(),
        "deformers": view.deformers.len(),
        "keys": view.times.len(),
        "cameras": names(view.cameras.len(), &|i| view.camera_name(i).to_owned()),
        "lights": names(view.lights.len(), &|i| view.light_name(i).to_owned()),
    }))
}

/// Number of instances with all groups written out, and of groups.
fn written_out(view: &SceneView<'_>) -> (u64, u32) {
    let Some(groups) = Groups::of(view) else { return (view.instances.len() as u64, 0) };
    // The check of the scene has counted them.
    let all = groups.written_out(view.instances, |_, _| {}).unwrap_or_default();
    (all.last().map_or(0, |world| world.instances.into()), groups.world())
}

fn version(code: u32) -> String {
    format!("{}.{}", code >> 16, code & 0xffff)
}

/// What people read; the JSON is empty.
fn summary(file: &File) -> Result<(Value, String), Failure> {
    let header = file.header();
    let mut facts = Table::default();
    facts.row(["format", &version(header.writer_version)]);
    facts.row(["content id", &hex(&file.content_id()[..16])]);
    facts.row(["file", &bytes(header.file_length)]);
    facts.row(["traversal reads", &bytes(file.resident_bytes())]);
    if let Some(view) = file.check_scene()? {
        let scene = &view.scene[0];
        facts.count("nodes", view.nodes.len() as u64);
        let (instances, groups) = written_out(&view);
        facts.count("instances", instances);
        facts.count("groups of nodes", groups.into());
        facts.count("tracks", view.tracks.len() as u64);
        facts.count("objects that deform", view.deformers.len() as u64);
        facts.row(["frames", &format!("{} to {} at {}/s", scene.first_frame, scene.last_frame, scene.rate)]);
        (0..view.cameras.len() as u32).for_each(|camera| facts.row(["camera", view.camera_name(camera)]));
    }
    made_by(&provenance(file), &mut facts);
    let mut text = facts.render();
    for object in 0..file.object_count() {
        text.push_str(&object_text(file, object)?);
    }
    let mut sections = Table::default();
    sections.row(["section", "rows", "size"]);
    for section in file.sections() {
        let e = section.entry;
        sections.row([kind::name(e.kind), &count(e.count), &bytes(e.length)]);
    }
    Ok((Value::Null, format!("{text}\n{}", sections.render())))
}

/// The program, the source's formats and the main options that made a file.
fn made_by(provenance: &Value, facts: &mut Table) {
    let text = |value: &Value| value.as_str().map(str::to_owned).unwrap_or_else(|| value.to_string());
    if let (Some(tool), Some(version)) = (provenance.get("tool"), provenance.get("version")) {
        facts.row(["made by", &format!("{} {}", text(tool), text(version))]);
    }
    let sources = provenance["sources"].as_array().into_iter().flatten().chain(provenance.get("source"));
    let formats: BTreeSet<String> = sources.map(|source| text(&source["format"])).collect();
    if !formats.is_empty() {
        facts.row(["from", &formats.into_iter().collect::<Vec<_>>().join(", ")]);
    }
    let options = provenance["options"].as_object().into_iter().flatten();
    let options = options.filter(|(_, value)| !value.is_object() && !value.is_null());
    let options: Vec<_> = options.map(|(name, value)| format!("{name} {}", text(value))).collect();
    if !options.is_empty() {
        facts.row(["options", &options.join(", ")]);
    }
}

/// The facts of an object, behind a row that tells which it is where the file has several.
fn object_text(file: &File, object: u32) -> Result<String, Failure> {
    let (view, mut facts) = (file.object(object)?, Table::default());
    let name = file.object_name(object);
    if file.object_count() > 1 || !name.is_empty() {
        facts.row(["object", format!("{object} {name}").trim_end()]);
    }
    facts.row(["triangles", &count(view.header.triangles.into())]);
    facts.row(["lower", &point(&view.header.lower)]);
    facts.row(["upper", &point(&view.header.upper)]);
    facts.count("dropped", view.header.dropped.into());
    facts.row(["depth", &count(view.header.depth.into())]);
    if let Some(grid) = &view.grid {
        facts.row(["coordinates", &format!("{} bits", grid.bits as u32)]);
        facts.row(["vertices moved by at most", &view.header.displacement.to_string()]);
    }
    if !view.exact.is_empty() {
        let anchor = point(&view.anchor);
        facts.row(["positions", &format!("f64; leaves and box are f32, relative to {anchor}")]);
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
    if !view.tet_leaves.is_empty() {
        facts.row(["tet leaves", &count(view.tet_leaves.len() as u64)]);
        facts.row(["triangles in tet leaves", &count(view.tet_faces.len() as u64)]);
        facts.row(["tetrahedra", &count(view.records.len() as u64)]);
    }
    let own = |e: &&SectionEntry| e.object == object && file.is_traced(e);
    let traced: u64 = file.sections().map(|s| s.entry).filter(own).map(|e| e.length).sum();
    let per_triangle = traced as f64 / f64::from(view.header.triangles.max(1));
    facts.row(["bytes a triangle", &format!("{per_triangle:.1}")]);
    let counts = view.triangles_of_groups();
    let groups = (0..view.groups.len()).map(|group| {
        let material = view.material_of(group as u32).map_or("", |material| view.material_name(material));
        (view.group_name(group as u32), material, counts[group])
    });
    Ok(format!("\n{}{}", facts.render(), groups_table(groups)))
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
