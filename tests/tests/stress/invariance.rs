//! Changes of a model that change no answer: another order, exact motions, and cuts into instances.

use bth::Scene;
use bth::rays::{Hit, PrimitiveRef, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_random::Rng;
use bth_scenes::Model;
use bth_scenes::{blob::blob, soup::soup};
use bth_tests::rays::assorted;
use bth_tests::structures::{self, every_structure};
use std::fmt::Write;

const RAYS: usize = 1500;

fn hits(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    hits
}

fn rays(model: &Model) -> Vec<Ray> {
    let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    assorted(&corners, RAYS, 5)
}

/// A closed surface, and triangles that cross each other.
fn models() -> [Model; 2] {
    [blob(400), soup(200)]
}

fn shuffled(count: usize, seed: u64) -> Vec<u32> {
    let (mut rows, mut rng): (Vec<u32>, _) = ((0..count as u32).collect(), Rng::new(seed));
    for i in (1..count).rev() {
        rows.swap(i, rng.below(i as u64 + 1) as usize);
    }
    rows
}

/// Answers for a changed model: t to the bit; u and v too where the same triangle is named. Of
/// triangles that are hit at the same t (at edges) another may be named only where the ids have
/// another order.
fn compare(a: &[Hit], b: &[Hit], name: impl Fn(u32) -> u32, ordered: bool) {
    let mut same = 0;
    for (a, b) in a.iter().zip(b) {
        assert_eq!((a.is_hit(), a.t.to_bits()), (b.is_hit(), b.t.to_bits()), "{a:?} {b:?}");
        if a.is_hit() && name(a.primitive.triangle) == b.primitive.triangle {
            assert_eq!((a.u.to_bits(), a.v.to_bits()), (b.u.to_bits(), b.v.to_bits()), "{a:?} {b:?}");
            same += 1;
        } else {
            assert!(!a.is_hit() || !ordered, "{a:?} {b:?}");
        }
    }
    assert!(same > RAYS / 10, "{same} hits");
}

#[test]
fn the_order_of_triangles_changes_no_answer() {
    for model in models() {
        let rows = shuffled(model.triangles.len(), 1);
        let mut place = vec![0; rows.len()];
        rows.iter().enumerate().for_each(|(new, old)| place[*old as usize] = new as u32);
        let triangles = rows.iter().map(|old| model.triangles[*old as usize]).collect();
        let other = Model { triangles, ..model.clone() };
        let rays = rays(&model);
        for (a, b) in every_structure(&model, false).iter().zip(&every_structure(&other, false)) {
            compare(&hits(&a.scene, &rays), &hits(&b.scene, &rays), |id| place[id as usize], false);
        }
    }
}

#[test]
fn the_names_of_vertices_change_no_answer() {
    for model in models() {
        let rows = shuffled(model.positions.len(), 2);
        let mut positions = vec![[0.0; 3]; rows.len()];
        rows.iter().enumerate().for_each(|(old, new)| positions[*new as usize] = model.positions[old]);
        let triangles = model.triangles.iter().map(|t| t.map(|v| rows[v as usize])).collect();
        let rays = rays(&model);
        let other = Model { positions, triangles };
        for (a, b) in every_structure(&model, false).iter().zip(&every_structure(&other, false)) {
            compare(&hits(&a.scene, &rays), &hits(&b.scene, &rays), |id| id, true);
        }
    }
}

/// Moves model and rays by something exact: same t, same triangles.
fn moved(point: impl Fn([f32; 3]) -> [f32; 3]) {
    for model in models() {
        let positions = model.positions.iter().map(|p| point(*p)).collect();
        let other = Model { positions, triangles: model.triangles.clone() };
        let rays = rays(&model);
        let moved: Vec<Ray> = rays
            .iter()
            .map(|ray| Ray { origin: point(ray.origin), direction: point(ray.direction), ..*ray })
            .collect();
        for (a, b) in every_structure(&model, false).iter().zip(&every_structure(&other, false)) {
            for (a, b) in hits(&a.scene, &rays).iter().zip(&hits(&b.scene, &moved)) {
                assert_eq!((a.t.to_bits(), a.primitive), (b.t.to_bits(), b.primitive), "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn quarter_turns_change_no_answer() {
    moved(|[x, y, z]| [-y, x, z]);
    moved(|[x, y, z]| [z, -y, x]);
}

#[test]
fn scaling_by_powers_of_two_changes_no_answer() {
    for exponent in [40, -60] {
        moved(|p| p.map(|x| x * 2f32.powi(exponent)));
    }
}

#[test]
fn cutting_into_instances_changes_no_answer() {
    for model in models() {
        let folder = tempfile::tempdir().unwrap();
        let mut text = "version = 1\n".to_owned();
        let size = model.triangles.len().div_ceil(5);
        for (i, triangles) in model.triangles.chunks(size).enumerate() {
            let part = Model { triangles: triangles.to_vec(), ..model.clone() };
            bth_scenes::write::file(&part, &folder.path().join(format!("{i}.ply"))).unwrap();
            write!(text, "[[objects]]\nname = \"{i}\"\nmodel = \"{i}.ply\"\n[[nodes]]\nname = \"{i}\"\nobject = \"{i}\"\n")
                .unwrap();
        }
        let manifest = bth_scene::parse(&text, "cut.manifest".as_ref()).unwrap();
        let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
        let (compiled, _) =
            bth_compile::scene::compile(&manifest, folder.path(), "cut".as_ref(), &options, &Silent).unwrap();
        let cut = bth::from_bytes(&compiled.bytes).unwrap();
        assert_eq!(cut.instance_count(), 5);
        let rays = rays(&model);
        let mut ours = hits(&cut, &rays);
        for hit in ours.iter_mut().filter(|hit| hit.is_hit()) {
            let triangle = hit.primitive.instance * size as u32 + hit.primitive.triangle;
            hit.primitive = PrimitiveRef { instance: 0, triangle };
        }
        // Among hits at the same t, rounded, the smallest instance is reported; within an object
        // the nearest is.
        let whole = structures::compiled(&model, &structures::options(Structure::Bvh));
        compare(&hits(&whole, &rays), &ours, |id| id, false);
    }
}
