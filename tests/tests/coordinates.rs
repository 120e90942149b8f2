//! Quantized leaves: no vertex moves farther than the file states, answers are exact for the
//! triangles as they are stored, and files are as small as documented.
#![allow(clippy::print_stdout, reason = "tests print what they skip")]

#[allow(dead_code)]
mod corpus_support;

use bth::rays::{Hit, Ray};
use bth::{Isa, Scene};
use bth_compile::coordinates::CoordinateOptions;
use bth_compile::pipeline::{Structure, compile};
use bth_compile::{Silent, pipeline};
use bth_format::File;
use bth_format::layout::GridBits;
use bth_import::{self, Keep, Mesh};
use bth_scenes::{Model, blob, knot, soup};
use bth_tests::oracle;
use bth_tests::structures::bits;
use std::path::Path;

/// A compiled file.
fn compiled(path: &Path, grid: Option<GridBits>, mut options: pipeline::CompileOptions) -> File {
    options.coordinates = CoordinateOptions { bits: grid, ..CoordinateOptions::default() };
    let (compiled, report) = compile(path, &options, &Silent).unwrap();
    assert_eq!(report.coordinates.map(|c| c.bits), grid.map(|b| b as u32));
    File::from_bytes(&compiled.bytes).unwrap()
}

fn plain() -> pipeline::CompileOptions {
    bth_tests::structures::options(Structure::Bvh)
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>().sqrt()
}

/// Every corner of every stored triangle against its source, and the share of the bytes that
/// traversal reads, places of triangles not counted.
fn check_file(path: &Path, mesh: &Mesh, grid: GridBits) -> f64 {
    let file = compiled(path, Some(grid), plain());
    let verified = bth_format::verify::verify(&file).unwrap_or_else(|e| panic!("{}: {e:?}", path.display()));
    assert_eq!(verified.compared_with_source, 1);
    let object = file.check(0).unwrap();
    let most = f64::from(object.header.displacement);
    for triangle in oracle::triangles(&object) {
        for (stored, source) in triangle.corners.into_iter().zip(mesh.corners(triangle.id)) {
            assert!(distance(stored, source) <= most, "{stored:?} {source:?} {most}");
            // Triangles that share a vertex still share it: its place on the grid depends on its
            // position alone.
            assert_eq!(stored, object.grid.unwrap().nearest(source));
        }
    }
    // Places of triangles do not depend on the coordinates.
    let bytes = |file: &File| (file.resident_bytes() - 4 * mesh.triangles.len() as u64) as f64;
    bytes(&file) / bytes(&compiled(path, None, plain()))
}

fn written(model: &Model, folder: &Path) -> std::path::PathBuf {
    let path = folder.join("model.ply");
    bth_scenes::write::file(model, &path).unwrap();
    path
}

#[test]
fn no_vertex_is_farther_from_its_source_than_the_file_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    for (i, model) in [knot::torus_knot(2000), blob::blob(2000), soup::soup(500)].iter().enumerate() {
        let folder = folder.path().join(i.to_string());
        std::fs::create_dir(&folder).unwrap();
        paths.push(written(model, &folder));
    }
    let ours = paths.len();
    if let Some(data) = corpus_support::data() {
        paths.extend(["teapot.ply", "fandisk.ply"].map(|name| data.join("static").join(name)));
    }
    for (i, path) in paths.iter().enumerate() {
        let (mesh, _) = bth_import::import(path, Keep::None, &Silent).unwrap();
        let shares = [GridBits::B21, GridBits::B16].map(|grid| check_file(path, &mesh, grid));
        // The documented sizes of closed meshes; triangles without shared vertices stay within
        // them, too.
        if i < ours {
            assert!(shares[0] <= 0.8 && shares[1] <= 0.65, "{}: {shares:?}", path.display());
        }
    }
}

#[test]
fn answers_on_a_grid_are_exact_for_the_stored_triangles_in_every_structure() {
    let folder = tempfile::tempdir().unwrap();
    for (model, whole) in [(blob::blob(400), true), (soup::soup(120), false)] {
        let path = written(&model, folder.path());
        for grid in GridBits::ALL {
            let mut structures = vec![plain()];
            if bth_tests::worker().is_some() {
                let with = |s| bth_tests::structures::options(s);
                structures.push(with(Structure::Bth));
                structures.extend(whole.then(|| with(Structure::Tets)));
            }
            for options in structures {
                let file = compiled(&path, Some(grid), options);
                bth_format::verify::verify(&file).unwrap();
                let scene = bth::from_bytes(file.bytes()).unwrap();
                check_answers(&scene);
            }
        }
    }
}

/// Returns true if two answers agree: t to one ulp, since the expected one is rounded twice, and
/// either the same triangle with u and v within the documented error, or another triangle that the
/// line crosses at the same t.
fn same(a: &Hit, b: &Hit, ray: &Ray, triangles: &[oracle::Triangle]) -> bool {
    let near = |a: f32, b: f32| (f64::from(a) - f64::from(b)).abs() <= 1.0 / f64::from(1 << 24);
    if a.t.to_bits().abs_diff(b.t.to_bits()) > 1 {
        return false;
    }
    if a.primitive == b.primitive {
        return near(a.u, b.u) && near(a.v, b.v);
    }
    let named = triangles.iter().find(|t| t.id == a.primitive.triangle);
    named
        .and_then(|t| oracle::intersection(ray, t.corners))
        .is_some_and(|at| oracle::to_f64(&at.t) as f32 == b.t)
}

/// Nearest and any hits, in batches, coherent ones too, and alone, with every instruction set,
/// against every triangle.
fn check_answers(scene: &Scene) {
    let triangles = oracle::triangles(&scene.object(0));
    let corners: Vec<_> = triangles.iter().map(|t| t.corners).collect();
    let mut rays = bth_tests::rays::assorted(&corners, 300, 5);
    // Rays with similar directions are traced in packets.
    let like = rays[0];
    rays.extend((0..128).map(|i| {
        let mut ray = like;
        ray.direction[i % 3] *= 1.0 + i as f32 * 1e-4;
        ray
    }));
    let world = oracle::World::new(scene);
    let expected: Vec<Hit> = rays.iter().map(|ray| world.hit(ray)).collect();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        let (mut hits, mut found) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        scene.batch(&rays).nearest(&mut hits);
        scene.batch(&rays).any(&mut found);
        for (i, (ray, expected)) in rays.iter().zip(&expected).enumerate() {
            assert!(same(&hits[i], expected, ray, &triangles), "{isa}: {ray:?} {:?} {expected:?}", hits[i]);
            assert_eq!(found[i], expected.is_hit(), "{isa}: {ray:?}");
            assert_eq!(bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), bits(&hits[i]), "{isa}: {ray:?}");
        }
    }
    Isa::best().choose().unwrap();
}
