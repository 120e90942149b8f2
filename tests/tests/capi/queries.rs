//! Queries beyond the first hit, from C.

use crate::{c_program, lines_of, run};
use bth::Accept;
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, compile};

#[test]
fn a_c_program_gets_several_hits_under_conditions() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "hits") else { return };
    let model = bth_scenes::knot::torus_knot(720);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let path = folder.path().join("knot.ply");
    bth_scenes::write::file(&model, &path).expect("a model");
    let options = bth_compile::pipeline::Structure::Bvh;
    let options = CompileOptions { structure: options, ..CompileOptions::default() };
    let (compiled, _) = compile(&path, &options, &Silent).expect("the knot compiles");
    let file = folder.path().join("knot.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let scene = bth::open(&file).expect("the knot opens");

    let rays: Vec<Ray> = bth_tests::rays::assorted(&corners, 16, 22);
    let output = run(&program, &[file.to_str().expect("UTF-8")], &lines_of(&rays));
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();
    let even = |_: &Ray, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    let everything = Accept::default();
    let mut counts = String::new();
    for accept in [everything, Accept { filter: Some(&even), ..everything }] {
        for ray in &rays {
            let mut hits = Vec::new();
            scene.all_hits(ray, &accept, &mut hits);
            let first = hits.first().copied().unwrap_or(Hit::MISS);
            let field: Vec<&str> = lines.next().expect("a line for each ray").split(' ').collect();
            let number = |i: usize| field[i].parse::<f32>().expect("a number").to_bits();
            assert_eq!(field[0], u8::from(!hits.is_empty()).to_string());
            assert_eq!(field[1], hits.len().to_string());
            assert_eq!(number(2), first.t.to_bits(), "{ray:?}");
            assert_eq!(field[3], first.primitive.triangle.to_string(), "{ray:?}");
            assert_eq!(field.len(), 4 + 5 * hits.len(), "{ray:?}");
            for (i, hit) in hits.iter().enumerate() {
                let at = 4 + 5 * i;
                assert_eq!(
                    [number(at), number(at + 1), number(at + 2)],
                    [hit.t, hit.u, hit.v].map(f32::to_bits)
                );
                assert_eq!(field[at + 3], hit.primitive.instance.to_string());
                assert_eq!(field[at + 4], hit.primitive.triangle.to_string());
            }
            if accept.filter.is_none() {
                counts += &format!("{} ", hits.len());
            }
        }
    }
    let none = "0 ".repeat(rays.len());
    assert_eq!(lines.collect::<Vec<_>>(), [none.as_str(), &counts, &counts]);
}

#[test]
fn a_c_program_counts_crossings_and_finds_points_inside() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "inside") else { return };
    let mut model = bth_scenes::Model::default();
    // Two tetrahedra, one in the other, whose vertices lie on the grid.
    for size in [8.0, 2.0] {
        let first = model.positions.len() as u32;
        model.positions.extend([[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]]);
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        model.triangles.extend(faces.map(|face: [u32; 3]| face.map(|v| first + v)));
    }
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(&model, &path).expect("a model");
    let options =
        CompileOptions { structure: bth_compile::pipeline::Structure::Bvh, ..CompileOptions::default() };
    let (compiled, _) = compile(&path, &options, &Silent).expect("the model compiles");
    let file = folder.path().join("model.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let out = run(&program, &[file.to_str().expect("UTF-8")], "3 2 1\n0.5 0.5 0.5\n0 0 0\n8 0 0\n-1 2 2\n");
    assert!(out.status.success(), "{out:?}");
    let expected = "1 1 1 1\n2 1 2 2\n2 1 2 2\n0 0 0 0\n0 0 0 0\n";
    assert_eq!(String::from_utf8_lossy(&out.stdout), expected);
}

#[test]
fn a_c_program_finds_the_closest_points_that_rust_finds() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "closest") else { return };
    let model = bth_scenes::blob::blob(200);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let file = folder.path().join("blob.bth");
    std::fs::write(&file, bth_tests::placed_soup::placed_soup(&corners, &[])).expect("a file");
    let scene = bth::open(&file).expect("the blob opens");
    let mut points: Vec<[f32; 3]> = corners.iter().step_by(20).map(|t| t[0].map(|x| x * 0.5)).collect();
    points.extend([corners[0][1], [7.0, -2.0, 0.5], [0.0; 3]]);
    points.truncate(16);
    let input: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let output = run(&program, &[file.to_str().expect("UTF-8")], &input);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    assert_eq!(text.lines().count(), points.len());
    let mut found = Vec::new();
    for (line, point) in text.lines().zip(&points) {
        let c = scene.closest(*point, f32::INFINITY).expect("a closest point");
        let [x, y, z] = c.point;
        let signed = scene.signed_distance(*point);
        assert_eq!((signed.abs(), signed < 0.0), (c.distance, scene.contains(*point) && c.distance > 0.0));
        scene.triangles_in_sphere(*point, c.distance, &mut found);
        let (near, first) = (found.len(), found[0].triangle);
        scene.triangles_in_box(c.point, c.point, &mut found);
        let field: Vec<&str> = line.split(' ').collect();
        let numbers: Vec<f32> =
            [0, 1, 2, 3, 4, 5, 9].iter().map(|&i| field[i].parse().expect("a number")).collect();
        assert_eq!(numbers, [c.distance, x, y, z, c.u, c.v, signed], "{point:?}");
        let rest = [c.primitive.instance, c.primitive.triangle, c.feature.code(), near as u32, first];
        let rest = rest.into_iter().chain([found.len() as u32]).map(|n| n.to_string());
        assert!(rest.eq([6, 7, 8, 10, 11, 12].map(|i| field[i].to_owned())), "{line}");
    }
}

/// The mesh of `compile.c`.
pub(crate) fn hills() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    const SIDE: u32 = 40;
    let grid = |side: u32| (0..side).flat_map(move |y| (0..side).map(move |x| (x, y)));
    let positions = grid(SIDE).map(|(x, y)| [x as f32, y as f32, (x * y % 7) as f32 / 8.0]).collect();
    let faces = grid(SIDE - 1).map(|(x, y)| y * SIDE + x);
    let triangles =
        faces.flat_map(|at| [[at, at + 1, at + SIDE], [at + 1, at + SIDE + 1, at + SIDE]]).collect();
    (positions, triangles)
}
