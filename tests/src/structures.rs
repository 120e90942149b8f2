//! A model compiled into every structure and record.

use bth::Scene;
use bth_compile::Silent;
use bth_compile::coordinates::Boxes;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_format::layout::RecordKind;
use bth_scenes::Model;

/// A structure compiled from a model.
#[derive(Debug)]
pub struct Traced {
    /// Structure and record.
    pub name: String,
    /// Ready to trace.
    pub scene: Scene,
}

/// CompileOptions with which even small models get tet leaves wherever these are possible.
pub fn options(structure: Structure, record: RecordKind, keep_subtrees: bool) -> CompileOptions {
    let mut options = CompileOptions { structure, record, keep_subtrees, ..CompileOptions::default() };
    options.costs.minimum_triangles = 32;
    options.costs.c_tet = Some(1e-3);
    options.tets.worker = crate::worker().map(Into::into);
    options.tets.minimum = 1;
    options
}

/// Compiles a model and opens the result, with its checks.
///
/// # Panics
/// If it does not compile or open.
pub fn compiled(model: &Model, options: &CompileOptions) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).expect("a model file");
    let (compiled, _) = compile(&path, options, &Silent).unwrap_or_else(|e| panic!("{e}"));
    bth::from_bytes(&compiled.bytes).unwrap_or_else(|e| panic!("{e}"))
}

/// The model in every structure, the BVH first. Structures with tetrahedra are included where the worker exists, and a
/// tetrahedralization of the whole model only where `whole` is set.
pub fn every_structure(model: &Model, whole: bool) -> Vec<Traced> {
    let bvh = options(Structure::Bvh, RecordKind::Link32, false);
    let mut packed = bvh.clone();
    packed.coordinates.boxes = Boxes::Bytes;
    let mut wanted = vec![("bvh".to_string(), bvh), ("bvh of packed nodes".to_string(), packed)];
    if crate::worker().is_some() {
        for record in RecordKind::ALL {
            wanted.push((format!("bth {}", record.name()), options(Structure::Bth, record, false)));
            if whole {
                wanted.push((format!("tets {}", record.name()), options(Structure::Tets, record, false)));
            }
        }
        let mut with_subtrees = options(Structure::Bth, RecordKind::Link32, true);
        wanted.push(("bth with subtrees".into(), with_subtrees.clone()));
        with_subtrees.coordinates.boxes = Boxes::Bytes;
        wanted.push(("bth with subtrees of packed nodes".into(), with_subtrees));
    }
    wanted.into_iter().map(|(name, options)| Traced { scene: compiled(model, &options), name }).collect()
}

/// All bits of a hit.
pub fn bits(hit: &bth::rays::Hit) -> [u32; 5] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive.instance, hit.primitive.triangle]
}
