//! Every structure and record agrees with the exact oracle, and with each other bit for bit.

use bth::rays::{Hit, PrimitiveRef, Ray, Start, StartRay};
use bth::{Accept, Steps};
use bth_compile::pipeline::Structure;
use bth_scenes::{Model, blob::blob, gyroid::gyroid, hall::hall, knot::torus_knot, soup::soup};
use bth_tests::oracle;
use bth_tests::rays::{alone, assorted, check_batch, onward, starts};
use bth_tests::structures::{Traced, bits, compiled, every_structure, options};

type Corners = Vec<[[f32; 3]; 3]>;

fn check_against_oracle(corners: &Corners, ray: &Ray, hit: &Hit) {
    let at = |triangle: u32| oracle::intersection(ray, corners[triangle as usize]);
    check_hit(oracle::nearest(corners, ray), at, hit, &format!("{ray:?}"));
}

fn check_start_against_oracle(corners: &Corners, ray: &StartRay, hit: &Hit) {
    let at = |triangle: u32| oracle::starts::intersection(corners, ray, triangle);
    check_hit(oracle::nearest(corners, ray), at, hit, &format!("{ray:?}"));
}

fn check_hit(
    truth: Option<oracle::ExactHit<u32>>,
    at: impl Fn(u32) -> Option<oracle::Intersection>,
    hit: &Hit,
    ray: &str,
) {
    let context = || format!("{ray}: {hit:?}, exactly {truth:?}");
    let Some(truth) = &truth else {
        assert!(!hit.is_hit(), "ghost: {}", context());
        return;
    };
    assert!(hit.is_hit(), "miss: {}", context());
    let t = truth.t_f64() as f32;
    assert!(hit.t.to_bits().abs_diff(t.to_bits()) <= 1 || hit.t == t, "t: {}", context());
    let id = hit.primitive.triangle;
    if !truth.triangles.contains(&id) {
        // Another triangle at the same t but for less than the rounding of f64.
        let gap = at(id).map(|at| (oracle::to_f64(&at.t) - truth.t_f64()).abs());
        assert!(gap.is_some_and(|g| g <= truth.t_f64().abs() * 1e-12), "other triangle: {}", context());
    }
    assert!(hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0 + f32::EPSILON, "weights: {}", context());
}

fn check(model: &Model, whole: bool, ray_count: usize, seed: u64) {
    let corners: Corners = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let rays = assorted(&corners, ray_count, seed);
    let traced = every_structure(model, whole);
    let plain = &traced[0].scene;
    let mut expected = vec![Hit::MISS; rays.len()];
    plain.batch(&rays).nearest(&mut expected);
    for (ray, hit) in rays.iter().zip(&expected) {
        check_against_oracle(&corners, ray, hit);
    }
    let mut onward = onward(&expected, corners.len(), seed + 1);
    onward.extend(starts(&corners, ray_count / 2, seed + 2));
    let after = alone(plain, &onward);
    for (ray, hit) in onward.iter().zip(&after) {
        check_start_against_oracle(&corners, ray, hit);
    }
    for Traced { name, scene } in &traced {
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.batch(&rays).nearest(&mut hits);
        let mut any = vec![false; rays.len()];
        scene.batch(&rays).any(&mut any);
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!(
                bits(&hits[i]),
                bits(&expected[i]),
                "{name}: {ray:?}: {:?}, {:?}",
                hits[i],
                expected[i]
            );
            assert_eq!(any[i], expected[i].is_hit(), "{name}: any hit of {ray:?}");
            assert_eq!(
                bits(&scene.nearest(ray).unwrap_or(Hit::MISS)),
                bits(&hits[i]),
                "{name}: one ray at a time"
            );
        }
        check_batch(scene, &onward, &after, name);
        for (ray, hit) in onward.iter().zip(&after).step_by(7) {
            assert_eq!(bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), bits(hit), "{name}: {ray:?} alone");
            assert_eq!(scene.any(ray), hit.is_hit(), "{name}: any hit of {ray:?} alone");
        }
    }
}

#[test]
fn a_closed_knot_is_traced_exactly_by_every_structure() {
    check(&torus_knot(720), true, 2000, 1);
}

#[test]
fn an_organic_surface_is_traced_exactly_by_every_structure() {
    check(&gyroid(1500), true, 1500, 2);
}

#[test]
fn a_bumpy_sphere_far_from_the_origin_is_traced_exactly() {
    let mut model = blob(800);
    for p in &mut model.positions {
        *p = [p[0] + 300.0, p[1] - 700.0, p[2] + 1100.0];
    }
    check(&model, false, 1500, 3);
}

#[test]
fn scales_of_1e30_and_1e_minus_30_are_traced_exactly() {
    for scale in [1e30_f32, 1e-30] {
        let mut model = torus_knot(400);
        for p in &mut model.positions {
            *p = p.map(|x| x * scale);
        }
        check(&model, false, 800, 4);
    }
}

/// A knot far from the origin along z, on a square that is wider than it by a factor of `width`.
fn knot_on_a_plain(width: f32) -> Model {
    let mut model = torus_knot(400);
    for p in &mut model.positions {
        *p = [p[0], p[1], p[2] + 1e4];
    }
    let lowest = model.positions.iter().fold(f32::INFINITY, |least, p| least.min(p[1]));
    let first = model.positions.len() as u32;
    model.positions.extend(
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]| [x * width, lowest - 0.01, z * width]),
    );
    model.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    model
}

#[test]
fn small_things_on_a_wide_plain_are_traced_exactly() {
    for width in [1e3, 1e5, 1e7] {
        check(&knot_on_a_plain(width), false, 300, 7);
    }
}

/// Rays from about the origin have pads that allow neither for the coordinates of the plain nor of
/// the knot. Only the boxes in the file do, and rays along the sides of boxes tell whether they do.
#[test]
fn packets_to_the_corners_of_small_things_on_a_wide_plain_are_traced_exactly() {
    let mut hits_found = 0;
    for width in [1e3, 1e5, 1e7] {
        let model = knot_on_a_plain(width);
        let corners: Corners = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
        let scene = compiled(&model, &options(Structure::Bvh));
        for along_one_direction in [false, true] {
            // Rays to the corners of each triangle and next to them, triangle by triangle.
            let targets = corners.iter().take(200).flatten().flat_map(|p| {
                [
                    *p,
                    [p[0].next_up(), p[1], p[2]],
                    [p[0], p[1].next_down(), p[2]],
                    [p[0] - 1e-4, p[1] + 1e-4, p[2]],
                ]
            });
            let rays: Vec<Ray> = targets
                .map(|to| match along_one_direction {
                    // Below the smallest component of directions that boxes are tested with.
                    true => Ray::new([to[0], to[1], 0.0], [1e-9, -1e-9, 1.0]),
                    false => Ray::new([0.0; 3], to),
                })
                .collect();
            let mut hits = vec![Hit::MISS; rays.len()];
            for (rays, hits) in rays.chunks(256).zip(hits.chunks_mut(256)) {
                scene.batch(rays).nearest(hits);
            }
            for (ray, hit) in rays.iter().zip(&hits) {
                assert_eq!(bits(hit), bits(&scene.nearest(ray).unwrap_or(Hit::MISS)), "{ray:?}");
                hits_found += usize::from(hit.is_hit());
            }
            for (ray, hit) in rays.iter().zip(&hits).step_by(5) {
                check_against_oracle(&corners, ray, hit);
            }
        }
    }
    assert!(hits_found > 5_000, "{hits_found}");
}

#[test]
fn soup_that_intersects_itself_is_traced_exactly() {
    check(&soup(600), false, 1200, 5);
}

#[test]
fn a_hall_with_long_thin_triangles_is_traced_exactly() {
    check(&hall(900), false, 1200, 6);
}

/// The surface of a cube of `n` cells, with integer coordinates.
fn integer_cube(n: i32) -> Model {
    let mut model = Model::default();
    let mut rows = std::collections::BTreeMap::new();
    for axis in 0..3 {
        for (side, i, j) in [0, n].into_iter().flat_map(|s| (0..n * n).map(move |c| (s, c / n, c % n))) {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| {
                let mut p = [side; 3];
                p[(axis + 1) % 3] = i + di;
                p[(axis + 2) % 3] = j + dj;
                *rows.entry(p).or_insert_with(|| {
                    model.positions.push(p.map(|x| x as f32));
                    model.positions.len() as u32 - 1
                })
            });
            model.triangles.extend(if side == 0 { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] });
        }
    }
    model
}

#[test]
fn a_cube_of_integers_where_all_is_degenerate_is_traced_exactly() {
    check(&integer_cube(4), true, 3000, 7);
}

#[test]
fn rays_without_a_line_hit_nothing() {
    let up = [0.0, 0.0, 1.0];
    let ray = Ray::new([0.0; 3], up);
    let bad = [
        Ray { direction: [0.0; 3], ..ray },
        Ray { direction: [f32::NAN, 0.0, 1.0], ..ray },
        Ray { direction: [f32::INFINITY, 0.0, 1.0], ..ray },
        Ray { origin: [f32::NAN; 3], ..ray },
        Ray { origin: [f32::INFINITY, 0.0, 0.0], ..ray },
        Ray { tmin: f32::NAN, ..ray },
        Ray { tmax: f32::NAN, ..ray },
        Ray { tmin: 2.0, tmax: 1.0, ..ray },
        Ray { tmin: f32::INFINITY, ..ray },
        Ray { tmax: f32::NEG_INFINITY, ..ray },
    ];
    for Traced { name, scene } in &every_structure(&torus_knot(400), true) {
        for ray in &bad {
            assert_eq!(scene.nearest(ray), None, "{name}: {ray:?}");
            assert!(!scene.any(ray), "{name}: {ray:?}");
            let start = Start { primitive: PrimitiveRef { instance: 0, triangle: 0 }, u: 0.25, v: 0.25 };
            let from_start = start.ray(ray.direction).with_tmax(ray.tmax);
            // A start has an origin and a range that begins at 0.
            if from_start.direction != up || from_start.tmax.is_nan() || from_start.tmax < 0.0 {
                assert_eq!((scene.nearest(&from_start), scene.any(&from_start)), (None, false), "{name}");
            }
        }
    }
}

/// With a direction of 1e38, a hit as near as 1e-8 has a t that is reported as 0.
#[test]
fn hits_whose_t_is_rounded_to_an_end_of_the_range_are_found() {
    let model =
        Model { positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
    let corners: Corners = vec![model.corners(0)];
    for Traced { name, scene } in &every_structure(&model, false) {
        for (z, length) in [(1e-8, 3e38), (-1e-8, 3e38), (1e-30, 1e18), (-1e-30, -1e18), (1e-8, -3e38)] {
            for (tmin, tmax) in [(0.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, f32::INFINITY)] {
                let ray = Ray { origin: [0.25, 0.25, z], tmin, direction: [0.0, 0.0, -length], tmax };
                let hit = scene.nearest(&ray).unwrap_or(Hit::MISS);
                assert!(hit.is_hit() && hit.t == 0.0, "{name}: {ray:?}: {hit:?}");
                check_against_oracle(&corners, &ray, &hit);
                assert!(scene.any(&ray), "{name}: {ray:?}");
                assert_eq!(scene.count_hits(&ray, &Accept::default()), 1, "{name}: {ray:?}");
            }
        }
    }
}

#[test]
fn tets_are_really_walked_also_from_starts() {
    if bth_tests::worker().is_none() {
        return;
    }
    let model = gyroid(3000);
    let traced = every_structure(&model, true);
    let tets = &traced.iter().find(|t| t.name == "tets").expect("compiled above").scene;
    let corners: Corners = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let first = assorted(&corners, 4000, 9);
    let mut hits = vec![Hit::MISS; first.len()];
    tets.batch(&first).nearest(&mut hits);
    let (mut plain, mut from_starts, mut rays) = (Steps::default(), Steps::default(), 0);
    for (ray, onward) in first.iter().zip(onward(&hits, corners.len(), 10)) {
        plain += tets.nearest_counted(ray).1;
        from_starts += tets.nearest_counted(&onward).1;
        rays += 1;
    }
    assert!(plain.cells > 0 && from_starts.cells > 0, "{plain:?} {from_starts:?}");
    assert_eq!((plain.nodes, from_starts.nodes), (0, 0), "{plain:?} {from_starts:?}");
    assert!(from_starts.cells < plain.cells, "{from_starts:?} {plain:?}");
    assert!(from_starts.floods * 3 < rays, "most rays need no exact fall-back: {from_starts:?} of {rays}");
}
