//! Keys of the cache: everything that each result depends on, and never paths, times, numbers of threads or the order of
//! arguments.
//!
//! When the results of a stage change, its version in this file must be raised; `tests/versions.rs` fails otherwise.

use super::codec::MeshSummary;
use super::rows::HashedRows;
use crate::free;
use crate::options::{CompileOptions, Structure};
use crate::pipeline::TreeOptions;
use crate::source::SourceDigest;
use crate::write::SceneParts;
use bth_cache::Key;
use bth_files::Digest;
use bth_import::{AlphaMode, Polygons, Unreadable, Wanted};
use serde::Serialize;
use std::path::Path;

/// Versions of the results of the stages.
const MESH: &str = "7";
const COORDINATES: &str = "1";
const BVH: &str = "3";
const FREE: &str = "7";
const MARKS: &str = "1";
const COSTS: &str = "4";
const TETS: &str = "1";
const COLLAPSE: &str = "5";
const POLYGONS: &str = "1";
const OPACITY: &str = "2";
const NAMES: &str = "2";
const MATERIALS: &str = "4";
const DEFORMABLE: &str = "1";
/// Version of how objects are compiled whose vertices move by themselves.
pub(crate) const MOTION: &str = "1";
const FILE: &str = "4";
const OUTLINE: &str = "2";

/// A mesh read from a model. A supported extension determines the format in which the file is read.
pub(crate) fn mesh(source: &SourceDigest, path: &Path, part: &str, wanted: Wanted) -> Key {
    let mut key = Key::new("mesh")
        .with("source", source.text())
        .with("format", extension(path))
        .with("part", part)
        .with("attributes", text(&wanted.attributes))
        .with("mesh version", MESH);
    if wanted.groups {
        key = key.with("names", "true").with("names version", NAMES);
    }
    if wanted.polygons != Polygons::default() {
        key = key.with("polygons", text(&wanted.polygons)).with("polygons version", POLYGONS);
    }
    if wanted.vertices {
        key = key.with("vertices", "all").with("deformable version", DEFORMABLE);
    }
    if wanted.materials {
        key = key.with("materials", "true").with("materials version", MATERIALS);
    }
    if source.looks.unreadable == Unreadable::LeftOut {
        key = key.with("unreadable images", "left out");
    }
    match source.looks.alpha {
        AlphaMode::None => key,
        alpha => key.with("alpha", text(&alpha)).with("opacity version", OPACITY),
    }
}

pub(crate) fn extension(path: &Path) -> String {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    extension
        .filter(|e| ["obj", "gltf", "glb", "ply", "stl", "off"].contains(&e.as_str()))
        .unwrap_or_default()
}

/// The binary BVH of a mesh.
pub(crate) fn bvh(geometry: &Digest, options: &TreeOptions<'_>) -> Key {
    let mut key = Key::new("bvh")
        .with("geometry", geometry.hex())
        .with("quality", text(&options.bvh.quality))
        .with("bvh version", BVH);
    if options.bvh.keep_zero_area {
        key = key.with("zero area", "kept");
    }
    match options.rays {
        Some(rays) => key.with("rays", rays.hash()),
        None => key,
    }
}

/// The free directions of its triangles. What is too close to decide may depend on the BVH.
pub(crate) fn free(geometry: &Digest, tree: &TreeOptions<'_>, options: &free::FreeOptions) -> Key {
    Key::new("free-directions")
        .with_all(bvh(geometry, tree).components().iter().cloned())
        .with("keep", text(&options.keep))
        .with("reach", text(&options.reach))
        .with("row bytes", text(&options.row_bytes))
        .with("most triangles", text(&options.most_triangles))
        .with("free directions version", FREE)
}

/// The marks of its nodes.
pub(crate) fn marks(geometry: &Digest, options: &TreeOptions<'_>) -> Key {
    Key::new("marks")
        .with_all(bvh(geometry, options).components().iter().cloned())
        .with("marks version", MARKS)
}

/// The tetrahedralization of a node: its corners and triangles, in the order of their rows in the mesh.
pub(crate) fn tets_of_node(
    vertices: &[[f32; 3]],
    triangles: &[[u32; 3]],
    options: &crate::tets::TetOptions,
    tetgen: &str,
) -> Key {
    let mut hasher = HashedRows::new("node");
    hasher.add(vertices);
    hasher.add(triangles);
    // Part of the key because a node that can be replaced by smaller ones gets fewer attempts.
    let smaller = options.cells.iter().any(|&size| (size as usize) < triangles.len());
    Key::new("tets")
        .with("geometry", hasher.finish().hex())
        .with("tetrahedralization", attempts(options))
        .with("cells below", smaller.to_string())
        .with("tetgen", tetgen)
        .with("tets version", TETS)
}

/// The keys of a scene's objects; the components that all of them share are made once.
pub(crate) struct ObjectKeys(Vec<(String, String)>, String);

impl ObjectKeys {
    pub(crate) fn new(options: &CompileOptions, tetgen: &str) -> Self {
        Self(components(options, tetgen), text(&options.motion))
    }

    /// The key of an object, which is posed by a clip of the scene or by none.
    pub(crate) fn of(&self, mesh: &MeshSummary, clip: Option<&Digest>) -> Key {
        Key::new("object")
            .with("geometry", mesh.geometry.hex())
            .with("shading", mesh.shading.as_ref().map_or_else(|| "none".to_owned(), Digest::hex))
            .with_all(mesh.opacity.iter().map(|opacity| ("opacity".to_owned(), opacity.hex())))
            .with_all(mesh.groups.iter().map(|groups| ("groups".to_owned(), groups.hex())))
            .with_all(
                mesh.materials.iter().map(|materials| ("surface materials".to_owned(), materials.hex())),
            )
            .with_all(self.of_motion(mesh, clip))
            .with_all(mesh.deformation.iter().map(|rows| ("deformation".to_owned(), rows.hex())))
            .with_all(self.0.iter().cloned())
    }

    /// What only objects depend on whose vertices move.
    fn of_motion(&self, mesh: &MeshSummary, clip: Option<&Digest>) -> Vec<(String, String)> {
        let (name, moved_by) = match (&mesh.sequence, clip) {
            (Some(sequence), _) => ("sequence", sequence),
            (None, Some(clip)) => ("clip", clip),
            (None, None) => return Vec::new(),
        };
        let named = |name: &str, value: String| (name.to_owned(), value);
        vec![
            named(name, moved_by.hex()),
            named("motion", self.1.clone()),
            named("motion version", MOTION.to_owned()),
            named("deformable version", DEFORMABLE.to_owned()),
        ]
    }
}

/// A compiled file of one model.
pub(crate) fn file(source: &SourceDigest, path: &Path, options: &CompileOptions, tetgen: &str) -> Key {
    Key::new("file")
        .with("source", source.text())
        .with("format", extension(path))
        .with_all(components(options, tetgen))
        .with("mesh version", MESH)
        .with("bthc", env!("CARGO_PKG_VERSION"))
}

/// A compiled scene. `parts` numbers the objects as the manifest does, `sources` identifies the content of each used one.
pub(crate) fn scene(parts: &SceneParts, sources: &[String], options: &CompileOptions, tetgen: &str) -> Key {
    let mut hasher = HashedRows::new("scene");
    hasher.add(std::slice::from_ref(&parts.scene));
    hasher.add(&parts.nodes);
    hasher.add(&parts.instances);
    hasher.add(&parts.tracks);
    hasher.add(&parts.times);
    hasher.add(&parts.values);
    hasher.add(&parts.cameras);
    hasher.add(&parts.lights);
    hasher.add(&parts.names);
    // Without deformers nothing is added, so that the keys of such scenes are what they were before there were any.
    if !parts.deformers.deformers.is_empty() {
        hasher.add(&parts.deformers.deformers);
        hasher.add(&parts.deformers.skins);
        hasher.add(&parts.deformers.joints);
        hasher.add(&parts.deformers.weights);
    }
    let mut objects = HashedRows::new("objects");
    sources.iter().for_each(|source| objects.add(source.as_bytes()));
    Key::new("scene")
        .with("scene", hasher.finish().hex())
        .with("objects", objects.finish().hex())
        .with_all(components(options, tetgen))
        .with("mesh version", MESH)
        .with("bthc", env!("CARGO_PKG_VERSION"))
}

/// The inventory of a scene file, by the name of the file's content.
pub(crate) fn file_index(named: &Digest, options: &CompileOptions, tetgen: &str) -> Key {
    Key::new("outline")
        .with("file", named.hex())
        .with_all(components(options, tetgen))
        .with("mesh version", MESH)
        .with("outline version", OUTLINE)
        .with("bthc", env!("CARGO_PKG_VERSION"))
}

/// All options that a compiled object depends on, in canonical form, under the names that explanations of misses show. The cost profile is among them by the hash of its content.
fn components(options: &CompileOptions, tetgen: &str) -> Vec<(String, String)> {
    let mut all = vec![
        ("structure", text(&options.built_structure())),
        ("quality", text(&options.bvh.quality)),
        ("attributes", text(&options.attributes)),
        ("source geometry", options.geometry.to_string()),
        ("collapse", format!("{:?}", options.collapse.costs)),
        ("bvh version", BVH.to_owned()),
        ("collapse version", COLLAPSE.to_owned()),
        ("file version", format!("{FILE}.{}", bth_format::layout::WRITER_VERSION)),
    ];
    if options.alpha != AlphaMode::None {
        all.extend([("alpha", text(&options.alpha)), ("opacity version", OPACITY.to_owned())]);
    }
    if options.polygons != Polygons::default() {
        all.extend([("polygons", text(&options.polygons)), ("polygons version", POLYGONS.to_owned())]);
    }
    if options.deformable {
        all.extend([("deformable", "true".to_owned()), ("deformable version", DEFORMABLE.to_owned())]);
    }
    if options.motion != Default::default() {
        all.push(("motion", text(&options.motion)));
    }
    if options.names {
        all.extend([("names", "true".to_owned()), ("names version", NAMES.to_owned())]);
    }
    if options.materials {
        all.extend([("materials", "true".to_owned()), ("materials version", MATERIALS.to_owned())]);
    }
    if options.lenient_materials {
        all.push(("lenient materials", "true".to_owned()));
    }
    if options.free.keep != free::KeepFree::None {
        all.extend([
            ("free directions", text(&options.free.keep)),
            ("reach", text(&options.free.reach)),
            ("most triangles", text(&options.free.most_triangles)),
            ("row bytes", text(&options.free.row_bytes)),
            ("free directions version", FREE.to_owned()),
        ]);
    }
    if options.collapse.plan != Default::default() {
        all.push(("plan", format!("{:?}", options.collapse.plan)));
    }
    if options.coordinates != Default::default() {
        all.extend([
            ("coordinates", text(&options.coordinates)),
            ("coordinates version", COORDINATES.to_owned()),
        ]);
    }
    if options.built_structure() != Structure::Bvh {
        all.extend([
            ("tets", options.record.name().to_owned()),
            ("subtrees", options.keep_subtrees.to_string()),
            ("tetrahedralization", attempts(&options.tets)),
            ("cells", format!("{:?} from {}", options.tets.cells, options.tets.minimum)),
            ("tetgen", tetgen.to_owned()),
            ("marks version", MARKS.to_owned()),
            ("costs version", COSTS.to_owned()),
            ("tets version", TETS.to_owned()),
        ]);
    }
    // Where nodes may be tetrahedralized, the options of the selection contain both.
    if options.built_structure() == Structure::Bvh {
        all.extend(options.costs.for_scene.then(|| ("for scene", "true".to_owned())));
        all.extend(options.costs.rays.iter().map(|rays| ("rays", rays.hash())));
        // Free directions are kept within the limit.
        let limit =
            options.costs.max_bytes_per_triangle.filter(|_| options.free.keep == free::KeepFree::Auto);
        all.extend(limit.map(|limit| ("most bytes a triangle", text(&limit))));
    }
    let mut all: Vec<_> = all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    if options.built_structure() != Structure::Bvh {
        // CompileOptions are components of their own, so that an explanation names the one that differs.
        let fields = json(&options.costs);
        let fields = fields.as_object().into_iter().flatten();
        all.extend(fields.map(|(name, value)| (format!("selection {name}"), text(value))));
    }
    all
}

/// The options that the attempts at a node depend on: neither the path of the worker nor the number of workers.
fn attempts(options: &crate::tets::TetOptions) -> String {
    format!(
        "free space {}, inflation {:?}, deadline {:?} + {:?}, memory {}",
        options.free_space,
        options.inflation,
        options.deadline,
        options.deadline_per_triangle,
        options.memory
    )
}

/// The canonical text of an option: numbers with the fewest digits that parse to the same value.
fn text(value: &impl Serialize) -> String {
    match json(value) {
        serde_json::Value::String(text) => text,
        value => value.to_string(),
    }
}

fn json(value: &impl Serialize) -> serde_json::Value {
    // CompileOptions consist of numbers, strings and structures of these, which JSON can express.
    serde_json::to_value(value).unwrap_or_else(|e| unreachable!("an option that is no JSON: {e}"))
}
