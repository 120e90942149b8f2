//! Starts on instances: against the exact oracle where transforms are exact, and against each other
//! where they are not.

use crate::check::{check_isas, turn};
use bth::rays::{Hit, StartRay};
use bth::{Accept, Scene, SceneBuilder};
use bth_compile::free::KeepFree;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_random::Rng;
use bth_scenes::Model;
use bth_tests::by_day;
use bth_tests::meshes::{cube, mesh};
use bth_tests::oracle::World;
use bth_tests::rays::{alone, coherent_starts, starts};
use bth_tests::structures::{compiled, options};

/// Rows of a matrix that turns by multiples of 90 degrees, mirrors, and scales by powers of two, to
/// integer places.
fn exact_transform(rng: &mut Rng) -> [f32; 12] {
    let mut axes = [0, 1, 2];
    axes.swap(0, rng.below(3) as usize);
    axes.swap(1, 1 + rng.below(2) as usize);
    let mut rows = [0.0; 12];
    for k in 0..3 {
        let scale = [1.0, -1.0, 0.5, -2.0][rng.below(4) as usize];
        (rows[4 * k + axes[k]], rows[4 * k + 3]) = (scale, rng.below(9) as f32 - 4.0);
    }
    rows
}

/// Turned, mirrored, scaled and moved by any numbers.
fn any_transform(rng: &mut Rng) -> [f32; 12] {
    let scale = [1.0, -0.3, 20.0, 1e-3][rng.below(4) as usize];
    let mut rows = [0.0; 12];
    for k in 0..3 {
        (0..3).for_each(|j| {
            rows[4 * k + j] = scale * (rng.unit_f32() - 0.5 + if j == k { 1.5 } else { 0.0 });
        });
        rows[4 * k + 3] = (rng.unit_f32() - 0.5) * 8.0;
    }
    rows
}

fn placed(objects: &[Scene], count: usize, mut transform: impl FnMut() -> [f32; 12]) -> Scene {
    let mut builder = SceneBuilder::new();
    let objects: Vec<u32> = objects.iter().map(|object| builder.add(object)).collect();
    for i in 0..count {
        builder.instance(objects[i % objects.len()], &transform()).unwrap();
    }
    builder.commit().unwrap();
    builder.into_scene()
}

/// Rays from all instances, in directions of the world.
fn rays(scene: &Scene, models: &[Model], count: usize, rng: &mut Rng) -> Vec<StartRay> {
    let mut all = Vec::new();
    for instance in 0..scene.instance_count() {
        let model = &models[instance as usize % models.len()];
        let corners: Vec<_> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
        let mut of = starts(&corners, count, rng.next());
        of.extend(coherent_starts(&corners, 1, rng.next()));
        let rows = scene.instance(instance).to_world;
        for ray in &mut of {
            ray.start.primitive.instance = instance;
            let d = ray.direction.map(f64::from);
            ray.direction = [0, 1, 2].map(|k| (0..3).map(|j| rows[k][j] * d[j]).sum::<f64>() as f32);
        }
        all.extend(of);
    }
    let onward: Vec<StartRay> = (alone(scene, &all).iter().zip(&all[1..]))
        .filter(|(hit, _)| hit.is_hit())
        .map(|(hit, next)| StartRay::from_hit(hit, next.direction).with_tmax(next.tmax))
        .collect();
    all.extend(onward);
    all
}

/// Queries of a ray that must agree.
fn agree(scene: &Scene, ray: &StartRay, hit: &Hit, context: &str) {
    let (everything, mut all) = (Accept::default(), Vec::new());
    scene.all_hits(ray, &everything, &mut all);
    assert_eq!(all.first().copied().unwrap_or(Hit::MISS), *hit, "{context}: {ray:?}");
    assert_eq!(scene.count_hits(ray, &everything), all.len(), "{context}: {ray:?}");
    let keep = |_: &_, _: &_| true;
    let accept = Accept { filter: Some(&keep), ..everything };
    assert_eq!(scene.nearest_accepted(ray, &accept).unwrap_or(Hit::MISS), *hit, "{context}: {ray:?}");
    assert_eq!(scene.any_accepted(ray, &accept), hit.is_hit(), "{context}: {ray:?}");
    let own = |hit: &&Hit| hit.primitive == ray.start.primitive;
    assert_eq!(all.iter().filter(own).count(), 0, "{context}: {ray:?} hits what it leaves");
}

#[test]
fn instances_under_exact_transforms_agree_with_the_oracle() {
    let _turn = turn();
    let (mut hits, mut count) = (0, 0);
    for seed in 0..by_day(5, 10) {
        let rng = &mut Rng::new(seed);
        let models = [cube(1 + seed as usize % 2, None), mesh(0, rng)];
        let objects = models.clone().map(|m| compiled(&m, &options(Structure::Bvh)));
        let scene = placed(&objects, [1, 2, 5, 20][seed as usize % 4], || exact_transform(rng));
        // With coarse weights nothing is rounded in the world or on the way into other instances.
        let mut rays = rays(&scene, &models, [80, 60, 30, 10][seed as usize % 4], rng);
        for ray in &mut rays {
            let coarse = |x: f32| (x * 64.0).floor() / 64.0;
            (ray.start.u, ray.start.v) = (coarse(ray.start.u), coarse(ray.start.v));
        }
        let (expected, world) = (alone(&scene, &rays), World::new(&scene));
        for (ray, hit) in rays.iter().zip(&expected).step_by(3) {
            let truth = world.nearest(ray);
            let is_same = truth.as_ref().map_or(!hit.is_hit(), |truth| {
                let off = (f64::from(hit.t) - truth.t_f64()).abs();
                hit.is_hit()
                    && off <= truth.t_f64() * 1.01 / f64::from(1 << 24)
                    && truth.triangles.contains(&hit.primitive)
            });
            assert!(is_same, "seed {seed}: {ray:?}: {hit:?} {truth:?}");
        }
        check_isas(&scene, &rays, &expected, &format!("seed {seed}"), &|ray, hit, context| {
            agree(&scene, ray, hit, context);
        });
        hits += expected.iter().filter(|hit| hit.is_hit()).count();
        count += rays.len();
    }
    assert!(hits > count / 4, "{hits} of {count}");
}

#[test]
fn instances_under_any_transform_agree_with_themselves() {
    let _turn = turn();
    let (mut hits, mut count) = (0, 0);
    for seed in 0..by_day(5, 10) {
        let rng = &mut Rng::new(100 + seed);
        let models = [mesh(7, rng), bth_scenes::knot::torus_knot(700)];
        let mut of = options(Structure::Bvh);
        let deformable = seed % 5 == 4;
        of.free.keep = [KeepFree::None, KeepFree::All, KeepFree::Distances][seed as usize % 3];
        if deformable {
            of.free.keep = KeepFree::None;
        }
        let of = CompileOptions { deformable, ..of };
        let objects = models.clone().map(|model| compiled(&model, &of));
        let scene = placed(&objects, [1, 2, 5, 20, 64][seed as usize % 5], || any_transform(rng));
        let rays = rays(&scene, &models, [200, 100, 60, 20, 5][seed as usize % 5], rng);
        let expected = alone(&scene, &rays);
        check_isas(&scene, &rays, &expected, &format!("seed {seed}"), &|ray, hit, context| {
            agree(&scene, ray, hit, context);
        });
        hits += expected.iter().filter(|hit| hit.is_hit()).count();
        count += rays.len();
    }
    assert!(hits > count / 4, "{hits} of {count}");
}
