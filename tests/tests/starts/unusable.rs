//! Starts that are no points of a surface: `check_start` says why, and queries miss.

use crate::check::{check_isas, turn};
use bth::rays::{Hit, PrimitiveRef, Start, StartRay};
use bth::{Accept, Code, Crossings, Scene, SceneBuilder};
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_tests::meshes::cube;
use bth_tests::rays::starts;
use bth_tests::structures::{compiled, options};

const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn at(instance: u32, triangle: u32, u: f32, v: f32) -> Start {
    Start { primitive: PrimitiveRef { instance, triangle }, u, v }
}

/// Checks that a start is not usable, in no query.
fn is_unusable(scene: &Scene, start: Start, code: Code) {
    let error = scene.check_start(&start).expect_err("no start");
    assert_eq!(error.code(), code, "{start:?}: {error}");
    let directions = [[0.3, 0.1, -1.0], [-0.3, 1.0, 0.2], [0.0, 0.0, 1.0], [1.0, 0.1, 0.3]];
    let rays: Vec<StartRay> = (0..64).map(|i| start.ray(directions[i % 4])).collect();
    let (everything, mut all) = (Accept::default(), vec![Hit::MISS]);
    let even = |_: &_, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    check_isas(scene, &rays, &vec![Hit::MISS; rays.len()], &format!("{start:?}"), &|_, _, _| {});
    for ray in &rays[..4] {
        scene.all_hits(ray, &everything, &mut all);
        assert_eq!((all.len(), scene.count_hits(ray, &everything)), (0, 0), "{ray:?}");
        assert_eq!(scene.nearest_accepted(ray, &Accept { filter: Some(&even), ..everything }), None);
        assert!(!scene.any_accepted(ray, &Accept { filter: Some(&even), ..everything }));
        assert_eq!(scene.crossings(ray), Crossings::default(), "{ray:?}");
    }
}

/// Checks what is no start of any object with these triangles.
fn check_weights(scene: &Scene, triangles: u32) {
    for triangle in [triangles, triangles + 1, u32::MAX, u32::MAX - 1] {
        is_unusable(scene, at(0, triangle, 0.25, 0.25), Code::Start);
    }
    for instance in [scene.instance_count(), u32::MAX] {
        is_unusable(scene, at(instance, 0, 0.25, 0.25), Code::NoSuchInstance);
    }
    is_unusable(scene, Start::NONE, Code::NoSuchInstance);
    let above = 1.0 / (1 << 22) as f32;
    for bad in [
        f32::NAN,
        -f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -1e-30,
        -f32::from_bits(1),
        1.1,
        1.0 + 2.0 * above,
    ] {
        is_unusable(scene, at(0, 0, bad, 0.0), Code::Start);
        is_unusable(scene, at(0, 0, 0.0, bad), Code::Start);
    }
    is_unusable(scene, at(0, 0, 0.6, 0.5), Code::Start);
    is_unusable(scene, at(0, 0, 0.5, 0.5 + 2.0 * above), Code::Start);
    for (u, v) in [(0.0, 0.0), (-0.0, -0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5 + above), (1.0 + above, 0.0)] {
        assert!(scene.check_start(&at(0, 0, u, v)).is_ok(), "{u} {v}");
        let ray = at(0, 0, u, v).ray([0.3, 0.2, 0.9]);
        let other = at(0, 0, u, v).ray([-0.3, -0.2, -0.9]);
        assert!(scene.any(&ray) || scene.any(&other) || u + v != 0.25, "{ray:?}");
    }
}

#[test]
fn wrong_numbers_in_one_object_and_in_scenes() {
    let _turn = turn();
    let model = cube(2, None);
    let count = model.triangles.len() as u32;
    let options = options(Structure::Bvh);
    let one = compiled(&model, &options);
    check_weights(&one, count);
    let deformable = compiled(&model, &CompileOptions { deformable: true, ..options });
    check_weights(&deformable, count);
    for instances in [1, 3] {
        let mut builder = SceneBuilder::new();
        let object = builder.add(&one);
        (0..instances).for_each(|_| assert!(builder.instance(object, &IDENTITY).is_ok()));
        builder.commit().unwrap();
        check_weights(builder.scene(), count);
    }
    if bth_tests::worker().is_some() {
        let tets = bth_tests::structures::options(Structure::Tets);
        check_weights(&compiled(&model, &tets), count);
    }
}

#[test]
fn triangles_that_have_lost_their_area_are_no_starts_until_they_have_one() {
    let _turn = turn();
    let model = cube(1, None);
    let of_bvh = options(Structure::Bvh);
    let mut scene = compiled(&model, &CompileOptions { deformable: true, ..of_bvh });
    let rest = scene.object(0).positions.to_vec();
    let flat = scene.object(0).triangles[0];
    let mut positions = rest.clone();
    positions[flat[0] as usize] = positions[flat[1] as usize];
    scene.set_positions(0, &positions).unwrap();
    let lost = |scene: &Scene| {
        let rows = scene.object(0).triangles;
        let of = |t: &[u32; 3]| {
            let corners = t.map(|v| scene.object(0).positions[v as usize]);
            bth_format::exact::is_zero_area(corners)
        };
        rows.iter().map(of).collect::<Vec<bool>>()
    };
    let without_area = lost(&scene);
    assert!(without_area[0] && without_area.contains(&false));
    for (triangle, lost) in (0..).zip(&without_area) {
        if *lost {
            is_unusable(&scene, at(0, triangle, 0.25, 0.25), Code::Start);
        } else {
            assert!(scene.check_start(&at(0, triangle, 0.25, 0.25)).is_ok());
        }
    }
    scene.set_positions(0, &rest).unwrap();
    assert!(scene.check_start(&at(0, 0, 0.25, 0.25)).is_ok());
}

#[test]
fn hidden_and_removed_instances_are_no_starts() {
    let _turn = turn();
    let model = cube(1, None);
    let one = compiled(&model, &options(Structure::Bvh));
    let mut builder = SceneBuilder::new();
    let object = builder.add(&one);
    let instances: Vec<u32> = (0..3).map(|_| builder.instance(object, &IDENTITY).unwrap()).collect();
    builder.commit().unwrap();
    let start = |instance: u32| at(instance, 3, 0.25, 0.5);
    for instance in &instances {
        assert!(builder.scene().check_start(&start(*instance)).is_ok());
    }
    builder.set_visible(instances[1], false).unwrap();
    builder.commit().unwrap();
    is_unusable(builder.scene(), start(instances[1]), Code::Start);
    assert!(builder.scene().check_start(&start(instances[2])).is_ok());
    builder.set_visible(instances[2], false).unwrap();
    builder.commit().unwrap();
    // One instance is left.
    is_unusable(builder.scene(), start(instances[2]), Code::Start);
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let rays = starts(&corners, 200, 1);
    let expected = bth_tests::rays::alone(builder.scene(), &rays);
    assert!(expected == bth_tests::rays::alone(&one, &rays));
    check_isas(builder.scene(), &rays, &expected, "one is visible", &|_, _, _| {});
}
