//! Batches of rays, with origins or from starts, give the bits of the same rays traced one at a
//! time, on every instruction set.

mod free_directions;

use bth::rays::{Hit, Ray, StartRay};
use bth::{Accept, Isa, Scene, TraceRay};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_random::Rng;
use bth_scenes::{Model, gyroid::gyroid, knot::torus_knot};
use bth_tests::rays::{alone, assorted, check_batch, onward, starts};
use bth_tests::structures::bits;
use std::sync::{Mutex, MutexGuard};

/// The instruction set is a setting of the whole process, so tests that set it run one after the
/// other.
pub(crate) fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|e| e.into_inner())
}

pub(crate) fn compiled(model: &Model, structure: Structure) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).expect("a model file");
    let mut options = CompileOptions { structure, ..CompileOptions::default() };
    options.costs.minimum_triangles = 32;
    options.costs.c_tet = Some(1e-3);
    options.tets.worker = bth_tests::worker().map(Into::into);
    options.tets.minimum = 1;
    let (compiled, _) = compile(&path, &options, &Silent).expect("a model that compiles");
    bth::from_bytes(&compiled.bytes).expect("a file that opens")
}

/// Rays of [`assorted`], and the same cut right about their hits.
fn rays_about_hits(plain: &Scene, corners: &[[[f32; 3]; 3]], count: usize, seed: u64) -> Vec<Ray> {
    let mut rays = assorted(corners, count, seed);
    for (i, hit) in alone(plain, &rays).into_iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
        let t = [hit.t, hit.t.next_up(), hit.t.next_down()][i % 3];
        let ray = rays[i];
        rays.push(if i % 2 == 0 { Ray { tmax: t, ..ray } } else { Ray { tmin: t, ..ray } });
    }
    rays
}

/// Rays from starts of every kind, from hits and of triangles that do not exist, and the same cut
/// right about their hits.
pub(crate) fn starts_about_hits(
    plain: &Scene,
    corners: &[[[f32; 3]; 3]],
    count: usize,
    seed: u64,
) -> Vec<StartRay> {
    let first = alone(plain, &assorted(corners, count, seed));
    let mut rays = onward(&first, corners.len(), seed + 1);
    rays.extend(starts(corners, count, seed + 2));
    for (i, hit) in alone(plain, &rays).into_iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
        rays.push(rays[i].with_tmax([hit.t, hit.t.next_up(), hit.t.next_down()][i % 3]));
    }
    rays
}

fn check(model: &Model, structure: Structure, rays: usize, seed: u64) {
    if bth_tests::worker().is_none() {
        return;
    }
    let _turn = turn();
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let plain = compiled(model, Structure::Bvh);
    let starts = starts_about_hits(&plain, &corners, rays / 2, seed + 1);
    let rays = rays_about_hits(&plain, &corners, rays, seed);
    let (expected, after) = (alone(&plain, &rays), alone(&plain, &starts));
    for hits in [&expected, &after] {
        let some_hits = hits.iter().filter(|hit| hit.is_hit()).count();
        assert!(some_hits > hits.len() / 4 && some_hits < hits.len(), "{some_hits} of {} hit", hits.len());
    }
    let scene = compiled(model, structure);
    assert!(!scene.object(0).tet_leaves.is_empty());
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("an instruction set that is available");
        check_batch(&scene, &rays, &expected, format_args!("{isa}"));
        check_batch(&scene, &starts, &after, format_args!("{isa}"));
    }
    Isa::best().choose().expect("the best is available");
}

pub(crate) fn scaled(mut model: Model, scale: f32, offset: [f32; 3]) -> Model {
    for p in &mut model.positions {
        *p = [0, 1, 2].map(|k| p[k] * scale + offset[k]);
    }
    model
}

#[test]
fn a_batch_through_one_tetrahedralization_has_the_bits_of_single_rays() {
    check(&torus_knot(720), Structure::Tets, 3000, 1);
}

#[test]
fn a_batch_through_several_tet_leaves_has_the_bits_of_single_rays() {
    check(&gyroid(3000), Structure::Bth, 3000, 2);
}

#[test]
fn batches_far_from_the_origin_have_the_bits_of_single_rays() {
    check(&scaled(torus_knot(600), 1.0, [300.0, -700.0, 1100.0]), Structure::Tets, 1500, 3);
}

#[test]
fn batches_at_all_scales_have_the_bits_of_single_rays() {
    for scale in [1e30, 1e18, 1e12, 1e-9, 1e-14, 1e-20, 1e-30] {
        check(&scaled(torus_knot(400), scale, [0.0; 3]), Structure::Tets, 700, 4);
    }
}

/// The f32 triangle tests find the hits of the exact test, except for a few rays that pass close to
/// an edge.
#[test]
fn rays_through_two_points_of_a_surface_get_the_same_bits_on_every_instruction_set() {
    let _turn = turn();
    let model = torus_knot(4_000);
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let scene = compiled(&model, Structure::Bvh);
    let mut rng = Rng::new(5);
    let mut within = || {
        let [a, b, c] = corners[rng.below(corners.len() as u64) as usize];
        let [u, v] = [0, 1].map(|_| rng.below(1 << 20) as f32 / (1 << 21) as f32);
        [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]))
    };
    let mut ray = || {
        let (from, to) = (within(), within());
        // From outside, through two points of the surface.
        let direction = [0, 1, 2].map(|k| to[k] - from[k]);
        Ray {
            origin: [0, 1, 2].map(|k| from[k] - 9.0 * direction[k]),
            tmin: 0.0,
            direction,
            tmax: f32::INFINITY,
        }
    };
    let rays: Vec<Ray> = (0..20_000).map(|_| ray()).collect();
    let mut exact = vec![Hit::MISS; rays.len()];
    scene.batch(&rays).nearest(&mut exact);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.batch(&rays).nearest(&mut hits);
        assert!(exact.iter().zip(&hits).all(|(a, b)| bits(a) == bits(b)), "{isa}");
    }
    Isa::best().choose().unwrap();
}

#[test]
fn a_batch_on_many_threads_has_the_answers_of_one() {
    let _turn = turn();
    let model = gyroid(2000);
    let scene = compiled(&model, Structure::Bvh);
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    // More rays than one task takes, and not a multiple of that.
    are_alike_in_parallel(&scene, &rays_about_hits(&scene, &corners, 10_001, 5));
    are_alike_in_parallel(&scene, &starts_about_hits(&scene, &corners, 5_003, 5));
}

fn are_alike_in_parallel<R: TraceRay + std::fmt::Debug>(scene: &Scene, rays: &[R]) {
    let (mut alone, mut together) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
    scene.batch(rays).nearest(&mut alone);
    scene.batch(rays).parallel().nearest(&mut together);
    let (mut any_alone, mut any_together) = (vec![false; rays.len()], vec![false; rays.len()]);
    scene.batch(rays).any(&mut any_alone);
    scene.batch(rays).parallel().any(&mut any_together);
    for i in 0..rays.len() {
        assert_eq!(bits(&together[i]), bits(&alone[i]), "{:?}", rays[i]);
    }
    assert_eq!(any_together, any_alone);
    assert!(any_alone.contains(&true) && any_alone.contains(&false));
}

#[test]
fn conditions_of_a_batch_are_those_of_its_rays() {
    let _turn = turn();
    let model = gyroid(2000);
    let scene = compiled(&model, Structure::Bvh);
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let rays = assorted(&corners, 6_000, 7);
    let even = |_: &Ray, hit: &Hit| hit.primitive.triangle.is_multiple_of(2);
    let accept = Accept { filter: Some(&even), ..Accept::default() };
    let (mut alone, mut together) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
    scene.batch(&rays).accept(&accept).nearest(&mut alone);
    scene.batch(&rays).accept(&accept).parallel().nearest(&mut together);
    let mut any = vec![false; rays.len()];
    scene.batch(&rays).accept(&accept).parallel().any(&mut any);
    let mut some_hits = 0;
    for (i, ray) in rays.iter().enumerate() {
        let expected = scene.nearest_accepted(ray, &accept);
        assert_eq!(bits(&alone[i]), bits(&expected.unwrap_or(Hit::MISS)), "{ray:?}");
        assert_eq!(bits(&together[i]), bits(&alone[i]), "{ray:?}");
        assert_eq!(any[i], expected.is_some(), "{ray:?}");
        some_hits += usize::from(expected.is_some());
    }
    assert!(some_hits > rays.len() / 4 && some_hits < rays.len(), "{some_hits}");
}

/// A hit a little behind the origin is rounded to t = 0 where coordinates are tiny compared with
/// directions.
#[test]
fn hits_that_are_rounded_to_the_origin_are_found_through_tetrahedra() {
    check(&scaled(torus_knot(360), 1e-40, [0.0; 3]), Structure::Tets, 500, 6);
}
