//! Visibility between two points: exact, and the same in both directions.

use crate::check::corners_of;
use bth::SegmentEnd;
use bth::rays::{PrimitiveRef, Start};
use bth_compile::pipeline::Structure;
use bth_random::Rng;
use bth_tests::meshes::{KINDS, cube, mesh, placed};
use bth_tests::oracle::starts;
use bth_tests::structures::{compiled, options};

/// A start on a random triangle: in its face, on an edge or at a corner; or a point: anywhere, or a
/// corner of the mesh.
fn end(rng: &mut Rng, corners: &[[[f32; 3]; 3]]) -> SegmentEnd {
    let triangle = rng.below(corners.len() as u64) as usize;
    match rng.below(8) {
        0 => SegmentEnd::Point(corners[triangle][rng.below(3) as usize]),
        1 => SegmentEnd::Point(rng.point_in_ball().map(|x| 3.0 * x as f32)),
        kind => {
            let u = rng.unit_f32();
            let weights = [[u, 0.0], [0.0, u], [u, 1.0 - u], [0.0, 0.0], [1.0, 0.0]];
            let [u, v] = match kind {
                2..5 => weights[rng.below(5) as usize],
                _ => [0.9 * u, 0.9 * (1.0 - u) * rng.unit_f32()],
            };
            let primitive = PrimitiveRef { instance: 0, triangle: triangle as u32 };
            SegmentEnd::Start(Start { primitive, u, v })
        }
    }
}

#[test]
fn points_see_each_other_as_exact_arithmetic_says_in_both_directions() {
    let rng = &mut Rng::new(61);
    let mut models = vec![cube(3, None), cube(3, Some(rng)), bth_scenes::knot::torus_knot(300)];
    models.push(placed(cube(2, None), 1e-25, 0.0));
    models.push(placed(cube(2, None), 1.0, 5000.0));
    models.extend((0..3 * KINDS).map(|kind| mesh(kind % KINDS, rng)));
    let mut seen = [0; 2];
    for (i, model) in models.iter().enumerate() {
        let scene = compiled(model, &options(Structure::Bvh));
        let corners = corners_of(&scene, 0);
        for _ in 0..150 {
            let (a, b) = (end(rng, &corners), end(rng, &corners));
            let is_end = |end: &SegmentEnd| match end {
                SegmentEnd::Point(_) => true,
                SegmentEnd::Start(start) => scene.check_start(start).is_ok(),
            };
            let expected = is_end(&a) && is_end(&b) && starts::visible(&corners, a, b);
            assert_eq!(scene.visible(a, b), expected, "model {i}: {a:?}, {b:?}");
            assert_eq!(scene.visible(b, a), expected, "model {i}: {b:?}, {a:?}");
            seen[usize::from(expected)] += 1;
        }
    }
    assert!(seen.iter().all(|count| *count > 500), "{seen:?}");
}

#[test]
fn ends_that_are_no_points_see_nothing() {
    let scene = compiled(&cube(2, None), &options(Structure::Bvh));
    let on = |instance, u| Start { primitive: PrimitiveRef { instance, triangle: 0 }, u, v: 0.25 };
    let good = on(0, 0.25);
    for bad in [on(1, 0.25), on(0, f32::NAN), on(0, 0.9), Start::NONE] {
        assert!(!scene.visible(good, bad) && !scene.visible(bad, good), "{bad:?}");
    }
    assert!(!scene.visible(good, [f32::NAN, 0.0, 0.0]));
    assert!(scene.visible(good, good), "nothing lies between a point and itself");
}
