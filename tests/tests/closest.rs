//! Closest points agree with the exact oracle, whatever the shape of triangles, the scale, the
//! structure and the instruction set. `points.rs` has instances and points of f64.

use bth::rays::PrimitiveRef;
use bth::{Closest, Feature, Isa, Scene};
use bth_random::Rng;
use bth_scenes::{blob::blob, gyroid::gyroid, hall::hall, knot::torus_knot};
use bth_tests::oracle::{is_root_within, overlaps_box, squared_distance, to_f64};
use bth_tests::placed_soup::placed_soup;
use bth_tests::structures::{Traced, every_structure};

type Corners = [[f32; 3]; 3];

/// The bound that the documentation of `Closest::distance` states, in hundredths of a unit in the
/// last place.
const UNITS: (u32, u32) = (55, 100);

fn unit(rng: &mut Rng) -> f32 {
    rng.unit_f32() * 2.0 - 1.0
}

fn mix(corners: &Corners, weights: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| (0..3).map(|c| corners[c][k] * weights[c]).sum())
}

/// A point on a triangle: a corner, a point of an edge, or any.
fn on_triangle(rng: &mut Rng, corners: &Corners) -> [f32; 3] {
    let (u, v) = (rng.unit_f32(), rng.unit_f32());
    match rng.below(4) {
        0 => corners[rng.below(3) as usize],
        1 => mix(corners, [0.5, 0.5, 0.0]),
        2 => mix(corners, [0.0, 1.0 - u, u]),
        _ => mix(corners, [1.0 - u, u * (1.0 - v), u * v]),
    }
}

/// Triangles of all shapes: large and small, needles, slivers, without area, on a coarse grid,
/// sharing vertices.
fn hostile_triangles(rng: &mut Rng, count: usize, scale: f32) -> Vec<Corners> {
    let mut triangles: Vec<Corners> = Vec::new();
    for i in 0..count {
        let size = [1.0, 1e-3, 1e-6, 1.0, 0.1][rng.below(5) as usize];
        let middle = [(); 3].map(|()| unit(rng));
        let coarse = rng.below(3) == 0;
        let mut corners = [(); 3].map(|()| {
            let p = middle.map(|x| x + unit(rng) * size);
            p.map(|x| if coarse { (x * 4.0).round() / 4.0 } else { x })
        });
        match rng.below(8) {
            0 => corners[2] = [0, 1, 2].map(|k| corners[0][k] + (corners[1][k] - corners[0][k]) * 1e-4),
            1 => corners[2] = mix(&corners, [0.5, 0.5, 1e-6]),
            2 => corners[2] = corners[1],
            3 => corners = [corners[0]; 3],
            4 => corners[2] = mix(&corners, [0.25, 0.75, 0.0]),
            5 if i > 0 => {
                let other = triangles[rng.below(i as u64) as usize].map(|p| p.map(|x| x / scale));
                corners[0] = other[1];
                corners[1] = other[0];
            }
            6 => corners.iter_mut().for_each(|p| p[2] = 0.25),
            _ => {}
        }
        triangles.push(corners.map(|p| p.map(|x| x * scale)));
    }
    triangles
}

fn hostile_point(rng: &mut Rng, triangles: &[Corners], scale: f32) -> [f32; 3] {
    let triangle = rng.below(triangles.len() as u64) as usize;
    let at = on_triangle(rng, &triangles[triangle]);
    let offset = [0.0, 0.0, 1e-7, 1e-4, 1.0, 100.0, 1e6][rng.below(7) as usize];
    let axis = rng.below(4) as usize;
    let moved = [0, 1, 2].map(|k| {
        let factor = if axis == 3 || axis == k { 1.0 } else { 0.0 };
        at[k] + unit(rng) * offset * factor * scale
    });
    moved.map(|x| x.clamp(-1e38, 1e38))
}

/// Checks a result against all triangles, given by their corners and ids.
fn check(point: [f32; 3], triangles: &[Corners], found: Option<Closest>) {
    let exact: Vec<_> = triangles.iter().map(|t| squared_distance(point, *t)).collect();
    let least = exact.iter().min().expect("a triangle");
    let found = found.unwrap_or_else(|| panic!("nothing is found from {point:?}"));
    let context = || format!("{point:?}: {found:?}, exactly {}", to_f64(least).sqrt());
    assert!(is_root_within(least, found.distance, UNITS), "distance: {}", context());
    let id = found.primitive.triangle as usize;
    assert!(is_root_within(&exact[id], found.distance, UNITS), "another triangle: {}", context());
    check_point(point, &triangles[id], &found);
}

/// Checks point, weights and feature of a result.
fn check_point(point: [f32; 3], corners: &Corners, found: &Closest) {
    let context = || format!("{point:?}, {corners:?}: {found:?}");
    let (u, v) = (f64::from(found.u), f64::from(found.v));
    assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 1e-7, "weights: {}", context());
    let weights = [1.0 - u - v, u, v];
    let greatest = corners.iter().flatten().chain(&point).fold(0.0f64, |m, x| m.max(f64::from(x.abs())));
    // Roundings of the reported point and of the weights to f32.
    let rounding = greatest * 4e-7 + 1e-44;
    let mut squared = 0.0;
    for k in 0..3 {
        let x: f64 = (0..3).map(|c| weights[c] * f64::from(corners[c][k])).sum();
        let at = f64::from(found.point[k]);
        assert!((x - at).abs() <= rounding, "weights do not lead to the point: {}", context());
        squared += (at - f64::from(point[k])).powi(2);
    }
    let distance = f64::from(found.distance);
    assert!((squared.sqrt() - distance).abs() <= 2.0 * rounding, "point: {}", context());
    match found.feature {
        Feature::Face => {}
        Feature::Edge(i) => assert_eq!(weights[(usize::from(i) + 2) % 3].max(1e-7), 1e-7, "{}", context()),
        Feature::Vertex(i) => assert_eq!(found.point, corners[usize::from(i)], "{}", context()),
    }
}

/// All bits of a result.
fn bits(found: Option<Closest>) -> Option<([u32; 6], [u32; 3])> {
    found.map(|c| {
        let [x, y, z] = c.point;
        let numbers = [c.distance, x, y, z, c.u, c.v].map(f32::to_bits);
        (numbers, [c.primitive.instance, c.primitive.triangle, c.feature.code()])
    })
}

/// The results for points one by one and as a batch, which must agree with any instruction set, and
/// for limited radii.
fn all_ways(scene: &Scene, points: &[[f32; 3]]) -> Vec<Option<Closest>> {
    let mut expected = vec![None; points.len()];
    let mut batch = vec![None; points.len()];
    let before = Isa::chosen();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("available");
        for (point, expected) in points.iter().zip(&mut expected) {
            let found = scene.closest(*point, f32::INFINITY);
            if isa == Isa::Scalar {
                *expected = found;
            }
            assert_eq!(bits(found), bits(*expected), "{isa}: {point:?}");
            let distance = found.map_or(f32::INFINITY, |c| c.distance);
            assert_eq!(bits(scene.closest(*point, distance)), bits(found), "within the distance: {point:?}");
            if distance > 0.0 && distance < f32::INFINITY {
                assert_eq!(
                    scene.closest(*point, distance.next_down()),
                    None,
                    "below the distance: {point:?}"
                );
            }
        }
        scene.closest_batch(points, f32::INFINITY, &mut batch);
        for i in 0..points.len() {
            assert_eq!(bits(batch[i]), bits(expected[i]), "{isa}, batch: {:?}", points[i]);
        }
    }
    before.choose().expect("available");
    expected
}

#[test]
fn triangles_of_all_shapes_and_scales_are_measured_exactly() {
    let mut rng = Rng::new(1);
    let mut features = [0; 7];
    for round in 0..600 {
        let scale = [1.0, 1e-3, 1e30, 1e-30, 3e37, 1e-40, 1e15][round % 7];
        let count = 1 + rng.below(if round % 5 == 0 { 100 } else { 12 }) as usize;
        let triangles = hostile_triangles(&mut rng, count, scale);
        let scene = bth::from_bytes(&placed_soup(&triangles, &[])).expect("a valid file");
        let points: Vec<_> = (0..16).map(|_| hostile_point(&mut rng, &triangles, scale)).collect();
        for (point, found) in points.iter().zip(all_ways(&scene, &points)) {
            check(*point, &triangles, found);
            features[found.expect("checked").feature.code() as usize] += 1;
        }
    }
    assert!(features.iter().all(|n| *n > 100), "{features:?}");
}

#[test]
fn coordinates_of_very_different_magnitudes_are_measured_exactly() {
    let mut rng = Rng::new(2);
    for _ in 0..400 {
        let number = |rng: &mut Rng| unit(rng) * 10f32.powi(rng.below(60) as i32 - 30);
        let mut draw = || [(); 3].map(|()| [(); 3].map(|()| number(&mut rng)));
        let triangles = [draw(), draw(), draw()];
        let points = draw();
        let scene = bth::from_bytes(&placed_soup(&triangles, &[])).expect("a valid file");
        for (point, found) in points.iter().zip(all_ways(&scene, &points)) {
            check(*point, &triangles, found);
        }
    }
}

#[test]
fn points_and_radii_that_are_no_numbers_find_nothing() {
    let scene = bth::from_bytes(&placed_soup(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]], &[])).unwrap();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(scene.closest([0.0, bad, 0.0], f32::INFINITY), None);
    }
    for radius in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        assert_eq!(scene.closest([0.0; 3], radius), None);
    }
    assert_eq!(scene.closest([0.0; 3], 0.0).map(|c| c.distance), Some(0.0));
    assert_eq!(scene.closest([0.0, 0.0, 1.0], f32::MAX).map(|c| c.distance), Some(1.0));
    let far = scene.closest([f32::MAX; 3], f32::INFINITY).expect("a result");
    assert_eq!((far.distance, scene.closest([f32::MAX; 3], f32::MAX)), (f32::INFINITY, None));
}

/// Checks boxes and balls about points of the triangles.
fn check_overlaps(rng: &mut Rng, scene: &Scene, world: &[Corners], scale: f32) -> [usize; 2] {
    let (mut found, mut results) = (Vec::new(), [0; 2]);
    let primitive = |i: usize| PrimitiveRef { instance: 0, triangle: i as u32 };
    let (a, b) = (hostile_point(rng, world, scale), hostile_point(rng, world, scale));
    let size = [0.0, 1e-6, 0.1, 1.0][rng.below(4) as usize] * scale;
    let (lower, upper) = match rng.below(3) {
        0 => ([0, 1, 2].map(|k| a[k].min(b[k])), [0, 1, 2].map(|k| a[k].max(b[k]))),
        1 => (a.map(|x| x - size), a.map(|x| x + size)),
        // A corner of the box on the triangle.
        _ => (a, a.map(|x| x + size)),
    };
    scene.triangles_in_box(lower, upper, &mut found);
    let expected: Vec<_> =
        (0..world.len()).filter(|&i| overlaps_box(lower, upper, world[i])).map(primitive).collect();
    assert_eq!(found, expected, "box {lower:?} {upper:?}");
    assert_eq!(scene.overlaps_box(lower, upper), !expected.is_empty(), "box {lower:?} {upper:?}");
    results[0] += expected.len();
    let radius =
        scene.closest(b, f32::INFINITY).map_or(0.0, |c| c.distance) * [1.0, 1.5][rng.below(2) as usize];
    scene.triangles_in_sphere(a, radius, &mut found);
    for (i, corners) in world.iter().enumerate() {
        let (squared, is_found) = (squared_distance(a, *corners), found.contains(&primitive(i)));
        let certain = to_f64(&squared).sqrt();
        let slack = f64::from(radius) * 1e-7 + 1e-44;
        let possible =
            (certain - f64::from(radius)).abs() <= slack || (certain <= f64::from(radius)) == is_found;
        assert!(possible, "ball {a:?} {radius}: triangle {i} at {certain}");
    }
    assert!(found.is_sorted_by_key(|p| (p.instance, p.triangle)));
    assert_eq!(scene.overlaps_sphere(a, radius), !found.is_empty());
    assert_eq!(scene.overlaps_sphere(a, radius), scene.closest(a, radius).is_some(), "ball {a:?} {radius}");
    results[1] += found.len();
    results
}

#[test]
fn boxes_and_balls_overlap_the_triangles_that_exact_arithmetic_says() {
    let mut rng = Rng::new(5);
    let mut results = [0; 2];
    for round in 0..240 {
        let scale = [1.0, 1e-3, 1e30, 1e-30, 1e15][round % 5];
        let triangles = hostile_triangles(&mut rng, 1 + round % 40, scale);
        let scene = bth::from_bytes(&placed_soup(&triangles, &[])).expect("a valid file");
        for _ in 0..3 {
            let found = check_overlaps(&mut rng, &scene, &triangles, scale);
            (0..2).for_each(|i| results[i] += found[i]);
        }
    }
    assert!(results.iter().all(|n| *n > 300), "{results:?}");
    let scene = bth::from_bytes(&placed_soup(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]], &[])).unwrap();
    assert!(scene.overlaps_box([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]));
    assert!(!scene.overlaps_box([f32::NAN, 0.0, 0.0], [1.0; 3]));
    assert!(!scene.overlaps_box([1.0; 3], [-1.0; 3]));
    assert!(scene.overlaps_sphere([0.0, 0.0, 9.0], f32::INFINITY));
    assert!(!scene.overlaps_sphere([0.0, 0.0, 9.0], f32::NAN) && !scene.overlaps_sphere([f32::NAN; 3], 1.0));
}

#[test]
fn every_structure_has_the_same_closest_points() {
    let mut rng = Rng::new(4);
    for (model, whole) in
        [(torus_knot(400), true), (gyroid(900), true), (blob(500), false), (hall(600), false)]
    {
        let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
        let points: Vec<_> = (0..150).map(|_| hostile_point(&mut rng, &corners, 0.1)).collect();
        let traced = every_structure(&model, whole);
        let expected = all_ways(&traced[0].scene, &points);
        for (point, found) in points.iter().zip(&expected).take(30) {
            check(*point, &corners, *found);
        }
        for Traced { name, scene } in &traced[1..] {
            let mut found = vec![None; points.len()];
            scene.closest_batch(&points, f32::INFINITY, &mut found);
            for i in 0..points.len() {
                assert_eq!(bits(found[i]), bits(expected[i]), "{name}: {:?}", points[i]);
            }
        }
    }
}
