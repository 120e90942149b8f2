//! Positions in f64, from models and arrays to files.

use bth::rays::PrimitiveRef;
use bth_compile::memory::{self, PositionRows, TriangleMesh};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_compile::scene;
use bth_compile::{Error, Silent};
use bth_format::File;
use bth_format::verify::verify;
use bth_import::Positions;
use bth_tests::oracle;
use std::path::Path;

/// National coordinates.
const AWAY: [f64; 3] = [5.5e6, 4.2e5, 300.0];

fn options(positions: Positions) -> CompileOptions {
    CompileOptions { structure: Structure::Bvh, positions, ..CompileOptions::default() }
}

/// A closed surface far away, with a triangle that has an area in f64 only, and one without.
fn far_model() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let model = bth_scenes::gyroid::gyroid(3000);
    let place = |p: &[f32; 3]| [0, 1, 2].map(|k| AWAY[k] + f64::from(p[k]) * 1.1);
    let mut positions: Vec<_> = model.positions.iter().map(place).collect();
    let mut triangles = model.triangles;
    let first = positions.len() as u32;
    let bent = 2.0 + 1.0 / (1u64 << 30) as f64;
    for [x, y] in [[0.0, 0.0], [1.0, 1.0], [2.0, bent], [2.0, 2.0]] {
        positions.push([AWAY[0] + x, AWAY[1] + y, AWAY[2]]);
    }
    triangles.extend([[first, first + 1, first + 2], [first, first + 1, first + 3]]);
    (positions, triangles)
}

fn obj(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> String {
    let vertices = positions.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    vertices.chain(faces).collect()
}

/// Verifies a file, and that it has the corners of these triangles, bit for bit.
#[track_caller]
fn assert_exact(bytes: &[u8], positions: &[[f64; 3]], triangles: &[[u32; 3]]) {
    let file = File::from_bytes(bytes).unwrap();
    verify(&file).unwrap_or_else(|errors| panic!("{}", errors[0]));
    let view = file.object(0).unwrap();
    for (id, triangle) in (0u32..).zip(triangles) {
        let expected = triangle.map(|v| positions[v as usize].map(f64::to_bits));
        assert_eq!(view.exact.corners(id).map(|c| c.map(|p| p.map(f64::to_bits))), Some(expected));
    }
    assert_eq!(view.exact.corners(triangles.len() as u32), None);
    let all = oracle::exact_triangles(&view);
    assert_eq!(all.len() as u32, view.header.triangles - view.header.dropped);
    assert!(all.iter().all(|(id, corners)| view.exact.corners(*id) == Some(*corners)));
    assert_eq!(view.header.dropped, 1);
    assert!(view.bounds.greatest < 8.0, "{:?}", view.bounds);
}

#[test]
fn models_and_arrays_in_f64_give_the_same_file_with_all_their_digits() {
    let (positions, triangles) = far_model();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.obj");
    std::fs::write(&path, obj(&positions, &triangles)).unwrap();
    let mesh = TriangleMesh { positions: PositionRows::F64(&positions), triangles: &triangles };
    let (of_file, report) = compile(&path, &options(Positions::Auto), &Silent).unwrap();
    assert!(report.mesh.rounding.is_none());
    assert!(report.mesh.avoided_rounding.is_some_and(|avoided| avoided.triangles > 100));
    assert_exact(&of_file.bytes, &positions, &triangles);
    let id = |bytes: &[u8]| File::from_bytes(bytes).unwrap().content_id();
    let of_arrays = compile(mesh, &options(Positions::F64), &Silent).unwrap().0;
    assert_eq!(id(&of_file.bytes), id(&of_arrays.bytes));
    // Without the geometry of the source, which exact positions need.
    let bare = CompileOptions { geometry: false, ..options(Positions::Auto) };
    assert_eq!(id(&compile(mesh, &bare, &Silent).unwrap().0.bytes), id(&of_file.bytes));
    // A scene of one instance.
    let instance = memory::Instance {
        mesh: 0,
        to_world: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    };
    let cache = bth_compile::cached::Cache::none();
    let scene =
        memory::compile_scene(&[mesh], &[instance], &options(Positions::Auto), &cache, &Silent).unwrap();
    assert_exact(&scene.content.unwrap().bytes().unwrap(), &positions, &triangles);
}

#[test]
fn f64_costs_at_most_24_bytes_a_triangle() {
    let (positions, triangles) = far_model();
    let of = |positions, rows: PositionRows<'_>| {
        let mesh = TriangleMesh { positions: rows, triangles: &triangles };
        compile(mesh, &options(positions), &Silent).unwrap().0.bytes.len()
    };
    // Near the origin, where f32 drops nothing.
    let near: Vec<[f32; 3]> = positions.iter().map(|p| [0, 1, 2].map(|k| (p[k] - AWAY[k]) as f32)).collect();
    let more = of(Positions::Auto, PositionRows::F64(&positions)) as f64
        - of(Positions::F32, PositionRows::F32(&near)) as f64;
    assert!(more / (triangles.len() as f64) < 24.0, "{more} bytes for {} triangles", triangles.len());
}

#[test]
fn arrays_whose_numbers_are_f32_keep_their_bytes() {
    let model = bth_scenes::gyroid::gyroid(1000);
    let long: Vec<[f64; 3]> = model.positions.iter().map(|p| p.map(f64::from)).collect();
    let of = |positions, rows: PositionRows<'_>| {
        let mesh = TriangleMesh { positions: rows, triangles: &model.triangles };
        let bytes = compile(mesh, &options(positions), &Silent).unwrap().0.bytes;
        File::from_bytes(&bytes).unwrap().content_id()
    };
    let expected = of(Positions::F32, PositionRows::F32(&model.positions));
    for positions in [Positions::Auto, Positions::F32, Positions::F64] {
        assert_eq!(of(positions, PositionRows::F64(&long)), expected, "{positions:?}");
        assert_eq!(of(positions, PositionRows::F32(&model.positions)), expected, "{positions:?}");
    }
}

#[test]
fn what_excludes_f64_is_an_error_only_where_f64_is_asked_for() {
    let (positions, triangles) = far_model();
    let mesh = TriangleMesh { positions: PositionRows::F64(&positions), triangles: &triangles };
    let excluded = |positions| {
        let bits = bth_compile::coordinates::CoordinateOptions {
            bits: Some(bth_format::layout::GridBits::B21),
            ..Default::default()
        };
        let free =
            bth_compile::free::FreeOptions { keep: bth_compile::free::KeepFree::All, ..Default::default() };
        [
            CompileOptions { deformable: true, ..options(positions) },
            CompileOptions { coordinates: bits, ..options(positions) },
            CompileOptions { free, ..options(positions) },
        ]
    };
    for options in excluded(Positions::F64) {
        let error = compile(mesh, &options, &Silent).unwrap_err();
        assert!(matches!(error, Error::Limit { code: "BTH-L033", .. }), "{error}");
    }
    for options in excluded(Positions::Auto) {
        let (compiled, report) = compile(mesh, &options, &Silent).unwrap();
        assert!(File::from_bytes(&compiled.bytes).unwrap().object(0).unwrap().exact.is_empty());
        assert!(report.mesh.rounding.is_some_and(|rounding| rounding.triangles > 100));
    }
}

#[test]
fn positions_that_are_kept_by_the_cache_come_back() {
    let (positions, triangles) = far_model();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("far.obj");
    std::fs::write(&path, obj(&positions, &triangles)).unwrap();
    let store = bth_cache::Store::open(&folder.path().join("cache"), 1 << 30).unwrap();
    let run = |path: &Path, options: &CompileOptions| {
        let cache = bth_compile::cached::Cache::new(&store, "far");
        let compiled =
            bth_compile::pipeline::compile_cached(path, options, &cache, &|_| true, &Silent).unwrap();
        (compiled.content.unwrap().bytes().unwrap().into_owned(), compiled.built.is_none())
    };
    let (first, was_cached) = run(&path, &options(Positions::Auto));
    assert!(!was_cached);
    assert_eq!(run(&path, &options(Positions::Auto)), (first.clone(), true));
    // Another quality takes the mesh from the cache.
    let fast =
        bth_compile::bvh::BvhOptions { quality: bth_compile::bvh::Quality::Fast, ..Default::default() };
    let (again, _) = run(&path, &CompileOptions { bvh: fast, ..options(Positions::Auto) });
    assert_exact(&again, &positions, &triangles);
    let (rounded, _) = run(&path, &options(Positions::F32));
    assert!(File::from_bytes(&rounded).unwrap().object(0).unwrap().exact.is_empty());
}

#[test]
fn each_object_of_a_scene_decides_for_itself_and_transforms_are_f64() {
    let (positions, triangles) = far_model();
    let near: Vec<_> = positions.iter().map(|p| [0, 1, 2].map(|k| p[k] - AWAY[k])).collect();
    let folder = tempfile::tempdir().unwrap();
    for (name, positions) in [("far.obj", &positions), ("near.obj", &near)] {
        std::fs::write(folder.path().join(name), obj(positions, &triangles)).unwrap();
    }
    let away = [5_500_000.1, 420_000.3, -7e-9];
    let text = format!(
        "version = 1\n[[objects]]\nname = \"far\"\nmodel = \"far.obj\"\n[[objects]]\nname = \"near\"\nmodel = \"near.obj\"\n\
         [[nodes]]\nname = \"a\"\nobject = \"far\"\n[[nodes]]\nname = \"b\"\nobject = \"near\"\ntranslation = {away:?}\n"
    );
    let manifest = bth_scene::parse(&text, Path::new("s.manifest")).unwrap();
    let (compiled, report) =
        scene::compile(&manifest, folder.path(), Path::new("s.manifest"), &options(Positions::Auto), &Silent)
            .unwrap();
    let file = File::from_bytes(&compiled.bytes).unwrap();
    verify(&file).unwrap_or_else(|errors| panic!("{}", errors[0]));
    let is_exact = [0, 1].map(|object| !file.object(object).unwrap().exact.is_empty());
    assert_eq!(is_exact, [true, false]);
    let of_report = |k: usize| (report.objects[k].avoided_rounding.is_some(), report.objects[k].rounding);
    assert_eq!([0, 1].map(of_report), [(true, None), (false, None)]);
    assert_eq!(file.scene().unwrap().nodes[1].transform[..3], away);
    let scene = bth::from_bytes(&compiled.bytes).expect("the scene");
    let corners = triangles[0].map(|v| positions[v as usize]);
    assert_eq!(scene.triangle(PrimitiveRef { instance: 0, triangle: 0 }), Some(corners));
}
