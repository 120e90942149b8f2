//! Compilation from memory gives the files that the same triangles give through a model file.

use bth_compile::cached::Cache;
use bth_compile::coordinates::CoordinateOptions;
use bth_compile::memory::{self, Instance, PositionRows, TriangleMesh};
use bth_compile::pipeline::{self, CompileOptions, Structure};
use bth_compile::{Monitor, Silent};
use bth_format::layout::{GridBits, kind};
use bth_scenes::Model;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// A model, and one with what files may have: repeated and unused positions, triangles of no area,
/// a negative zero.
fn models() -> Vec<(&'static str, Model)> {
    let mut messy = bth_scenes::gyroid::gyroid(2000);
    let count = messy.positions.len() as u32;
    let copies: Vec<[f32; 3]> = messy.positions.iter().take(50).map(|p| p.map(|x| -(0.0 - x))).collect();
    messy.positions.extend(copies);
    messy.positions.push([1e9; 3]);
    messy.triangles.extend([[count, count + 1, count + 2], [0, 0, 5], [7, 7, 7]]);
    vec![("gyroid", bth_scenes::gyroid::gyroid(3000)), ("messy", messy)]
}

fn mesh(model: &Model) -> TriangleMesh<'_> {
    TriangleMesh { positions: PositionRows::F32(&model.positions), triangles: &model.triangles }
}

/// Options that lead through different stages, those with tetrahedra where the worker exists.
fn all_options() -> Vec<(&'static str, CompileOptions)> {
    let bvh = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let fast = CompileOptions::fast();
    let bits = CoordinateOptions { bits: Some(GridBits::B16), ..CoordinateOptions::default() };
    let grid = CompileOptions { coordinates: bits, geometry: false, ..bvh.clone() };
    let tets = bth_tests::structures::options(Structure::Bth);
    let mut all = vec![("bvh", bvh), ("fast", fast), ("grid", grid), ("default", CompileOptions::default())];
    if bth_tests::worker().is_some() {
        all.push(("tets", tets));
    }
    all
}

/// Asserts that two files are the same but for their provenance, and that both are whole.
fn assert_same(memory: &[u8], file: &[u8], what: &str) {
    let [memory, file] =
        [memory, file].map(|bytes| bth_format::File::from_bytes(bytes).expect("a compiled file"));
    assert_eq!(memory.content_id(), file.content_id(), "{what}");
    let sections = |file: &bth_format::File| {
        let kept = file.sections().filter(|s| s.entry.kind != kind::PROVENANCE);
        kept.map(|s| (s.entry.object, s.entry.kind, s.bytes.to_vec())).collect::<Vec<_>>()
    };
    assert_eq!(sections(&memory), sections(&file), "{what}");
    assert!(memory.provenance().is_some_and(|p| p.contains("\"format\":\"memory\"")), "{what}");
}

#[test]
fn the_bytes_are_those_of_a_file_with_the_same_triangles() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, model) in models() {
        let path = folder.path().join(format!("{name}.ply"));
        bth_scenes::write::file(&model, &path).expect("a model file");
        for (chosen, options) in all_options() {
            let what = format!("{name}, {chosen}");
            let (of_file, _) = pipeline::compile(&path, &options, &Silent).expect(&what);
            let (compiled, report) = pipeline::compile(mesh(&model), &options, &Silent).expect(&what);
            assert_same(&compiled.bytes, &of_file.bytes, &what);
            assert_eq!(report.mesh.triangles, model.triangles.len() as u64);
            assert_eq!(chosen == "tets", report.file.tet_leaves > 0, "{what}");
            let scene = memory::open(mesh(&model), &options, &Silent).expect(&what);
            assert_eq!(scene.file().bytes(), compiled.bytes, "{what}");
            let again = pipeline::compile(mesh(&model), &options, &Silent).expect(&what).0;
            assert_eq!(again, compiled, "{what}");
        }
    }
}

#[test]
fn the_cache_answers_the_second_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let store = bth_cache::Store::open(folder.path(), 1 << 30).expect("a cache");
    let (_, model) = models().swap_remove(0);
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let (expected, _) = pipeline::compile(mesh(&model), &options, &Silent).expect("it compiles");
    let cached = |model: &Model| {
        let cache = Cache::new(&store, "a test");
        pipeline::compile_cached(mesh(model), &options, &cache, &|_| true, &Silent).expect("it compiles")
    };
    let (first, second) = (cached(&model), cached(&model));
    assert!(first.built.is_some() && second.built.is_none());
    for outcome in [first, second] {
        let content = outcome.content.expect("the content was asked for");
        assert_eq!(content.bytes().unwrap(), expected.bytes.as_slice());
    }
    let mut other = model;
    other.positions[7][1] += 0.5;
    assert!(cached(&other).built.is_some());
}

/// Cancels after a number of questions.
struct Impatient(AtomicU32);

impl Monitor for Impatient {
    fn cancelled(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_err()
    }
}

#[test]
fn a_monitor_cancels_at_any_time() {
    let (_, model) = models().swap_remove(0);
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let mut cancelled = 0;
    for patience in 0.. {
        match pipeline::compile(mesh(&model), &options, &Impatient(patience.into())) {
            Ok(_) => break,
            Err(e) => assert!(matches!(e, bth_compile::Error::Cancelled), "{e}"),
        }
        cancelled += 1;
    }
    assert!(cancelled >= 4, "import, BVH and collapse ask: {cancelled}");
}

const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

fn at(mesh: u32, x: f64) -> Instance {
    let mut to_world = IDENTITY;
    to_world[0][3] = x;
    Instance { mesh, to_world }
}

#[test]
fn a_scene_is_that_of_a_manifest() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let models = models();
    let mut text = String::from("version = 1\nobjects = [");
    for (row, (name, model)) in models.iter().enumerate() {
        bth_scenes::write::file(model, &folder.path().join(format!("{name}.ply"))).expect("a model file");
        text += &format!("{{ name = \"mesh {row}\", model = \"{name}.ply\" }},");
    }
    text += "]\nnodes = [";
    let mut turned = at(1, -4.5);
    turned.to_world[1] = [0.0, 0.5, 2.0, 1.0 / 3.0];
    let instances = [at(1, 3.0), at(0, 0.0), turned];
    for (row, Instance { mesh, to_world }) in instances.iter().enumerate() {
        text += &format!("{{ name = \"instance {row}\", object = \"mesh {mesh}\", matrix = {to_world:?} }},");
    }
    text += "]";
    let manifest = bth_scene::parse(&text, Path::new("x.manifest")).expect("a manifest");
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let (of_files, _) =
        bth_compile::scene::compile(&manifest, folder.path(), Path::new("x"), &options, &Silent)
            .expect("it compiles");
    let meshes: Vec<_> = models.iter().map(|(_, model)| mesh(model)).collect();
    let store = bth_cache::Store::open(&folder.path().join("cache"), 1 << 30).expect("a cache");
    for cache in [Cache::none(), Cache::new(&store, "a test"), Cache::new(&store, "a test")] {
        let outcome =
            memory::compile_scene(&meshes, &instances, &options, &cache, &Silent).expect("it compiles");
        let content = outcome.content.expect("the content was asked for");
        let bytes = content.bytes().unwrap();
        assert_same(&bytes, &of_files.bytes, "a scene");
    }
    let scene = memory::open_scene(&meshes, &instances, &options, &Silent).expect("it opens");
    assert_eq!(scene.instance_count(), 3);
    assert_eq!(scene.instance(2).to_world, turned.to_world);
}

#[test]
fn errors_of_scenes_name_the_instance_or_the_mesh() {
    let (_, model) = models().swap_remove(0);
    let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
    let refused = |meshes: &[TriangleMesh<'_>], instances: &[Instance]| {
        let opened =
            memory::open_scene(meshes, instances, &options, &Silent).map(|scene| scene.instance_count());
        opened.expect_err("it is refused").to_string()
    };
    let good = mesh(&model);
    let bad = TriangleMesh { triangles: &[[0, 1, 2], [0, 1, 4_000_000]], ..good };
    let says = |text: &str, all: &[&str]| assert!(all.iter().all(|part| text.contains(part)), "{text}");
    says(&refused(&[good], &[at(0, 0.0), at(1, 0.0)]), &["instance 1", "BTH-I005", "mesh 1 of 1 meshes"]);
    says(&refused(&[good], &[at(0, f64::NAN)]), &["instance 0", "BTH-I004"]);
    says(&refused(&[good, bad], &[at(0, 0.0), at(1, 0.0)]), &["mesh 1: triangle 1: BTH-I005: index 4000000"]);
    let mut flat = at(0, 0.0);
    flat.to_world[2][2] = 0.0;
    says(&refused(&[good], &[at(0, 0.0), flat]), &["BTH-I050", "instance 1"]);
    // One of no size is invisible, and those behind it keep their numbers.
    let point = Instance { mesh: 0, to_world: [[0.0; 4]; 3] };
    let scene = memory::open_scene(&[good], &[point, at(0, 5.0)], &options, &Silent).expect("it opens");
    assert_eq!([0, 1].map(|row| scene.instance(row).visible), [false, true]);
    // A mesh that nothing shows is not read.
    let scene = memory::open_scene(&[bad, good], &[at(1, 2.0)], &options, &Silent).expect("it opens");
    assert_eq!((scene.object_count(), scene.instance_count()), (1, 1));
    assert_eq!(memory::open_scene(&[], &[], &options, &Silent).expect("it opens").instance_count(), 0);
}
