//! A sequence of files of equal topology, and a model whose vertices a vertex cache moves.

use super::{MISMATCH, Timing, check_times, read_vertex_cache};
use crate::error::{Error, Result};
use crate::formats::{GLTF, format};
use crate::gltf::GltfPart;
use crate::gltf::extensions::Use;
use crate::gltf::file::GltfFile;
use crate::gltf::flatten::read_part;
use crate::gltf::materials::SharedMaterials;
use crate::import::{Frames, finish};
use crate::mesh::{Keep, Mesh, Report, Wanted};
use crate::monitor::Monitor;
use crate::raw::Raw;
use crate::source::{Source, UNSUPPORTED, read_file};
use std::path::{Path, PathBuf};

/// What a file is for, and a hint where glTF cannot be that.
struct Role(&'static str, &'static str);

const FRAME: Role = Role("a frame of a sequence", "glTF has animations of its own: use it as a model");
const MODEL: Role = Role(
    "the model of a vertex cache",
    "of a glTF file name one mesh by its number, or export the model in one of these formats",
);

/// Reads the frames of a sequence: OBJ, PLY, STL or OFF files of the same faces over as many
/// vertices. Everything but positions comes from the first file, also how polygons are split.
/// Normals are not kept, since they would not fit the other frames. The mesh has the positions of
/// the first frame; vertices are welded that coincide in all frames.
///
/// # Errors
/// The errors of [`import`](crate::import()) for each file; `BTH-I017` where a file has other faces
/// or another number of vertices than the first.
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

/// Does the same as [`import_sequence`] with the names and the bytes of all files.
///
/// # Errors
/// The same as [`import_sequence`].
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
    let raw = read_single(&source, wanted, FRAME)?;
    let mut positions = vec![raw.positions.clone()];
    for (file, frame) in others.iter().zip(1..) {
        let data = read(frame)?;
        let source = Source::new(file, &data, monitor);
        let mut frame = read_single(&source, Keep::None.into(), FRAME)?;
        check_topology(&source, first, &raw, &mut frame)?;
        positions.push(frame.positions);
    }
    let rate = timing.rate();
    let times: Vec<f64> = (0..files.len()).map(|frame| timing.start + frame as f64 / rate).collect();
    check_times(&source, &times)?;
    let format = format!("sequence of {}", raw.format);
    let frames = Frames { times, positions, format, file_of: &|frame| files[frame].clone() };
    finish(raw, Some(frames), wanted, monitor)
}

/// Reads a source whose vertices have an order, which scenes do not have.
fn read_single<'a>(source: &'a Source<'a>, wanted: Wanted, role: Role) -> Result<Raw<'a>> {
    let format = format(source)?;
    if format.is_scene() {
        let Role(what, hint) = role;
        let message = format!("expected an OBJ, PLY, STL or OFF file as {what}, found {}", format.titles[0]);
        return Err(source.error(UNSUPPORTED, message, hint));
    }
    let raw = format.read(source, wanted)?;
    source.progress(source.data.len())?;
    Ok(raw)
}

/// Refuses a frame of other faces than the first one, whose polygons may be split in another way.
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

/// Reads a mesh of a glTF file that nothing but a vertex cache moves. Its vertices are the rows of
/// POSITION of its primitives of triangles, one primitive after the other.
fn read_mesh<'a>(source: &'a Source<'a>, mesh: u32, wanted: Wanted) -> Result<Raw<'a>> {
    if format(source)?.name != GLTF.name {
        let message = "expected a glTF or GLB file, whose meshes have numbers";
        return Err(source.error(UNSUPPORTED, message, "leave out the number of the mesh"));
    }
    let file = GltfFile::open(source, Use::Parts, wanted.polygons)?;
    if file.document.is_deformed(mesh as usize) {
        let message = format!("expected a mesh without joints and morph targets, found mesh {mesh}");
        return Err(source.error(UNSUPPORTED, message, "leave out the vertex cache, or export without them"));
    }
    let shared = SharedMaterials::default();
    let raw = read_part(source, &file, GltfPart::Mesh(mesh), wanted, &shared);
    shared.report(source);
    raw.map_err(|e| e.of_model(source.path))
}

/// Reads a model and the vertex cache (PC2 or MDD) that moves its vertices. Both have the vertices
/// in the same order. The positions in the model's file have no effect. Of a glTF file one mesh is
/// read, whose vertices are the rows of POSITION of its primitives of triangles, one primitive
/// after the other.
///
/// # Errors
/// The errors of [`import`](crate::import()) and [`read_vertex_cache`]; `BTH-I017` where the cache
/// has another number of vertices, and `BTH-I006` for a glTF file without the number of a mesh, or
/// with one that has joints or morph targets.
pub fn import_vertex_cache(
    (model, mesh): (&Path, Option<u32>),
    cache: &Path,
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    let (model_data, cache_data) = (read_file(model)?, read_file(cache)?);
    import_vertex_cache_bytes((model, &model_data, mesh), (cache, &cache_data), timing, wanted, monitor)
}

/// Does the same as [`import_vertex_cache`] with the names and the bytes of both files.
///
/// # Errors
/// The same as [`import_vertex_cache`].
pub fn import_vertex_cache_bytes(
    (model, model_data, mesh): (&Path, &[u8], Option<u32>),
    (cache, cache_data): (&Path, &[u8]),
    timing: &Timing,
    wanted: Wanted,
    monitor: &dyn Monitor,
) -> Result<(Mesh, Report)> {
    monitor.stage("import", Some((model_data.len() + cache_data.len()) as u64));
    let source = Source::new(model, model_data, monitor);
    let raw = match mesh {
        Some(mesh) => read_mesh(&source, mesh, wanted)?,
        None => read_single(&source, wanted, MODEL)?,
    };
    let found = read_vertex_cache(cache, cache_data, timing, monitor)?;
    let vertices = raw.positions.len();
    if found.points != vertices {
        let message =
            format!("expected the {vertices} vertices of {}, found {}", model.display(), found.points);
        let hint = "export model and cache together, without modifiers that change the number of vertices";
        return Err(Source::new(cache, cache_data, monitor).error(MISMATCH, message, hint));
    }
    let frame = |frame: usize| found.positions[frame * vertices..][..vertices].to_vec();
    let positions = (0..found.times.len()).map(frame).collect();
    let format = format!("{} and {}", raw.format, found.format);
    let frames = Frames { times: found.times, positions, format, file_of: &|_| cache.to_owned() };
    finish(raw, Some(frames), wanted, monitor)
}
