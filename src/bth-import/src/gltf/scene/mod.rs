//! A manifest from a glTF scene: nodes, animations, cameras, lights, instancing.

mod cameras_and_lights;
mod deformers;
mod importer;
mod nodes;
mod rigid_parts;
mod tracks;

use std::path::Path;

use bth_scene::{Frames, Manifest};
use serde::Serialize;

use self::importer::Importer;
use crate::error::{Place, Result};
use crate::gltf::extensions::Use;
use crate::gltf::file::GltfFile;
use crate::mesh::Polygons;
use crate::monitor::Monitor;
use crate::source::{Source, UNSUPPORTED, input_error, read_file};

/// The longest animation in frames.
const MAX_FRAMES: u32 = 1 << 24;

/// Which animations of a document are read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Chosen {
    /// The first of the document, if it has some.
    #[default]
    First,
    /// All; of two that move the same property of a node, the first.
    All,
    /// None: nodes stay at rest.
    None,
    /// One, by name or number.
    One(String),
}

/// What of a glTF file becomes a manifest.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Scene by name or number; by default the document's.
    pub scene: Option<String>,
    /// Animations.
    pub animation: Chosen,
    /// Frames per second.
    pub rate: f64,
    /// True if skins and morph targets that the animations move deform their meshes; else these
    /// stay at rest.
    pub deform: bool,
    /// True if the parts of deforming meshes that a joint moves rigidly become instances, which are
    /// placed and never refitted.
    pub rigid_parts: bool,
    /// True if what would be ignored with a warning is an error: animations of other things than
    /// nodes and weights.
    pub strict: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        let rate = Frames::default().rate;
        let (scene, animation) = (None, Chosen::First);
        Self { scene, animation, rate, deform: true, rigid_parts: false, strict: false }
    }
}

/// What was found in a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ImportReport {
    /// Name or number of the scene.
    pub scene: String,
    /// Units and axes of a file of another format, and what became of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub space: Option<String>,
    /// Nodes of the manifest.
    pub nodes: u64,
    /// Nodes that place an object.
    pub instances: u64,
    /// Meshes that are used.
    pub objects: u64,
    /// Names or numbers of the animations that are read.
    pub animations: Vec<String>,
    /// Names or numbers of the skipped animations.
    pub animations_left_out: Vec<String>,
    /// Objects that deform.
    pub deformers: u64,
    /// Instances of parts that joints move rigidly.
    pub rigid_parts: u64,
    /// Animated properties of nodes.
    pub tracks: u64,
    /// Cameras.
    pub cameras: u64,
    /// Lights.
    pub lights: u64,
    /// Messages about what was ignored.
    pub ignored: Vec<String>,
    /// Row of the manifest's nodes for each node of the document.
    #[serde(skip)]
    pub node_rows: Vec<Option<usize>>,
}

/// Returns the name of a glTF file, by which the objects of a manifest in its folder refer to it.
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

/// Reads the scene of a glTF or GLB file. `name` is the file's path as the manifest is to name it.
///
/// # Errors
/// `BTH-O001` when it cannot be read, `BTH-I…` with the place when it cannot be used; with `strict`
/// `BTH-I015` for what would be ignored.
pub fn import(
    path: &Path,
    name: &str,
    options: &ImportOptions,
    monitor: &dyn Monitor,
) -> Result<(Manifest, ImportReport)> {
    import_bytes(path, &read_file(path)?, name, options, monitor)
}

/// Does the same as [`import`] with the bytes of a file. External buffers are in the folder of
/// `path`.
///
/// # Errors
/// The same as [`import`].
pub fn import_bytes(
    path: &Path,
    data: &[u8],
    name: &str,
    options: &ImportOptions,
    monitor: &dyn Monitor,
) -> Result<(Manifest, ImportReport)> {
    monitor.stage("import", Some(data.len() as u64));
    let source = Source::new(path, data, monitor);
    let file = GltfFile::open(&source, Use::Scene, Polygons::default())?;
    let mut importer = Importer::new(&file, name, options);
    let animations = importer.animations(&options.animation)?;
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

/// Returns the first frame that is not before the last key. Times of keys are f32, so that a key of
/// frame 49 at 24 frames a second lies a little behind that frame. The times of frames are rounded
/// as well before the two are compared.
fn last_frame(last_key: f64, rate: f64) -> i32 {
    let before = (last_key * rate).floor();
    let is_last = (before / rate) as f32 >= last_key as f32;
    let frame = if is_last { before } else { before + 1.0 };
    frame.clamp(0.0, f64::from(MAX_FRAMES)) as i32
}

/// Adds the totals to the report.
fn finish(importer: Importer<'_, '_>) -> (Manifest, ImportReport) {
    let manifest = importer.manifest;
    let report = ImportReport {
        space: importer.file.document.asset.space.clone(),
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
