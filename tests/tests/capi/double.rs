//! Queries in double, from C.

use crate::{c_program, run};
use bth::rays::{Hit, Hit64, Ray, Ray64};
use bth::{Accept, Scene};
use bth_tests::placed_soup::placed_soup;
use std::fmt::Write;

/// Rays whose numbers f32 does not hold.
fn rays(corners: &[[[f32; 3]; 3]]) -> Vec<Ray64> {
    let assorted = bth_tests::rays::assorted(corners, 48, 31);
    let wide = assorted.into_iter().map(|ray: Ray| {
        let Ray64 { origin, direction, .. } = Ray64::from(ray);
        Ray64::new(origin.map(|x| x * (1.0 + 1e-12)), direction.map(|x| x / 3.0))
    });
    wide.collect()
}

/// Appends the fields of a hit.
fn push(line: &mut Vec<f64>, hit: &Hit64) {
    let of = hit.primitive;
    line.extend([hit.t, hit.u, hit.v, of.instance.into(), of.triangle.into()]);
}

/// The line that the C program prints for a ray.
fn expected(scene: &Scene, ray: &Ray64) -> Vec<f64> {
    let mut line = Vec::new();
    let even = |_: &Ray, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    let conditions = Accept { filter: Some(&even), ..Accept::default() };
    let numbers = |hit: Option<Hit>| hit.map_or(Hit64::MISS, |hit| scene.hit_f64(ray, &hit));
    push(&mut line, &numbers(scene.nearest(ray)));
    push(&mut line, &numbers(scene.nearest_accepted(ray, &conditions)));
    let (crossings, mut hits, mut found) = (scene.crossings(ray), Vec::new(), Vec::new());
    scene.all_hits(ray, &Accept::default(), &mut hits);
    line.extend([
        f64::from(scene.any(ray)),
        hits.len() as f64,
        crossings.count.into(),
        crossings.winding.into(),
    ]);
    let c = scene.closest_f64(ray.origin, f64::INFINITY).expect("a closest point");
    line.push(c.distance);
    line.extend(c.point);
    line.extend([
        c.u,
        c.v,
        c.primitive.instance.into(),
        c.primitive.triangle.into(),
        c.feature.code().into(),
    ]);
    line.extend([scene.signed_distance_f64(ray.origin), scene.winding_f64(ray.origin).into()]);
    line.push(scene.contains_f64(ray.origin).into());
    scene.triangles_in_sphere_f64(ray.origin, 2.0 * c.distance, &mut found);
    line.extend([found.len() as f64, found.first().map_or(u32::MAX, |first| first.triangle).into()]);
    scene.triangles_in_box_f64(c.point, c.point.map(|x| x + 1.0), &mut found);
    line.push(found.len() as f64);
    hits.iter().for_each(|hit| push(&mut line, &scene.hit_f64(ray, hit)));
    line
}

#[test]
fn a_c_program_gets_the_answers_in_double_that_rust_gets() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let Some(program) = c_program(folder.path(), "double") else { return };
    let model = bth_scenes::blob::blob(200);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let place = |x: f64| [1.0, 0.0, 0.25, x, 0.0, -1.0, 0.0, 0.0, 0.5, 0.0, 1.0 / 3.0, 0.0];
    let rays = rays(&corners);
    let mut input = String::new();
    for Ray64 { origin: [a, b, c], tmin, direction: [x, y, z], tmax } in &rays {
        writeln!(input, "{a} {b} {c} {tmin} {x} {y} {z} {tmax}").expect("a string");
    }
    for matrices in [&[][..], &[place(0.0), place(1e-9)]] {
        let file = folder.path().join("blob.bth");
        std::fs::write(&file, placed_soup(&corners, matrices)).expect("a file");
        let scene = bth::open(&file).expect("the blob opens");
        let output = run(&program, &[file.to_str().expect("UTF-8")], &input);
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8(output.stdout).expect("text");
        assert_eq!(text.lines().count(), rays.len());
        for (line, ray) in text.lines().zip(&rays) {
            let found =
                line.split_whitespace().map(|field| field.parse::<f64>().expect("a number").to_bits());
            let expected: Vec<u64> = expected(&scene, ray).into_iter().map(f64::to_bits).collect();
            assert_eq!(found.collect::<Vec<_>>(), expected, "{ray:?}: {line}");
        }
        let hits = rays.iter().filter(|ray| scene.any(*ray)).count();
        assert!(hits > 10 && hits < rays.len(), "{hits} of {} rays hit", rays.len());
    }
}
