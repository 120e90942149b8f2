//! A model compiled into every structure.

use bth::Scene;
use bth_compile::Silent;
use bth_compile::free::KeepFree;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_scenes::Model;

/// Name of what [`deformed`] makes.
pub const DEFORMED: &str = "deformed bvh";

/// A structure compiled from a model.
#[derive(Debug)]
pub struct Traced {
    /// Structure.
    pub name: String,
    /// Ready to trace.
    pub scene: Scene,
}

/// CompileOptions with which even small models get tet leaves wherever these are possible.
pub fn options(structure: Structure) -> CompileOptions {
    let mut options = CompileOptions { structure, ..CompileOptions::default() };
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

/// The model in every structure, the BVH first. Structures with tetrahedra are included where the
/// worker exists, and a tetrahedralization of the whole model only where `whole` is set.
pub fn every_structure(model: &Model, whole: bool) -> Vec<Traced> {
    structures_named(model, whole, |_| true)
}

/// Those of [`every_structure`] whose names are wanted; no others are compiled.
pub fn structures_named(model: &Model, whole: bool, is_wanted: impl Fn(&str) -> bool) -> Vec<Traced> {
    let bvh = options(Structure::Bvh);
    let mut free = bvh.clone();
    free.free.keep = KeepFree::All;
    let mut distances = bvh.clone();
    distances.free.keep = KeepFree::Distances;
    let mut wanted = vec![
        ("bvh".to_string(), bvh),
        ("bvh with free directions".to_string(), free),
        ("bvh with free distances".to_string(), distances),
    ];
    if crate::worker().is_some() {
        wanted.push(("bth".to_owned(), options(Structure::Bth)));
        if whole {
            wanted.push(("tets".to_owned(), options(Structure::Tets)));
        }
    }
    let wanted = wanted.into_iter().filter(|(name, _)| is_wanted(name));
    wanted.map(|(name, options)| Traced { scene: compiled(model, &options), name }).collect()
}

/// The model as a deformable object, compiled in another shape and then given the positions of the
/// model. In the other shape each point is turned about the last axis by an angle that grows along
/// it, and moved by up to a sixteenth of the model's size. The tree fits the other shape, so its
/// boxes overlap much more.
///
/// # Panics
/// If it does not compile or open, or a position is not finite.
pub fn deformed(model: &Model, seed: u64) -> Traced {
    let bounds = |fold: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|k| model.positions.iter().map(|p| p[k]).reduce(fold).expect("a vertex"))
    };
    let (least, most) = (bounds(f32::min), bounds(f32::max));
    let size = [0, 1, 2].map(|k| most[k] - least[k]).into_iter().fold(0.0, f32::max);
    let rng = &mut bth_random::Rng::new(seed);
    let other = |p: &[f32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| p[k] - (least[k] * 0.5 + most[k] * 0.5));
        let (sin, cos) = (3.0 * z / size).sin_cos();
        [x * cos - y * sin, x * sin + y * cos, z].map(|x| x + size / 16.0 * (rng.unit_f32() * 2.0 - 1.0))
    };
    let shape =
        Model { positions: model.positions.iter().map(other).collect(), triangles: model.triangles.clone() };
    let options = CompileOptions { deformable: true, ..options(Structure::Bvh) };
    let mut scene = compiled(&shape, &options);
    scene.set_positions(0, &model.positions).unwrap_or_else(|e| panic!("{e}"));
    Traced { name: DEFORMED.into(), scene }
}

/// All bits of a hit.
pub fn bits(hit: &bth::rays::Hit) -> [u32; 5] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive.instance, hit.primitive.triangle]
}
