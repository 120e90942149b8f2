//! The pipeline of importing a model: find the format, read, collect attributes, weld, count.

use std::path::{Path, PathBuf};

use crate::cutout::{AlphaMode, Cutouts};
use crate::deformation::RawDeformation;
use crate::error::{Error, Place, Result};
use crate::exact::Exact;
use crate::formats::format;
use crate::gltf::GltfPart;
use crate::gltf::extensions::Use;
use crate::gltf::file::GltfFile;
use crate::materials::{ImageFile, Looks};
use crate::mesh::{Attributes, Mesh, Positions, Report, Sequence, Wanted};
use crate::monitor::Monitor;
use crate::raw::{Raw, RowKind, check_rows, check_triangles};
use crate::room::{BYTES_PER_TRIANGLE, TRIANGLES_AT_ONCE, check_memory};
use crate::source::{NON_FINITE, Source, input_error, read_file};
use crate::weld::{equal_in_all_frames, equal_positions, number};
use crate::{attributes, coordinate_range, gltf, rounding, topology};
use rayon::prelude::*;

/// Bytes of a triangle that a format's reader has taken at most.
const READ_PER_TRIANGLE: u64 = 60;

/// Reads an OBJ, glTF, GLB, PLY, STL or OFF file. The extension decides about the format, or else
/// the content. Triangle ids are the source's face order after polygons have been triangulated. A
/// model without faces is an empty mesh.
///
/// # Errors
/// `BTH-O001` when the file cannot be read, `BTH-I…` with the place when it does not follow its
/// format or uses a coordinate that is not finite, `BTH-L…` beyond the limits, and
/// [`Error::Cancelled`].
pub fn import(path: &Path, wanted: impl Into<Wanted>, monitor: &dyn Monitor) -> Result<(Mesh, Report)> {
    import_bytes(path, &read_file(path)?, wanted, monitor)
}

/// Does the same as [`import`] with the bytes of a file. The extension of `name` decides about the
/// format, messages contain it, and external buffers of a glTF file are in its folder.
///
/// # Errors
/// The same as [`import`].
pub fn import_bytes(
    name: &Path,
    data: &[u8],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let wanted = wanted.into();
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(name, data, monitor);
    let raw = format(&source)?.read(&source, wanted)?;
    source.progress(data.len())?;
    finish(raw, None, wanted, monitor).map_err(|e| e.of_model(name))
}

/// Reads parts of a glTF or GLB file, each as a model, without the transforms of nodes.
///
/// # Errors
/// The same as [`import`]; also when the file is not glTF or a part does not exist.
pub fn import_gltf_parts(
    path: &Path,
    parts: &[GltfPart],
    wanted: impl Into<Wanted>,
    monitor: &dyn Monitor,
) -> Result<Vec<(Mesh, Report)>> {
    import_gltf_parts_bytes(path, &read_file(path)?, parts, wanted, monitor)
}

/// Does the same as [`import_gltf_parts`] with the bytes of a file.
///
/// # Errors
/// The same as [`import_gltf_parts`].
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
    if !format(&source)?.is_scene() {
        let message = "expected a glTF, GLB, FBX or 3MF file, whose meshes can be named";
        return Err(source.error("BTH-I001", message, "leave out the number of the mesh"));
    }
    let file = GltfFile::open(&source, Use::Parts, wanted.polygons)?;
    let shared = gltf::materials::SharedMaterials::default();
    let one = |part: &GltfPart| {
        let raw = gltf::flatten::read_part(&source, &file, *part, wanted, &shared);
        raw.and_then(|raw| finish(raw, None, wanted, monitor)).map_err(|e| e.of_model(name))
    };
    let imported = parts.iter().map(one).collect();
    shared.report(&source);
    imported
}

/// Reads the cut-outs of a model, whose triangles have the numbers that [`import`] gives them.
/// Formats other than glTF have none.
///
/// # Errors
/// The same as [`import`]; `BTH-I016` for an image that cannot be read, `BTH-L003` for one that is
/// too large.
pub fn import_cutouts(path: &Path, looks: impl Into<Looks>, monitor: &dyn Monitor) -> Result<Cutouts> {
    import_cutouts_bytes(path, &read_file(path)?, looks, monitor)
}

/// Does the same as [`import_cutouts`] with the bytes of a file.
///
/// # Errors
/// The same as [`import_cutouts`].
pub fn import_cutouts_bytes(
    name: &Path,
    data: &[u8],
    looks: impl Into<Looks>,
    monitor: &dyn Monitor,
) -> Result<Cutouts> {
    let looks = looks.into();
    let source = Source::new(name, data, monitor);
    match format(&source)?.is_scene() && looks.alpha != AlphaMode::None {
        true => gltf::cutout::flat(&source, looks),
        false => Ok(Cutouts::default()),
    }
}

/// Reads the cut-outs of parts of a glTF file, whose triangles have the numbers that
/// [`import_gltf_parts`] gives them.
///
/// # Errors
/// The same as [`import_cutouts`].
pub fn import_gltf_cutouts(
    path: &Path,
    parts: &[GltfPart],
    looks: impl Into<Looks>,
    monitor: &dyn Monitor,
) -> Result<Vec<Cutouts>> {
    let data = read_file(path)?;
    gltf::cutout::parts(&Source::new(path, &data, monitor), looks.into(), parts)
}

/// Reads the images of the materials of a model ([`Wanted::materials`]), each with the name by
/// which textures refer to it.
///
/// # Errors
/// The same as [`import`].
pub fn import_images(path: &Path, looks: Looks, monitor: &dyn Monitor) -> Result<Vec<ImageFile>> {
    import_images_bytes(path, &read_file(path)?, looks, monitor)
}

/// Does the same as [`import_images`] with the bytes of a file.
///
/// # Errors
/// The same as [`import_images`].
pub fn import_images_bytes(
    name: &Path,
    data: &[u8],
    looks: Looks,
    monitor: &dyn Monitor,
) -> Result<Vec<ImageFile>> {
    let source = Source::new(name, data, monitor);
    (format(&source)?.images)(&source, looks)
}

/// The positions of a mesh at several times.
pub(crate) struct Frames<'f> {
    /// Seconds of the frames.
    pub(crate) times: Vec<f64>,
    /// Positions by frame, in the rows of the source.
    pub(crate) positions: Vec<Vec<[f32; 3]>>,
    /// Name of the format for the report.
    pub(crate) format: String,
    /// Returns the file that the positions of a frame come from.
    pub(crate) file_of: &'f dyn Fn(usize) -> PathBuf,
}

/// Collects attributes, welds and counts. With `frames` the positions of the source have no effect.
pub(crate) fn finish(
    mut raw: Raw<'_>,
    frames: Option<Frames<'_>>,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let count = frames.as_ref().map_or(1, |frames| frames.positions.len() as u64);
    check_triangles(raw.triangles.len() as u64)?;
    check_memory(raw.triangles.len() as u64, BYTES_PER_TRIANGLE - READ_PER_TRIANGLE, TRIANGLES_AT_ONCE)?;
    check_rows((raw.positions.len() as u64).saturating_mul(count))?;
    let moves = frames.is_some() || raw.deformation.is_some();
    let rounded = match &frames {
        None => {
            let positions = if moves { Positions::F32 } else { wanted.kept_positions() };
            rounding::check((&raw.positions, &raw.triangles), raw.exact.as_deref(), positions, monitor)
        }
        Some(_) => rounding::Rounded::default(),
    };
    if let Some(exact) = &rounded.exact {
        raw.finish_polygons_again(exact, wanted.polygons, monitor)?;
    }
    raw.concave.warn(wanted.polygons, monitor);
    let collected = attributes::collect(&raw, wanted.attributes)?;
    let (mut attributes, normal_sources) = collected.map_or((None, Vec::new()), |(a, rows)| (Some(a), rows));
    if frames.is_some() {
        attributes = attributes.and_then(without_normals);
    }
    let triangles = std::mem::take(&mut raw.triangles);
    let groups = wanted.groups.then(|| std::mem::take(&mut raw.groups).finish(triangles.len()));
    let recorder = std::mem::take(&mut raw.materials);
    let materials =
        groups.as_ref().filter(|_| wanted.materials).map(|(_, kept)| recorder.finish(kept, triangles.len()));
    let positions: Vec<&[[f32; 3]]> = match &frames {
        Some(frames) => frames.positions.iter().map(Vec::as_slice).collect(),
        None => vec![&raw.positions],
    };
    let not_finite = |frame: usize, row| {
        let found = positions[frame][row];
        let hint = "remove the vertex and the faces that use it, or export the model again";
        let (place, unit) = match &frames {
            None => ((raw.locate)(RowKind::Position, row), " (as 32-bit numbers)"),
            Some(frames) => {
                (Place::Part((frames.file_of)(frame), format!("vertex {row} of frame {frame}")), "")
            }
        };
        input_error(NON_FINITE, place, format!("expected finite coordinates, found {found:?}{unit}"), hint)
    };
    let moved = raw.deformation.as_ref();
    let (exact, all) = (rounded.exact, wanted.vertices);
    let welded = weld_and_count(&positions, exact, triangles, moved, all, monitor, not_finite)?;
    let Welded { mut mesh, kept, report } = welded;
    mesh.deformation = moved.map(|moved| moved.finish(&kept, &normal_sources));
    let mut report = Report {
        format: raw.format.to_owned(),
        polygons: raw.polygons,
        concave: raw.concave.count(),
        skipped: raw.skipped,
        rounding: rounded.rounding,
        avoided_rounding: rounded.avoided,
        ..report
    };
    if let Some(Frames { times, format, .. }) = frames {
        report = Report { format, frames: times.len() as u64, ..report };
        let positions = mesh.positions.clone();
        mesh.positions.truncate(kept.len());
        mesh.sequence = Some(Sequence { times, positions });
    }
    Ok((Mesh { attributes, groups: groups.map(|(groups, _)| groups), materials, ..mesh }, report))
}

fn without_normals(mut attributes: Attributes) -> Option<Attributes> {
    attributes.normals = Vec::new();
    (!attributes.uvs.is_empty()).then_some(attributes)
}

/// A welded mesh.
pub(crate) struct Welded {
    /// Positions of all frames one after the other, and triangles.
    pub(crate) mesh: Mesh,
    /// For each position of a frame its row in the source.
    pub(crate) kept: Vec<u32>,
    /// The counts; what depends on the format is empty.
    pub(crate) report: Report,
}

/// Welds vertices that are equal in all frames and in what moves them, and counts. Indices of
/// triangles have been checked. With `all` every vertex of the source stays, and the counts are of
/// the welded mesh. With exact positions, of the only frame, these decide what is equal.
///
/// # Errors
/// `not_finite` of the first used row that is not finite, and its first such frame; cancellation.
pub(crate) fn weld_and_count(
    frames: &[&[[f32; 3]]],
    exact: Option<Vec<[f64; 3]>>,
    mut triangles: Vec<[u32; 3]>,
    moved: Option<&RawDeformation>,
    all: bool,
    monitor: &dyn Monitor,
    not_finite: impl FnOnce(usize, usize) -> Error,
) -> Result<Welded> {
    let rows = frames[0].len();
    let finite = |position: &[f32; 3]| position.iter().all(|x| x.is_finite());
    let first_bad = |row: u32| frames.iter().position(|frame| !finite(&frame[row as usize]));
    let bad = (0..rows as u32).into_par_iter().filter(|row| first_bad(*row).is_some()).count() as u64;
    if bad > 0 {
        let corners = triangles.as_flattened().par_iter();
        if let Some(row) = corners.find_first(|row| first_bad(**row).is_some()) {
            return Err(not_finite(first_bad(*row).unwrap_or_default(), *row as usize));
        }
        let fate = if all { "are kept as zeros" } else { "are left out" };
        monitor.warn(&format!("{bad} positions are not finite; no face uses them, they {fate}"));
    }
    let unwelded = all.then(|| triangles.clone());
    let same_as = match (moved, &exact) {
        (Some(moved), _) => moved.equal_vertices(frames[0]),
        (None, Some(exact)) => equal_positions(exact),
        (None, None) if frames.len() == 1 => equal_positions(frames[0]),
        (None, None) => equal_in_all_frames(frames),
    };
    let mut kept = number(&same_as, &mut triangles);
    // -0 becomes 0. What is not finite is used by no triangle.
    let vertex = |position: &[f32; 3]| if finite(position) { position.map(|x| x + 0.0) } else { [0.0; 3] };
    let positions = |frame: &[[f32; 3]], kept: &[u32]| -> Vec<[f32; 3]> {
        kept.par_iter().map(|row| vertex(&frame[*row as usize])).collect()
    };
    monitor.check()?;
    let exact = exact.map(|exact| Exact::new(kept.par_iter().map(|row| exact[*row as usize]).collect()));
    let rounded = exact.as_ref().map_or_else(|| positions(frames[0], &kept), Exact::rounded);
    let mut mesh = Mesh { positions: rounded, triangles, exact, ..Mesh::default() };
    let counts = topology::topology(&mesh);
    monitor.check()?;
    coordinate_range::warn(&mesh, monitor);
    let report = Report {
        triangles: mesh.triangles.len() as u64,
        positions_read: rows as u64,
        positions: mesh.positions.len() as u64,
        degenerate: counts.degenerate,
        duplicate: counts.duplicate,
        boundary_edges: counts.boundary_edges,
        non_manifold_edges: counts.non_manifold_edges,
        components: counts.components,
        non_finite_unused: bad,
        ..Report::default()
    };
    if let Some(triangles) = unwelded {
        kept = (0..rows as u32).collect();
        mesh = Mesh { positions: positions(frames[0], &kept), triangles, ..mesh };
    }
    mesh.positions.extend(frames[1..].iter().flat_map(|frame| positions(frame, &kept)));
    Ok(Welded { mesh, kept, report })
}
