//! Rays that start on surfaces, from C.

use crate::{c_program, lines_of, run};
use bth::Scene;
use bth::rays::{Hit, PrimitiveRef, Ray, Start};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, compile};

/// The direction of ray `i` in `starts.c`.
fn direction(i: usize) -> [f32; 3] {
    let i = i as i32;
    [i * 7 % 13 - 6, i * 5 % 11 - 5, i * 3 % 17 - 8].map(|x| x as f32)
}

/// Traces rays from `starts`, and makes their hits the next starts. Returns the lines that
/// `starts.c` prints.
fn bounce(scene: &Scene, starts: &mut [Start], tmax: impl Fn(usize) -> f32) -> Vec<String> {
    let each = starts.iter_mut().enumerate().map(|(i, start)| {
        let ray = start.ray(direction(i)).with_tmax(tmax(i));
        let hit = scene.nearest(&ray).unwrap_or(Hit::MISS);
        *start = hit.start();
        let Hit { t, u, v, primitive: PrimitiveRef { instance, triangle } } = hit;
        format!("{t} {u} {v} {instance} {triangle} {}", u8::from(scene.any(&ray)))
    });
    each.collect()
}

/// A line of the C program with its numbers as Rust prints them.
fn as_rust(line: &str) -> String {
    let fields = line.split(' ').enumerate().map(|(k, field)| match k {
        0..3 => field.parse::<f32>().expect("a number").to_string(),
        _ => field.to_owned(),
    });
    fields.collect::<Vec<_>>().join(" ")
}

#[test]
fn a_c_program_traces_bounces_by_starts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "starts") else { return };
    let model = bth_scenes::knot::torus_knot(2880);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let path = folder.path().join("knot.ply");
    bth_scenes::write::file(&model, &path).expect("a model");
    let structure = bth_compile::pipeline::Structure::Bvh;
    let options = CompileOptions { structure, ..CompileOptions::default() };
    let (compiled, _) = compile(&path, &options, &Silent).expect("the knot compiles");
    let file = folder.path().join("knot.bth");
    std::fs::write(&file, &compiled.bytes).expect("a file");
    let scene = bth::open(&file).expect("the knot opens");

    let mut rays: Vec<Ray> = bth_tests::rays::assorted(&corners, 64, 23);
    let is_hit = |ray: &Ray| scene.nearest(ray).is_some();
    let first = rays.iter().position(is_hit).expect("a ray that hits");
    rays.swap(0, first);
    rays.truncate(16);
    let output = run(&program, &[file.to_str().expect("UTF-8")], &lines_of(&rays));
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut lines = text.lines();

    let hits: Vec<_> = rays.iter().map(|ray| scene.nearest(ray).unwrap_or(Hit::MISS)).collect();
    for count in [0, 1, 5, 3000] {
        let mut starts: Vec<_> = (0..count).map(|i| hits[i % hits.len()].start()).collect();
        let mut expected = bounce(&scene, &mut starts, |_| f32::INFINITY);
        expected.extend(bounce(&scene, &mut starts, |i| if i % 3 == 0 { 0.01 } else { f32::INFINITY }));
        let found: Vec<_> = lines.by_ref().take(expected.len()).map(as_rust).collect();
        assert_eq!(found, expected, "{count}");
        assert!(count < 3000 || starts.iter().filter(|start| **start != Start::NONE).count() > 100);
    }
    let bad = [
        (9, 0, 0.0, 0.0),
        (0, 1_000_000, 0.0, 0.0),
        (0, 0, -0.5, 0.5),
        (0, 0, 0.75, 0.5),
        (0, 0, f32::NAN, 0.0),
        (u32::MAX, u32::MAX, 0.0, 0.0),
    ];
    for (instance, triangle, u, v) in bad {
        let start = Start { primitive: PrimitiveRef { instance, triangle }, u, v };
        let error = scene.check_start(&start).expect_err("not a point of a surface").to_string();
        assert_eq!(lines.next(), Some(format!("bth_check_start: {error}").as_str()));
    }
    let hidden = lines.next().expect("what is said about a hidden instance");
    assert!(hidden.contains("BTH-S008") && hidden.contains("instance 0, which is hidden"), "{hidden}");
    assert_eq!(lines.next(), None);
}
