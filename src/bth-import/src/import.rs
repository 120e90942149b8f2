//! The pipeline of importing a model: find the format, read, collect attributes, weld, count.

use std::path::{Path, PathBuf};

use crate::cutout::{AlphaMode, Cutouts};
use crate::error::{Error, Result};
use crate::gltf::GltfPart;
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::Buffers;
use crate::gltf::extensions::{SCENE_EXTENSIONS, SUPPORTED};
use crate::groups::Groups;
use crate::materials::{ImageFile, Looks};
use crate::mesh::{Attributes, Mesh, Report, Wanted};
use crate::monitor::Monitor;
use crate::number::without_mark;
use crate::raw::{Raw, RowKind, check_rows, check_triangles};
use crate::source::{NON_FINITE, Source, input_error, read_file};
use crate::{attributes, coordinate_range, foreign, gltf, mtl, obj, off, ply, stl, topology, weld};

/// The supported formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    Obj,
    Gltf,
    Ply,
    Stl,
    Off,
}

/// Reads an OBJ, glTF, GLB, PLY, STL or OFF file. The extension decides about the format, or else the content. Triangle
/// ids are the source's face order after polygons have been triangulated. A model without faces is an empty mesh.
///
/// # Errors
/// `BTH-O001` when the file cannot be read, `BTH-I…` with the place when it does not follow its
/// format or uses a coordinate that is not finite, `BTH-L…` beyond the limits, and
/// [`Error::Cancelled`].
pub fn import(path: &Path, wanted: impl Into<Wanted>, monitor: &dyn Monitor) -> Result<(Mesh, Report)> {
    import_bytes(path, &read_file(path)?, wanted, monitor)
}

/// As [`import`], from the bytes of a file. The extension of `name` decides about the format, messages contain it, and
/// the external buffers of a glTF file are in its folder.
///
/// # Errors
/// As [`import`].
pub fn import_bytes(
    name: &Path,
    data: &[u8],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let wanted = wanted.into();
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(name, data, monitor);
    let raw = read_raw(&source, wanted)?;
    source.progress(data.len())?;
    finish(raw, wanted, monitor).map_err(|e| e.of_model(name))
}

/// Reads a source with its own rows.
pub(crate) fn read_raw<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    let raw = match format(source)? {
        Format::Obj => obj::read(source, wanted),
        Format::Gltf => gltf::flatten::read(source, wanted),
        Format::Ply => ply::read(source, wanted),
        Format::Stl => stl::read(source, wanted),
        Format::Off => off::read(source, wanted),
    };
    raw.map_err(|e| e.of_model(source.path))
}

/// Reads parts of a glTF or GLB file, each as a model of its own, without the transforms of nodes.
///
/// # Errors
/// As [`import`]; also when the file is no glTF or a part does not exist.
pub fn import_gltf_parts(
    path: &Path,
    parts: &[GltfPart],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<Vec<(Mesh, Report)>> {
    import_gltf_parts_bytes(path, &read_file(path)?, parts, wanted, monitor)
}

/// As [`import_gltf_parts`], from the bytes of a file, as [`import_bytes`] reads it.
///
/// # Errors
/// As [`import_gltf_parts`].
pub fn import_gltf_parts_bytes(
    name: &Path,
    data: &[u8],
    parts: &[GltfPart],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<Vec<(Mesh, Report)>> {
    let wanted = wanted.into();
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(name, data, monitor);
    if format(&source)? != Format::Gltf {
        let message = "expected a glTF or GLB file, of which single meshes can be named";
        return Err(source.error("BTH-I001", message, "leave out the number of the mesh"));
    }
    let supported = [SUPPORTED.as_slice(), &SCENE_EXTENSIONS].concat();
    let (document, binary) = gltf::document::read(&source, &supported)?;
    let accessors =
        Accessors { source: &source, document: &document, buffers: Buffers::new(&source, &document, binary) };
    let shared = gltf::materials::SharedMaterials::default();
    let one = |part: &GltfPart| {
        let raw = gltf::flatten::read_part(&source, &accessors, *part, (wanted, &shared));
        raw.and_then(|raw| finish(raw, wanted, monitor)).map_err(|e| e.of_model(name))
    };
    let imported = parts.iter().map(one).collect();
    shared.report(&source);
    imported
}

/// The cut-outs of a model, whose triangles have the numbers that [`import`] gives them. Formats other than glTF have none.
///
/// # Errors
/// As [`import`]; `BTH-I016` for an image that cannot be read, `BTH-L003` for one that is too large.
pub fn import_cutouts(path: &Path, looks: impl Into<Looks>, monitor: &dyn Monitor) -> Result<Cutouts> {
    import_cutouts_bytes(path, &read_file(path)?, looks, monitor)
}

/// As [`import_cutouts`], from the bytes of a file, as [`import_bytes`] reads it.
///
/// # Errors
/// As [`import_cutouts`].
pub fn import_cutouts_bytes(
    name: &Path,
    data: &[u8],
    looks: impl Into<Looks>,
    monitor: &dyn Monitor,
) -> Result<Cutouts> {
    let looks = looks.into();
    let source = Source::new(name, data, monitor);
    match format(&source)? {
        Format::Gltf if looks.alpha != AlphaMode::None => gltf::cutout::flat(&source, looks),
        _ => Ok(Cutouts::default()),
    }
}

/// The cut-outs of parts of a glTF file, whose triangles have the numbers that [`import_gltf_parts`] gives them.
///
/// # Errors
/// As [`import_cutouts`].
pub fn import_gltf_cutouts(
    path: &Path,
    parts: &[GltfPart],
    looks: impl Into<Looks>,
    monitor: &dyn Monitor,
) -> Result<Vec<Cutouts>> {
    let data = read_file(path)?;
    gltf::cutout::parts(&Source::new(path, &data, monitor), looks.into(), parts)
}

/// The images of the materials of a model ([`Wanted::materials`]), each with the name by which textures refer to it.
///
/// # Errors
/// As [`import`].
pub fn import_images(path: &Path, looks: Looks, monitor: &dyn Monitor) -> Result<Vec<ImageFile>> {
    let data = read_file(path)?;
    let source = Source::new(path, &data, monitor);
    match format(&source)? {
        Format::Gltf => gltf::materials::images(&source),
        Format::Obj => mtl::images(&source, looks.unreadable),
        Format::Ply | Format::Stl | Format::Off => Ok(Vec::new()),
    }
}

/// The files that a model consists of: itself, then those that a glTF document or an OBJ file refers to, in order. Images and
/// material libraries that do not exist are left out; reading them reports an error.
///
/// # Errors
/// `BTH-O001` when the model cannot be read.
pub fn source_files(path: &Path, looks: impl Into<Looks>) -> Result<Vec<PathBuf>> {
    let looks = looks.into();
    let mut files = vec![path.to_owned()];
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("obj") if looks.materials => files.extend(mtl::files(path, &read_file(path)?)),
        Some("obj" | "ply" | "stl" | "off" | "bth") => {}
        _ => files.extend(gltf::external_files(path, &read_file(path)?, looks)),
    }
    Ok(files)
}

/// Collects attributes, welds and counts.
fn finish(mut raw: Raw<'_>, wanted: Wanted, monitor: &dyn Monitor) -> Result<(Mesh, Report)> {
    check_triangles(raw.triangles.len() as u64)?;
    check_rows(raw.positions.len() as u64)?;
    raw.concave.warn(wanted.polygons, monitor);
    let collected = attributes::collect(&raw, wanted.attributes)?;
    let (attributes, normal_sources) = collected.map_or((None, Vec::new()), |(a, rows)| (Some(a), rows));
    let triangles = std::mem::take(&mut raw.triangles);
    let groups = wanted.groups.then(|| std::mem::take(&mut raw.groups).finish(triangles.len()));
    let recorder = std::mem::take(&mut raw.materials);
    let of = |(_, kept): &(Groups, Vec<u32>)| recorder.finish(kept, triangles.len());
    let materials = groups.as_ref().filter(|_| wanted.materials).map(of);
    let groups = groups.map(|(groups, _)| groups);
    let not_finite = |row| {
        input_error(
            NON_FINITE,
            (raw.locate)(RowKind::Position, row),
            format!("expected finite coordinates, found {:?} (as 32-bit numbers)", raw.positions[row]),
            "remove the vertex and the faces that use it, or export the model again",
        )
    };
    let Some(deformation) = &raw.deformation else {
        let rows = (raw.positions.as_slice(), triangles);
        let (mesh, counted) = weld_and_count(rows, attributes, wanted, monitor, not_finite)?;
        let mesh = Mesh { groups, materials, ..mesh };
        return Ok((mesh, report(&raw, counted)));
    };
    let mut triangles = triangles;
    let (welded, sources) = deformation.weld(&raw.positions, &mut triangles).map_err(not_finite)?;
    let deformation = Some(deformation.finish(&sources, &normal_sources));
    let left_out = welded.non_finite_unused;
    let (mesh, counted) = count(welded, triangles, (raw.positions.len(), attributes), monitor)?;
    warn_not_finite(left_out, false, monitor);
    Ok((Mesh { groups, materials, deformation, ..mesh }, report(&raw, counted)))
}

/// The counts with what the reader counted.
fn report(raw: &Raw<'_>, counted: Report) -> Report {
    let format = raw.format.to_owned();
    Report { format, polygons: raw.polygons, concave: raw.concave.count(), skipped: raw.skipped, ..counted }
}

/// Welds and counts triangles whose indices have been checked. The report's fields that depend on the format are empty.
///
/// # Errors
/// `not_finite` of the row of the first used position that is not finite; cancellation.
pub(crate) fn weld_and_count(
    (positions, mut triangles): (&[[f32; 3]], Vec<[u32; 3]>),
    attributes: Option<Attributes>,
    wanted: Wanted,
    monitor: &dyn Monitor,
    not_finite: impl FnOnce(usize) -> Error,
) -> Result<(Mesh, Report)> {
    let unwelded = wanted.vertices.then(|| triangles.clone());
    let welded = weld::weld(positions, &mut triangles).map_err(not_finite)?;
    warn_not_finite(welded.non_finite_unused, wanted.vertices, monitor);
    let (mut mesh, report) = count(welded, triangles, (positions.len(), attributes), monitor)?;
    if let Some(triangles) = unwelded {
        (mesh.positions, mesh.triangles) = (positions.iter().map(kept_vertex).collect(), triangles);
    }
    Ok((mesh, report))
}

/// Warns of positions that are not finite and that no face uses; whether they are kept all the same.
pub(crate) fn warn_not_finite(count: u64, kept: bool, monitor: &dyn Monitor) {
    if count > 0 {
        let fate = if kept { "are kept as zeros" } else { "are left out" };
        monitor.warn(&format!("{count} positions are not finite; no face uses them, they {fate}"));
    }
}

/// The mesh of welded triangles, with counts; `positions_read` are the positions before welding.
fn count(
    welded: weld::Welded,
    triangles: Vec<[u32; 3]>,
    (positions_read, attributes): (usize, Option<Attributes>),
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    monitor.check()?;
    let mesh = Mesh { positions: welded.positions, triangles, attributes, ..Mesh::default() };
    let counts = topology::topology(&mesh);
    monitor.check()?;
    coordinate_range::warn(&mesh, monitor);
    let report = Report {
        triangles: mesh.triangles.len() as u64,
        positions_read: positions_read as u64,
        positions: mesh.positions.len() as u64,
        degenerate: counts.degenerate,
        duplicate: counts.duplicate,
        boundary_edges: counts.boundary_edges,
        non_manifold_edges: counts.non_manifold_edges,
        components: counts.components,
        non_finite_unused: welded.non_finite_unused,
        ..Report::default()
    };
    Ok((mesh, report))
}

/// A vertex of the source as it is kept without welding: without negative zeros, and zeros where it is not finite, so that no face
/// uses it.
fn kept_vertex(position: &[f32; 3]) -> [f32; 3] {
    if position.iter().all(|x| x.is_finite()) { position.map(|x| x + 0.0) } else { [0.0; 3] }
}

/// The format of a source by its extension, or else by its content.
pub(crate) fn format(source: &Source<'_>) -> Result<Format> {
    source.fetched()?;
    if source.data.starts_with(&bth_format::layout::IDENTIFIER) {
        let message = "expected a model, found a compiled file";
        return Err(source.error(
            "BTH-I001",
            message,
            "name the model that it was compiled from, or see what it contains with `bthc info`",
        ));
    }
    let extension = source.path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let by_name = match extension.as_deref() {
        Some("obj") => Some(Format::Obj),
        Some("gltf" | "glb") => Some(Format::Gltf),
        Some("ply") => Some(Format::Ply),
        Some("stl") => Some(Format::Stl),
        Some("off") => Some(Format::Off),
        _ => None,
    };
    if extension.as_deref() == Some("manifest") {
        let message = "expected a model, found the name of a scene manifest";
        return Err(source.error("BTH-I001", message, "compile the manifest, or name one of its models"));
    }
    by_name.or_else(|| sniff(source.data)).ok_or_else(|| {
        let found = foreign::of(source.data).unwrap_or(foreign::Foreign {
            what: "something else",
            hint: "give the file its format's extension if it is one of these, or convert it",
        });
        let what = found.what;
        let message = format!("expected a model in OBJ, glTF, GLB, PLY, STL or OFF format, found {what}");
        source.error("BTH-I001", message, found.hint)
    })
}

/// The format that the first bytes suggest, if they suggest one.
fn sniff(data: &[u8]) -> Option<Format> {
    let text = without_mark(data).trim_ascii_start();
    let first_word = text.split(|c| c.is_ascii_whitespace()).next().unwrap_or_default();
    if data.starts_with(b"glTF") || text.starts_with(b"{") {
        Some(Format::Gltf)
    } else if first_word == b"ply" {
        Some(Format::Ply)
    } else if first_word.eq_ignore_ascii_case(b"solid") || stl::is_binary_size(data) {
        Some(Format::Stl)
    } else if off::is_keyword(first_word) {
        Some(Format::Off)
    } else if obj::looks_like_obj(data) {
        Some(Format::Obj)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_is_found_by_content() {
        let mut binary_stl = vec![7; 84];
        binary_stl[80..].copy_from_slice(&0u32.to_le_bytes());
        for (data, format) in [
            (&b"glTF\x02\0\0\0"[..], Some(Format::Gltf)),
            (b"\n{\"asset\":{}}", Some(Format::Gltf)),
            (b"ply\r\nformat ascii 1.0", Some(Format::Ply)),
            (b"solid name", Some(Format::Stl)),
            (b"SOLID name", Some(Format::Stl)),
            (b"\xEF\xBB\xBFply\n", Some(Format::Ply)),
            (b"\xEF\xBB\xBF{}", Some(Format::Gltf)),
            (b"\xEF\xBB\xBFv 1 2 3\n", Some(Format::Obj)),
            (&binary_stl, Some(Format::Stl)),
            (b"COFF\n3 1 0", Some(Format::Off)),
            (b"# comment\n\nv 1 2 3\n", Some(Format::Obj)),
            (b"PK\x03\x04", None),
            (b"", None),
        ] {
            assert_eq!(sniff(data), format, "{}", String::from_utf8_lossy(data));
        }
    }
}
