//! Tests of scene builders. The oracle is a plain list of what the caller wants, each instance
//! traced by a loop over its triangles.

mod expected;
mod groups;
mod sequences;
mod top_level;

use super::*;
use crate::rays::{Hit, Ray, Ray64};
use bth_random::Rng;

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        [$(include_bytes!(concat!("../../../../../format-spec/conformance/valid/", $name, ".bth")).as_slice()),*]
    };
}

/// Files of one and of several objects, with and without scene sections, tracks, opacity and
/// quantized coordinates.
const FILES: [&[u8]; 8] = files![
    "two-objects",
    "two-levels",
    "scene-still",
    "scene-moving",
    "opacity",
    "grid-16",
    "nothing-to-hit",
    "no-objects",
];

const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn at(x: impl Into<f64>, y: impl Into<f64>, z: impl Into<f64>) -> [f64; 12] {
    [1.0, 0.0, 0.0, x.into(), 0.0, 1.0, 0.0, y.into(), 0.0, 0.0, 1.0, z.into()]
}

fn unit(rng: &mut Rng) -> f32 {
    rng.unit_f32() * 2.0 - 1.0
}

/// The nearest hits of rays.
fn nearest(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    hits
}

#[test]
fn calls_that_name_nothing_are_errors_and_change_nothing() {
    let mut builder = SceneBuilder::new();
    let file = crate::from_bytes(FILES[0]).unwrap();
    let code = |result: Result<(), Error>| result.unwrap_err().code();
    assert_eq!(builder.instance(0, &IDENTITY).unwrap_err().code(), Code::NoSuchObject);
    assert_eq!(builder.subscene(0, &IDENTITY).unwrap_err().code(), Code::NoSuchObject);
    assert_eq!((builder.add(&file), builder.add(&file)), (0, 2));
    assert_eq!(builder.subscene(1, &IDENTITY).unwrap_err().code(), Code::NoSuchObject, "not the first");
    let own = builder.instance(3, &IDENTITY).unwrap();
    let subscene = builder.subscene(2, &IDENTITY).unwrap();
    let placed = builder.subscene_instances(subscene).unwrap()[1];
    assert_eq!((own, placed), (0, 2));
    for unknown in [3, 7, u32::MAX] {
        assert_eq!(code(builder.set_transform(unknown, &IDENTITY)), Code::NoSuchInstance);
        assert_eq!(code(builder.set_visible(unknown, true)), Code::NoSuchInstance);
        assert_eq!(code(builder.remove(unknown)), Code::NoSuchInstance);
        assert_eq!(code(builder.set_instance_mask(unknown, 1)), Code::NoSuchInstance);
        assert_eq!(code(builder.remove_subscene(unknown)), Code::NoSuchInstance);
        assert_eq!(code(builder.set_subscene_seconds(unknown, 1.0)), Code::NoSuchInstance);
        assert_eq!(code(builder.set_subscene_visible(unknown, true)), Code::NoSuchInstance);
        assert_eq!(code(builder.set_subscene_transform(unknown, &IDENTITY)), Code::NoSuchInstance);
        assert_eq!(builder.subscene_instances(unknown).unwrap_err().code(), Code::NoSuchInstance);
        // None of several transforms is set if one cannot be.
        let transforms = [at(9.0, 0.0, 0.0), IDENTITY];
        assert_eq!(code(builder.set_transforms(&[own, unknown], &transforms)), Code::NoSuchInstance);
    }
    for seconds in [f64::NAN, f64::INFINITY] {
        assert_eq!(code(builder.set_subscene_seconds(subscene, seconds)), Code::NotFinite);
    }
    assert_eq!(code(builder.set_group_mask(4, 0, 1)), Code::NoSuchObject);
    assert_eq!(code(builder.set_group_mask(0, 1, 1)), Code::NoSuchObject);
    let error = builder.set_transform(placed, &IDENTITY).unwrap_err();
    assert!(error.to_string().contains("instance 2 of subscene 0") && error.code() == Code::PlacedByFile);
    assert_eq!(code(builder.remove(placed)), Code::PlacedByFile);
    builder.commit().unwrap();
    assert_eq!(builder.scene().instance(own).to_world[0], [1.0, 0.0, 0.0, 0.0]);
    builder.remove(own).unwrap();
    assert_eq!(code(builder.remove(own)), Code::NoSuchInstance);
}

#[test]
fn ids_are_stable_and_used_again_only_after_the_commit_that_frees_them() {
    let mut builder = SceneBuilder::new();
    let object = builder.add(&crate::from_bytes(FILES[0]).unwrap());
    let add = |builder: &mut SceneBuilder, x: f32| builder.instance(object, &at(x, 0.0, 0.0)).unwrap();
    let ids: Vec<u32> = (0..5).map(|i| add(&mut builder, 3.0 * i as f32)).collect();
    assert_eq!((&ids[..], builder.scene().instance_count()), (&[0, 1, 2, 3, 4][..], 0));
    builder.set_instance_mask(3, 2).unwrap();
    assert_eq!(builder.commit().unwrap().visible, 5);
    builder.remove(3).unwrap();
    builder.remove(1).unwrap();
    assert_eq!(add(&mut builder, 20.0), 5);
    let update = builder.commit().unwrap();
    assert_eq!((update.placed, update.visible, builder.scene().instance_count()), (3, 4, 6));
    let scene = builder.scene();
    let removed = scene.instance(3);
    assert!(removed.object == u32::MAX && !removed.visible && scene.object_of(1) == u32::MAX);
    let stale = crate::rays::PrimitiveRef { instance: 3, triangle: 0 };
    assert_eq!((scene.triangle(stale), scene.triangle_in_world(stale)), (None, None));
    assert_eq!(scene.surface(&Hit { t: 1.0, u: 0.0, v: 0.0, primitive: stale }), None);
    assert_eq!(scene.instance_bounds(3), None);
    assert_eq!([add(&mut builder, 1.0), add(&mut builder, 2.0), add(&mut builder, 4.0)], [1, 3, 6]);
    builder.commit().unwrap();
    let ray = Ray::new([2.25, 0.25, 9.0], [0.0, 0.0, -1.0]);
    let accept = crate::Accept { mask: 1, ..crate::Accept::default() };
    let hit = builder.scene().nearest_accepted(&ray, &accept).expect("a mask is dropped with its instance");
    assert_eq!(hit.primitive.instance, 3);
}

#[test]
fn transforms_in_f64_are_not_rounded() {
    let cube = crate::from_bytes(include_bytes!("../../../doc/cube.bth")).unwrap();
    let (mut builder, x) = (SceneBuilder::new(), 5_500_000.3);
    let object = builder.add(&cube);
    let own = builder.instance(object, &at(x, 0.0, 0.0)).unwrap();
    let whole = builder.subscene(object, &IDENTITY).unwrap();
    builder.set_subscene_transform(whole, &at(-x, 0.0, 0.0)).unwrap();
    builder.commit().unwrap();
    let scene = builder.scene();
    let ray = Ray64::new([x + 10.0, 0.5, 0.25], [-1.0, 0.0, 0.0]);
    let hit = scene.nearest(&ray).unwrap();
    // The differences are exact.
    let t = ray.origin[0] - x - 1.0;
    let found = scene.hit_f64(&ray, &hit);
    assert!(hit.primitive.instance == own && (found.t - t).abs() <= 1e-9, "{found:?}, {t}");
    // The border of the cube is hit, the number next to it is not.
    for (border, beyond) in [(x, x.next_down()), (1.0 - x, (1.0 - x).next_up())] {
        let down = |x: f64| Ray64::new([x, 0.5, 9.0], [0.0, 0.0, -1.0]);
        assert!(scene.any(&down(border)) && !scene.any(&down(beyond)), "{border}");
    }
}

#[test]
fn objects_lead_back_to_their_files_and_files_outlive_the_scenes_they_came_from() {
    let mut builder = SceneBuilder::new();
    let scenes = FILES.map(|bytes| crate::from_bytes(bytes).unwrap());
    let firsts: Vec<u32> = scenes.iter().map(|scene| builder.add(scene)).collect();
    let again = builder.add(&scenes[1]);
    for (scene, &first) in scenes.iter().zip(&firsts) {
        for object in 0..scene.object_count() {
            let (file, row) = builder.scene().file_of(first + object);
            assert_eq!((file.content_id(), row), (scene.file().content_id(), object));
            assert_eq!(builder.scene().object_name(first + object), scene.object_name(object));
        }
    }
    let bytes: u64 = scenes.iter().map(Scene::resident_bytes).sum();
    assert_eq!(builder.scene().resident_bytes(), bytes, "a file that is added twice counts once");
    drop(scenes);
    builder.instance(again, &IDENTITY).unwrap();
    builder.commit().unwrap();
    let nested = builder.into_scene();
    let ray = Ray::new([0.25, 0.25, 9.0], [0.0, 0.0, -1.0]);
    let hit = nested.nearest(&ray);
    assert!(hit.is_some());
    let mut outer = SceneBuilder::new();
    assert_eq!(outer.add(&nested), 0);
    drop(nested);
    outer.instance(again, &IDENTITY).unwrap();
    outer.commit().unwrap();
    assert_eq!(outer.scene().nearest(&ray), hit);
    assert_eq!(outer.scene().touched_objects(), 1);
}

#[test]
fn scenes_without_instances_answer_all_queries() {
    let mut builder = SceneBuilder::default();
    assert_eq!(builder.commit().unwrap(), Update::default());
    let scene = builder.scene();
    let ray = Ray::new([0.0; 3], [1.0; 3]);
    assert!(scene.nearest(&ray).is_none() && !scene.any(&ray) && scene.bounds().is_none());
    assert!(scene.closest([0.0; 3], f32::INFINITY).is_none() && scene.winding([0.0; 3]) == 0);
    assert!(!scene.overlaps_sphere([0.0; 3], 1.0) && scene.crossings(&ray).count == 0);
    assert_eq!((scene.object_count(), scene.instance_count(), scene.seconds()), (0, 0, 0.0));
    assert!(scene.description().is_none());
}

/// Rays that start on the surface, whose directions are so short or so long in the space of the
/// object that they are scaled there.
#[test]
fn crossings_of_rays_from_the_surface_do_not_depend_on_the_lengths_of_directions() {
    let mut builder = SceneBuilder::new();
    let object = builder.add(&crate::from_bytes(FILES[1]).unwrap());
    for x in [0.0, 64.0] {
        builder.instance(object, &at(x, 0.0, 0.0)).unwrap();
    }
    builder.commit().unwrap();
    let scene = builder.scene();
    let corners = scene.object(object).positions;
    let (mut rng, mut crossed) = (Rng::new(31), 0);
    for case in 0..2000 {
        let [from, to] = [(); 2].map(|()| corners[rng.below(corners.len() as u64) as usize]);
        let aside = [(); 3].map(|()| rng.below(5) as f32 - 2.0);
        let direction = [0, 1, 2].map(|k| if case % 2 == 0 { aside[k] } else { to[k] - from[k] + aside[k] });
        let range = [[0.0, f32::INFINITY], [f32::NEG_INFINITY, 0.0], [0.0, 1.0], [-1.0, 0.0]][case / 2 % 4];
        let crossings = |exponent: i32| {
            let scale = 2f32.powi(exponent);
            let ray = Ray::new(from, direction.map(|x| x * scale));
            scene.crossings(&ray.with_range(range[0] / scale, range[1] / scale))
        };
        let expected = crossings(0);
        for exponent in [-70, -100, 70, 100] {
            assert_eq!(crossings(exponent), expected, "case {case}: {from:?}, {direction:?}, 2^{exponent}");
        }
        crossed += expected.count;
    }
    assert!(crossed > 100, "{crossed}");
}
