//! Keys of compiled files and objects: everything that they depend on, and never paths, times,
//! numbers of threads or the order of arguments. Options are taken apart by patterns that name
//! every field, so that a new option cannot be forgotten.

use super::choose_nodes::ChooseNodes;
use super::free_directions::FindFree;
use super::import::Import;
use super::marks::Mark;
use super::moving::BuildPoses;
use super::object::Collapse;
use super::parts::BuildInParts;
use super::place::PlaceOnGrid;
use super::tetrahedralize::Tetrahedralize;
use super::tree::BuildTree;
use crate::bvh::BvhOptions;
use crate::cached::{CachedNodes, HashedRows, MeshSummary, Sink, fields, text};
use crate::options::{CompileOptions, Structure};
use crate::source::{SourceDigest, extension};
use crate::stage::Stage;
use crate::tets::TetOptions;
use crate::write::{DeformerParts, SceneParts};
use bth_cache::Key;
use bth_files::Digest;
use bth_import::TRIANGLES_AT_ONCE;
use std::path::Path;

/// Version of compiled files.
const FILE: &str = "8";
/// Version of how objects are compiled whose vertices move by themselves.
pub(crate) const MOTION: &str = BuildPoses::VERSION;

/// A compiled file of one model.
pub(super) fn file(source: &SourceDigest, path: &Path, options: &CompileOptions, tetgen: &str) -> Key {
    Key::new("file")
        .with("source", source.text())
        .with("format", extension(path))
        .with_all(components(options, tetgen))
}

/// A compiled scene. `parts` numbers the objects as the manifest does, `sources` identifies the
/// content of each used one, `nodes` is a hash of the rows of nodes, which are not in `parts`.
pub(crate) fn scene(
    parts: &SceneParts,
    nodes: Digest,
    sources: &[String],
    options: &CompileOptions,
    tetgen: &str,
) -> Key {
    let SceneParts { scene, nodes: _, instances, tracks, times, values, cameras, lights, names, deformers } =
        parts;
    let DeformerParts { deformers, skins, joints, weights } = deformers;
    let mut hasher = HashedRows::new("scene");
    hasher.add(std::slice::from_ref(scene));
    hasher.add(instances);
    hasher.add(tracks);
    hasher.add(times);
    hasher.add(values);
    hasher.add(cameras);
    hasher.add(lights);
    hasher.add(names);
    hasher.add(deformers);
    hasher.add(skins);
    hasher.add(joints);
    hasher.add(weights);
    let mut objects = HashedRows::new("objects");
    sources.iter().for_each(|source| objects.add(source.as_bytes()));
    Key::new("scene")
        .with("scene", hasher.finish().hex())
        .with("nodes", nodes.hex())
        .with("objects", objects.finish().hex())
        .with_all(components(options, tetgen))
}

/// The keys of a scene's objects; the components that all of them share are made once.
pub(crate) struct ObjectKeys(Vec<(String, String)>);

impl ObjectKeys {
    pub(crate) fn new(options: &CompileOptions, tetgen: &str) -> Self {
        Self(components(options, tetgen))
    }

    /// The key of an object, which is posed by a clip of the scene or by none.
    pub(crate) fn of(&self, mesh: &MeshSummary, clip: Option<&Digest>) -> Key {
        let MeshSummary { report: _, geometry, parts } = mesh;
        Key::new("object")
            .with("geometry", geometry.hex())
            .with_all(parts.iter().map(|(name, hash)| (name, hash.hex())))
            .with_all(clip.iter().map(|clip| ("clip", clip.hex())))
            .with_all(self.0.iter().cloned())
    }
}

/// All options and versions that a compiled object depends on, in canonical form, under the names
/// that explanations of misses show.
fn components(options: &CompileOptions, tetgen: &str) -> Vec<(String, String)> {
    let CompileOptions {
        structure: _,
        attributes,
        polygons,
        positions,
        alpha,
        names,
        materials,
        lenient_materials,
        coordinates,
        // Both trees keep triangles of zero area if the object is deformable.
        bvh: BvhOptions { quality, keep_zero_area: _ },
        free,
        costs,
        tets,
        geometry,
        deformable,
        motion,
        part_triangles,
        // The result does not depend on it.
        objects_memory: _,
    } = options;
    let structure = options.built_structure();
    let mut all = vec![
        ("structure", text(&structure)),
        ("attributes", text(attributes)),
        ("polygons", text(polygons)),
        ("positions", text(positions)),
        ("alpha", text(alpha)),
        ("names", names.to_string()),
        ("materials", materials.to_string()),
        ("lenient materials", lenient_materials.to_string()),
        ("quality", text(quality)),
        ("source geometry", geometry.to_string()),
        ("deformable", deformable.to_string()),
        ("mesh version", Import::VERSION.to_owned()),
        ("coordinates version", PlaceOnGrid::VERSION.to_owned()),
        ("bvh version", BuildTree::VERSION.to_owned()),
        ("parts version", BuildInParts::VERSION.to_owned()),
        ("poses version", BuildPoses::VERSION.to_owned()),
        ("free directions version", FindFree::VERSION.to_owned()),
        ("collapse version", Collapse::VERSION.to_owned()),
        ("file version", format!("{FILE}.{}", bth_format::layout::WRITER_VERSION)),
        ("bthc", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    if *part_triangles != TRIANGLES_AT_ONCE {
        all.push(("triangles of parts", part_triangles.to_string()));
    }
    if structure != Structure::Bvh {
        let TetOptions { cells, minimum, .. } = tets;
        all.extend([
            ("tetrahedralization", CachedNodes::attempts(tets)),
            ("cells", format!("{cells:?} from {minimum}")),
            ("tetgen", tetgen.to_owned()),
            ("marks version", Mark::VERSION.to_owned()),
            ("costs version", ChooseNodes::VERSION.to_owned()),
            ("tets version", Tetrahedralize::VERSION.to_owned()),
        ]);
    }
    let mut all: Vec<_> = all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    all.extend(fields("coordinates", coordinates));
    all.extend(fields("free", free));
    all.extend(fields("motion", motion));
    all.extend(fields("selection", costs));
    all
}
