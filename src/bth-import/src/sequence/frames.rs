//! A sequence of files of equal topology.

use super::weld::weld;
use super::{MISMATCH, Timing, check_times};
use crate::attributes;
use crate::coordinate_range;
use crate::error::{Error, Place, Result};
use crate::import::{Format, format, read_raw, warn_not_finite};
use crate::mesh::{Attributes, Keep, Mesh, Report, Sequence, Wanted};
use crate::monitor::Monitor;
use crate::raw::{Raw, check_rows, check_triangles};
use crate::source::{NON_FINITE, Source, UNSUPPORTED, input_error, read_file};
use crate::topology::topology;
use std::path::{Path, PathBuf};

/// Reads the frames of a sequence: OBJ, PLY, STL or OFF files of the same faces over as many vertices. Everything but positions is
/// that of the first file, also how polygons are split; of its normals none are kept, since they would not fit the other frames. The mesh has the positions of
/// the first frame; vertices are welded that coincide in all frames.
///
/// # Errors
/// As [`import`](crate::import()), for each file; `BTH-I017` where a file has other faces or another number of vertices than the
/// first.
pub fn import_sequence(
    files: &[PathBuf],
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let bytes = |file: &PathBuf| std::fs::metadata(file).map_or(0, |metadata| metadata.len());
    monitor.stage("import", Some(files.iter().map(bytes).sum()));
    import_frames(files, &|frame| read_file(&files[frame]), timing, wanted, monitor)
}

/// As [`import_sequence`], from the names and the bytes of all files.
///
/// # Errors
/// As [`import_sequence`].
pub fn import_sequence_bytes(
    files: &[(PathBuf, Vec<u8>)],
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let names: Vec<_> = files.iter().map(|(name, _)| name.clone()).collect();
    monitor.stage("import", Some(files.iter().map(|(_, bytes)| bytes.len() as u64).sum()));
    import_frames(&names, &|frame| Ok(files[frame].1.clone()), timing, wanted, monitor)
}

/// Reads the frames of a sequence, one after the other; `read` gives the bytes of each file.
fn import_frames(
    files: &[PathBuf],
    read: &dyn Fn(usize) -> Result<Vec<u8>>,
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let Some((first, others)) = files.split_first() else {
        let message = "expected at least one frame".to_owned();
        return Err(Error::Internal { code: "BTH-X004", message });
    };
    let data = read(0)?;
    let source = Source::new(first, &data, monitor);
    let raw = read_frame(&source, wanted)?;
    let mut frames = vec![raw.positions.clone()];
    for (file, frame) in others.iter().zip(1..) {
        let data = read(frame)?;
        let source = Source::new(file, &data, monitor);
        let plain = Wanted::from(Keep::None);
        let mut frame = read_frame(&source, plain)?;
        check_topology(&source, first, &raw, &mut frame)?;
        frames.push(frame.positions);
    }
    let rate = timing.rate();
    let times: Vec<f64> = (0..files.len()).map(|frame| timing.start + frame as f64 / rate).collect();
    check_times(&source, &times)?;
    let format = format!("sequence of {}", raw.format);
    finish(raw, (times, frames), (format, &|frame| files[frame].clone()), wanted, monitor)
}

/// Reads a file as it is.
fn read_frame<'a>(source: &'a Source<'_>, wanted: Wanted) -> Result<Raw<'a>> {
    if format(source)? == Format::Gltf {
        let message = "expected an OBJ, PLY, STL or OFF file as a frame of a sequence, found glTF";
        return Err(source.error(UNSUPPORTED, message, "glTF has animations of its own: use it as a model"));
    }
    let raw = read_raw(source, wanted)?;
    source.progress(source.data.len())?;
    Ok(raw)
}

/// Refuses a frame of other faces than the first one, whose polygons may be split otherwise than as fans.
fn check_topology(source: &Source<'_>, first: &Path, expected: &Raw<'_>, found: &mut Raw<'_>) -> Result<()> {
    let differs = |what: String| {
        let hint = "all frames must have the same faces over the same vertices; export them again, or compile them one by one";
        Err(source.error(MISMATCH, format!("expected the faces of {}, {what}", first.display()), hint))
    };
    for (what, expected, found) in [
        ("vertices", expected.positions.len(), found.positions.len()),
        ("triangles", expected.triangles.len(), found.triangles.len()),
    ] {
        if expected != found {
            return differs(format!("{expected} {what}; found {found}"));
        }
    }
    expected.concave.replace(&mut found.triangles);
    match expected.triangles.iter().zip(&found.triangles).position(|(a, b)| a != b) {
        None => Ok(()),
        Some(row) => {
            let (expected, found) = (expected.triangles[row], found.triangles[row]);
            differs(format!("whose triangle {row} has the vertices {expected:?}; found {found:?}"))
        }
    }
}

/// The mesh of a raw one with positions in several frames, which are given with their times. `origin` has the name of the format,
/// and gives for a frame the file that its positions come from.
pub(super) fn finish(
    mut raw: Raw<'_>,
    (times, frames): (Vec<f64>, Vec<Vec<[f32; 3]>>),
    (format, file_of): (String, &dyn Fn(usize) -> PathBuf),
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    check_triangles(raw.triangles.len() as u64)?;
    check_rows((raw.positions.len() as u64).saturating_mul(frames.len() as u64))?;
    raw.concave.warn(wanted.polygons, monitor);
    let attributes = attributes::collect(&raw, wanted.attributes)?;
    let attributes = attributes.and_then(|(attributes, _)| without_normals(attributes));
    let mut triangles = std::mem::take(&mut raw.triangles);
    let groups = wanted.groups.then(|| std::mem::take(&mut raw.groups).finish(triangles.len()));
    let recorder = std::mem::take(&mut raw.materials);
    let materials =
        groups.as_ref().filter(|_| wanted.materials).map(|(_, kept)| recorder.finish(kept, triangles.len()));
    let kept = merge(&frames, &mut triangles, wanted.vertices).map_err(|(frame, row)| {
        let place = Place::Part(file_of(frame), format!("vertex {row} of frame {frame}"));
        let message = format!("expected finite coordinates, found {:?}", frames[frame][row]);
        input_error(
            NON_FINITE,
            place,
            message,
            "remove the vertex and the faces that use it, or export again",
        )
    })?;
    monitor.check()?;
    let left_out = not_finite(&frames, raw.positions.len());
    warn_not_finite(left_out, wanted.vertices, monitor);
    let read = raw.positions.len() as u64;
    let mut positions = Vec::with_capacity(kept.len() * frames.len());
    for frame in frames {
        // -0 becomes 0, as in all compiled files; what is not finite is used by no triangle.
        let finite =
            |p: [f32; 3]| if p.iter().all(|x| x.is_finite()) { p.map(|x| x + 0.0) } else { [0.0; 3] };
        positions.extend(kept.iter().map(|row| finite(frame[*row as usize])));
    }
    let mesh = Mesh {
        positions: positions[..kept.len()].to_vec(),
        triangles,
        attributes,
        groups: groups.map(|(groups, _)| groups),
        materials,
        sequence: Some(Sequence { times, positions }),
        ..Mesh::default()
    };
    coordinate_range::warn(&mesh, monitor);
    let counts = topology(&mesh);
    let report = Report {
        format,
        triangles: mesh.triangles.len() as u64,
        positions_read: read,
        positions: kept.len() as u64,
        polygons: raw.polygons,
        concave: raw.concave.count(),
        skipped: raw.skipped,
        degenerate: counts.degenerate,
        duplicate: counts.duplicate,
        boundary_edges: counts.boundary_edges,
        non_manifold_edges: counts.non_manifold_edges,
        components: counts.components,
        non_finite_unused: left_out,
        frames: mesh.sequence.as_ref().map_or(0, |sequence| sequence.times.len() as u64),
        ..Report::default()
    };
    Ok((mesh, report))
}

/// Number of vertices that are not finite in some frame, which no triangle uses.
fn not_finite(frames: &[Vec<[f32; 3]>], vertices: usize) -> u64 {
    let mut found = vec![false; vertices];
    for frame in frames {
        found.iter_mut().zip(frame).for_each(|(found, p)| *found |= !p.iter().all(|x| x.is_finite()));
    }
    found.into_iter().filter(|found| *found).count() as u64
}

/// The rows of the source that are kept: all of them, or one for each vertex that differs from others in some frame and is used.
/// Errors are those of [`weld`].
fn merge(
    frames: &[Vec<[f32; 3]>],
    triangles: &mut [[u32; 3]],
    all: bool,
) -> std::result::Result<Vec<u32>, (usize, usize)> {
    if !all {
        return weld(frames, triangles);
    }
    // Of this result only the error is needed.
    weld(frames, &mut triangles.to_vec())?;
    Ok((0..frames.first().map_or(0, Vec::len) as u32).collect())
}

fn without_normals(mut attributes: Attributes) -> Option<Attributes> {
    attributes.normals = Vec::new();
    (!attributes.uvs.is_empty()).then_some(attributes)
}
