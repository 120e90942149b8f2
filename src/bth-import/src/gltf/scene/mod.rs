//! A manifest from a glTF scene: nodes, animations, cameras, lights, instancing.

mod animated;
mod cameras;
mod deformers;
mod importer;
mod lights;
mod names;
mod nodes;
pub(crate) mod options;
mod rigid_parts;
mod tracks;

use std::collections::HashMap;
use std::path::Path;

use bth_scene::{Frames, Manifest};

use self::animated::Animated;
use self::importer::Importer;
use self::names::Names;
pub use self::options::{ImportOptions, ImportReport};
use crate::error::{Place, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::buffer::Buffers;
use crate::gltf::document;
use crate::gltf::extensions::{SCENE_EXTENSIONS, SUPPORTED};
use crate::gltf::rest_pose::parents;
use crate::monitor::Monitor;
use crate::source::{Source, UNSUPPORTED, input_error, read_file};

/// The longest animation in frames.
const MAX_FRAMES: u32 = 1 << 24;

/// The name of a glTF file, by which the objects of a manifest in its folder refer to it.
///
/// # Errors
/// `BTH-I006` when it is not UTF-8, which manifests are.
pub fn file_name(path: &Path) -> Result<&str> {
    path.file_name().and_then(|name| name.to_str()).ok_or_else(|| {
        let message = "expected a file name in UTF-8, by which the objects of a scene refer to their file";
        let hint = "rename the file, or flatten it";
        input_error(UNSUPPORTED, Place::File(path.to_owned()), message, hint)
    })
}

/// Reads the scene of a glTF or GLB file. `name` is the file's path as it is to stand in the manifest.
///
/// # Errors
/// `BTH-O001` when it cannot be read, `BTH-I…` with the place when it cannot be used; with `strict` `BTH-I015` for
/// what would be ignored.
pub fn import(
    path: &Path,
    name: &str,
    options: &ImportOptions,
    monitor: &dyn Monitor,
) -> Result<(Manifest, ImportReport)> {
    import_bytes(path, &read_file(path)?, name, options, monitor)
}

/// As [`import`], from the bytes of a file, whose external buffers are in the folder of `path`.
///
/// # Errors
/// As [`import`].
pub fn import_bytes(
    path: &Path,
    data: &[u8],
    name: &str,
    options: &ImportOptions,
    monitor: &dyn Monitor,
) -> Result<(Manifest, ImportReport)> {
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(path, data, monitor);
    // Animation pointers move what tracks cannot, so a document that requires them cannot be read.
    let known = SUPPORTED.iter().filter(|s| **s != "KHR_animation_pointer");
    let known: Vec<&str> = known.chain(&SCENE_EXTENSIONS).copied().collect();
    let (document, binary) = document::read(&source, &known)?;
    let accessors =
        Accessors { source: &source, document: &document, buffers: Buffers::new(&source, &document, binary) };
    let mut importer = Importer {
        source: &source,
        document: &document,
        accessors,
        strict: options.strict,
        file: name,
        manifest: Manifest::default(),
        report: ImportReport { node_rows: vec![None; document.nodes.len()], ..ImportReport::default() },
        node_names: Names::default(),
        object_names: Names::default(),
        objects: HashMap::new(),
        skin_names: Names::default(),
        camera_names: Names::default(),
        light_names: Names::default(),
        parents: parents(&document),
        animated: Animated::default(),
        deform: options.deform,
        deforming: Vec::new(),
    };
    let animations = importer.animations(&options.animation)?;
    importer.animated = Animated::of(&animations, document.nodes.len());
    importer.nodes(options)?;
    importer.deformers()?;
    let (tracks, last) = importer.tracks(&animations)?;
    importer.manifest.tracks = tracks;
    if options.rigid_parts {
        importer.rigid_parts()?;
    }
    if last * options.rate > f64::from(MAX_FRAMES) {
        let what = format!(
            "at {} frames a second {last} s are more than {MAX_FRAMES} frames: no later ones are shown",
            options.rate
        );
        importer.ignore("animations", what)?;
    }
    importer.manifest.frames = Frames { first: 0, last: last_frame(last, options.rate), rate: options.rate };
    source.progress(data.len())?;
    Ok(finish(importer))
}

/// The first frame that is not before the last key. Times of keys are f32, so that a key of frame 49 at 24 frames a second lies a little
/// behind that frame; the times of frames are rounded as well before the two are compared.
fn last_frame(last_key: f64, rate: f64) -> i32 {
    let before = (last_key * rate).floor();
    let is_last = (before / rate) as f32 >= last_key as f32;
    let frame = if is_last { before } else { before + 1.0 };
    frame.clamp(0.0, f64::from(MAX_FRAMES)) as i32
}

/// Adds the totals to the report.
fn finish(importer: Importer<'_>) -> (Manifest, ImportReport) {
    let manifest = importer.manifest;
    let report = ImportReport {
        nodes: manifest.nodes.len() as u64,
        instances: manifest.nodes.iter().filter(|n| n.object.is_some()).count() as u64,
        objects: manifest.objects.len() as u64,
        tracks: manifest.tracks.len() as u64,
        deformers: manifest.deformers.len() as u64,
        cameras: manifest.cameras.len() as u64,
        lights: manifest.lights.len() as u64,
        ..importer.report
    };
    (manifest, report)
}
