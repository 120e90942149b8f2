//! Random meshes in every form in which files store triangles.

use crate::check::{Corners, check, check_with, corners_of, turn};
use bth::Scene;
use bth::rays::StartRay;
use bth_compile::Silent;
use bth_compile::free::KeepFree;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_format::exact::is_zero_area;
use bth_format::layout::GridBits;
use bth_random::Rng;
use bth_scenes::Model;
use bth_tests::by_day;
use bth_tests::meshes::{KINDS, cube, mesh, placed};
use bth_tests::placed_soup::soups;
use bth_tests::rays::{alone, assorted, coherent_starts, onward, starts};
use bth_tests::structures::{deformed, options};

/// The scene of a model in one of the forms, if it has one.
fn scene_of(model: &Model, form: usize, rng: &mut Rng) -> Option<(&'static str, Scene)> {
    let mut of_bvh = options(Structure::Bvh);
    let name = match form {
        0 => "plain",
        1 => {
            of_bvh.coordinates.bits = Some(GridBits::B16);
            "a grid of 16 bits"
        }
        2 => {
            of_bvh.free.keep = KeepFree::All;
            "free directions"
        }
        3 => {
            of_bvh.free.keep = KeepFree::Distances;
            "free distances"
        }
        4 => return Some(("deformed", deformed(model, rng.next()).scene)),
        5 => return Some(("raw leaves", raw(model, 0, rng)?)),
        _ => return Some((SEVERAL, raw(model, 4, rng)?)),
    };
    Some((name, compiled(model, &of_bvh)?))
}

/// Compiled; `None` if no triangle has an area.
fn compiled(model: &Model, options: &CompileOptions) -> Option<Scene> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).unwrap();
    let (compiled, _) = compile(&path, options, &Silent).ok()?;
    Some(bth::from_bytes(&compiled.bytes).unwrap())
}

/// The name of files in which triangles lie in several leaves.
const SEVERAL: &str = "raw leaves with triangles in several leaves";

/// Raw leaves, in which `several` of sixteen triangles lie twice.
fn raw(model: &Model, several: u64, rng: &mut Rng) -> Option<Scene> {
    let all = (0..model.triangles.len()).map(|i| model.corners(i));
    let triangles: Corners = all.filter(|corners| !is_zero_area(*corners)).take(180).collect();
    let mut ids: Vec<u32> = (0..triangles.len() as u32).collect();
    ids.extend((0..triangles.len() as u64 * several / 16).map(|_| rng.below(triangles.len() as u64) as u32));
    ids.sort_by_key(|id| id.wrapping_mul(0x9e37_79b9));
    let mut leaves: Vec<Vec<u32>> = ids.chunks(15).map(<[u32]>::to_vec).collect();
    leaves.iter_mut().for_each(|leaf| {
        leaf.sort_unstable();
        leaf.dedup();
    });
    leaves.retain(|leaf| !leaf.is_empty());
    if leaves.is_empty() {
        return None;
    }
    Some(bth::from_bytes(&soups(&[(&triangles, leaves)])).unwrap())
}

/// Rays of every kind from a mesh.
fn rays(scene: &Scene, corners: &Corners, count: usize, seed: u64) -> Vec<StartRay> {
    let mut rays = starts(corners, count, seed);
    rays.extend(coherent_starts(corners, 1, seed + 1));
    let hits = alone(scene, &assorted(corners, count / 2, seed + 2));
    rays.extend(onward(&hits, corners.len(), seed + 3));
    // Those that hit go on from there, the same way and back.
    let next: Vec<StartRay> = (rays.iter().zip(alone(scene, &rays)).filter(|(_, hit)| hit.is_hit()))
        .zip([1.0, -1.0].into_iter().cycle())
        .map(|((ray, hit), sign)| StartRay::from_hit(&hit, ray.direction.map(|d| d * sign)))
        .take(count / 2)
        .collect();
    rays.extend(next);
    rays
}

fn check_form(form: usize, rounds: u64) {
    let _turn = turn();
    let (mut hits, mut all) = (0, 0);
    for seed in 0..rounds {
        let rng = &mut Rng::new(1000 * form as u64 + seed);
        let kind = (seed as usize + form) % KINDS;
        // On a grid and in f32; the last three are beyond what f32 prepares, or become denormal.
        let scale = [1.0, 1.0, 0.01, 2f32.powi(-40), 1e12, 1e-30, 1e30, 1e-39][seed as usize % 8];
        let by = [0.0, 0.0, 0.0, 1000.0, 3e5][seed as usize % 5] * scale;
        let model = placed(mesh(kind, rng), scale, by);
        let Some((name, scene)) = scene_of(&model, form, rng) else { continue };
        let corners = corners_of(&scene, 0);
        if corners.iter().all(|corners| is_zero_area(*corners)) {
            continue;
        }
        let rays = rays(&scene, &corners, by_day(20, 60), seed);
        let context = format!("{name}, kind {kind}, seed {seed}, scale {scale}, by {by}");
        hits += match name {
            // Queries for several hits report a triangle for each of its leaves.
            SEVERAL => check_with(&scene, &corners, &rays, &context, &|_, _, _| {}),
            _ => check(&scene, &corners, &rays, &context),
        };
        all += rays.len();
    }
    assert!(hits > all / 5 && hits < all * 9 / 10, "{hits} of {all} hit");
}

#[test]
fn plain_files() {
    check_form(0, 24);
}

#[test]
fn grids_of_16_bits() {
    check_form(1, 16);
}

#[test]
fn free_directions() {
    check_form(2, 16);
}

#[test]
fn free_distances() {
    check_form(3, 16);
}

#[test]
fn deformable_objects_with_new_positions() {
    check_form(4, 16);
}

#[test]
fn raw_leaves() {
    check_form(5, 16);
}

#[test]
fn triangles_in_several_leaves() {
    check_form(6, 16);
}

#[test]
fn models_of_many_nodes() {
    let _turn = turn();
    let model = bth_scenes::knot::torus_knot(3000);
    let plain = options(Structure::Bvh);
    for (scale, by) in [(1.0, 0.0), (0.01, 700.0), (1e-20, 0.0)] {
        let scene = compiled(&placed(model.clone(), scale, by), &plain).unwrap();
        let corners = corners_of(&scene, 0);
        let rays = rays(&scene, &corners, by_day(50, 150), 5);
        assert!(check(&scene, &corners, &rays, &format!("knot, {scale}")) > rays.len() / 4);
    }
}

#[test]
fn whole_tetrahedralizations() {
    if bth_tests::worker().is_none() {
        return;
    }
    let _turn = turn();
    let rng = &mut Rng::new(3);
    for (i, model) in
        [cube(3, None), bth_scenes::knot::torus_knot(600), cube(3, Some(rng))].iter().enumerate()
    {
        let scene = compiled(model, &options(Structure::Tets)).unwrap();
        assert!(!scene.object(0).tet_leaves.is_empty());
        let corners = corners_of(&scene, 0);
        let rays = rays(&scene, &corners, by_day(20, 60), i as u64);
        check(&scene, &corners, &rays, &format!("tets, model {i}"));
    }
}
