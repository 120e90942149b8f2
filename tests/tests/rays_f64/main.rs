//! Rays in f64 against exact arithmetic: through models, through files of several objects and
//! through instances, alone and in batches, on every instruction set.

mod building;
mod models;

use bth::rays::{Hit, Hit64, Ray64};
use bth::{Accept, Isa, Scene, TraceRay};
use bth_format::exact::is_zero_area;
use bth_random::Rng;
use bth_tests::meshes::mesh;
use bth_tests::oracle::World;
use bth_tests::placed_soup::{placed_soup, soups};
use std::sync::Mutex;

/// Tests that choose an instruction set take turns.
static CHOICE: Mutex<()> = Mutex::new(());

type Corners = [[f32; 3]; 3];

/// Triangles with area of a random mesh.
fn triangles(kind: usize, rng: &mut Rng) -> Vec<Corners> {
    loop {
        let model = mesh(kind, rng);
        let all = (0..model.triangles.len()).map(|i| model.corners(i));
        let found: Vec<_> = all.filter(|corners| !is_zero_area(*corners)).take(200).collect();
        if !found.is_empty() {
            return found;
        }
    }
}

fn unit(rng: &mut Rng) -> f64 {
    rng.below(1 << 52) as f64 / (1u64 << 51) as f64 - 1.0
}

/// Rays at points, edges and vertices of triangles in world space, from numbers that f32 does not
/// hold. Some ranges end at a hit, or next to it.
fn rays(world: &[[[f64; 3]; 3]], count: usize, rng: &mut Rng) -> Vec<Ray64> {
    let mut rays = Vec::new();
    while rays.len() < count {
        let [a, b, c] = world[rng.below(world.len() as u64) as usize];
        let size = (0..3).fold(0.0f64, |most, k| most.max((b[k] - a[k]).abs()).max((c[k] - a[k]).abs()));
        let [u, v] = match rng.below(4) {
            0 => [0.0, 0.0],
            1 => [0.5, 0.0],
            2 => [0.5, 0.5],
            _ => [0.25 + 0.2 * unit(rng), 0.25 + 0.2 * unit(rng)],
        };
        let target = [0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
        // Some directions must be scaled before they are rounded to f32.
        let long = [1.0, 1.0, 1.0, 1e24f32, 1e-24][rng.below(5) as usize];
        let long = f64::from_bits(f64::from(long).to_bits() >> 52 << 52);
        let direction = [(); 3].map(|()| unit(rng) * size * long);
        // The origin is exact for many rays, so that they hit vertices exactly.
        let steps = [1.0, 2.0, 1.0 / 3.0][rng.below(3) as usize] / long;
        let origin = [0, 1, 2].map(|k| target[k] - steps * direction[k]);
        let ray = Ray64::new(origin, direction);
        rays.push(match rng.below(5) {
            0 => ray.with_range(f64::NEG_INFINITY, f64::INFINITY),
            1 => ray.with_range(0.0, steps),
            2 => ray.with_range(steps, f64::INFINITY),
            3 => ray.with_range(-steps, steps * (1.0 + f64::EPSILON * 4.0)),
            _ => ray,
        });
    }
    rays
}

/// Checks that batches and single rays have these hits on every instruction set, and returns the
/// number of rays that hit.
fn check_everywhere<R: TraceRay + std::fmt::Debug>(
    scene: &Scene,
    rays: &[R],
    expected: &[Hit],
    context: &str,
) -> usize {
    let chosen = Isa::chosen();
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().unwrap();
        let (mut hits, mut any) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        scene.batch(rays).nearest(&mut hits);
        scene.batch(rays).any(&mut any);
        assert_eq!(hits, expected, "{isa}, {context}");
        assert!(any.iter().zip(expected).all(|(any, hit)| *any == hit.is_hit()), "{isa}, {context}");
        for (ray, expected) in rays.iter().zip(expected).step_by(5) {
            assert_eq!(scene.nearest(ray).unwrap_or(Hit::MISS), *expected, "{isa}, {context}");
        }
    }
    chosen.choose().unwrap();
    expected.iter().filter(|hit| hit.is_hit()).count()
}

/// Checks the rays, and returns the number of those that hit.
fn check(scene: &Scene, rays: &[Ray64], context: &str) -> usize {
    let (world, mut expected) = (World::new(scene), Vec::new());
    for ray in rays {
        let (hit, truth) = (scene.nearest(ray), world.nearest(ray));
        let context = || format!("{context}: {ray:?}: {hit:?}, {truth:?}");
        assert_eq!(hit.is_some(), truth.is_some(), "{}", context());
        assert_eq!(scene.any(ray), truth.is_some(), "any hit, {}", context());
        let mut all = Vec::new();
        scene.all_hits(ray, &Accept::default(), &mut all);
        assert_eq!(all.is_empty(), truth.is_none(), "all hits, {}", context());
        expected.push(hit.unwrap_or(Hit::MISS));
        let (Some(hit), Some(truth)) = (hit, &truth) else {
            assert_eq!(scene.hit_f64(ray, &Hit::MISS), Hit64::MISS);
            continue;
        };
        // Of triangles at exactly the same t, the first.
        assert!(truth.triangles.contains(&hit.primitive), "{}", context());
        let found = scene.hit_f64(ray, &hit);
        let t = truth.t_f64();
        assert!((found.t - t).abs() <= t.abs() / (1u64 << 40) as f64, "{found:?}, {}", context());
        assert!((hit.t - t as f32).abs() <= t.abs() as f32 / (1 << 23) as f32, "{}", context());
        let at = world.intersection(ray, hit.primitive).expect("a hit");
        let [u, v] = [&at.u, &at.v].map(bth_tests::oracle::to_f64);
        let off = (found.u - u).abs().max((found.v - v).abs());
        assert!(off <= 1.0 / (1u64 << 28) as f64, "{found:?}, {}", context());
    }
    check_everywhere(scene, rays, &expected, context)
}

#[test]
fn rays_in_f64_have_the_exact_hits_of_models_and_instances() {
    let _choice = CHOICE.lock();
    let (mut hits, mut count) = (0, 0);
    for seed in 0..bth_tests::by_day(12, 60) {
        let rng = &mut Rng::new(seed);
        let list = triangles(seed as usize % 7, rng);
        let places = match seed % 3 {
            0 => Vec::new(),
            _ => (0..1 + seed as usize % 4).map(|_| matrix(rng)).collect(),
        };
        let scene = bth::from_bytes(&placed_soup(&list, &places)).unwrap();
        let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let images = if places.is_empty() { vec![identity] } else { places };
        let world: Vec<_> =
            images.iter().flat_map(|m| list.iter().map(|corners| image(m, corners))).collect();
        let rays = rays(&world, 150, rng);
        hits += check(&scene, &rays, &format!("seed {seed}"));
        count += rays.len();
    }
    assert!(hits > count / 2, "{hits} of {count}");
}

#[test]
fn rays_in_f64_have_the_exact_hits_of_several_objects() {
    let _choice = CHOICE.lock();
    for seed in 0..4 {
        let rng = &mut Rng::new(seed);
        let lists = [0, 1, 6].map(|kind| triangles(kind, rng));
        let leaves = |list: &Vec<Corners>| {
            let ids: Vec<u32> = (0..list.len() as u32).collect();
            ids.chunks(16).map(<[u32]>::to_vec).collect()
        };
        let objects: Vec<(&[_], _)> = lists.iter().map(|list| (&list[..], leaves(list))).collect();
        let scene = bth::from_bytes(&soups(&objects)).unwrap();
        let world: Vec<_> = lists.iter().flatten().map(|of| of.map(|p| p.map(f64::from))).collect();
        assert!(check(&scene, &rays(&world, 150, rng), &format!("seed {seed}")) > 50);
    }
}

/// Without TRIANGLE_PLACES the corners are read from the triangles of the source.
#[test]
fn rays_in_f64_have_the_exact_hits_of_files_without_places() {
    let _choice = CHOICE.lock();
    let names = ["triangle", "two-levels", "exact-positions", "grid-16", "grid-21", "tets-link32"];
    let files = bth_tests::conformance::valid();
    for name in names {
        let file = files.iter().find(|case| case.name == name).unwrap();
        let scene = bth::from_bytes(&file.bytes).unwrap();
        let places = (0..scene.object_count()).map(|object| scene.object(object).places.len());
        assert_eq!(places.sum::<usize>(), 0, "{name}");
        let hits = check(&scene, &rays(&models::images(&scene), 150, &mut Rng::new(1)), name);
        assert!(hits > 30, "{name}: {hits}");
    }
}

#[test]
fn instances_nearer_than_f32_can_tell_are_in_order() {
    let _choice = CHOICE.lock();
    let at = |z: f64| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, z];
    let triangle = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
    let scene = bth::from_bytes(&placed_soup(&[triangle], &[at(1e-9), at(0.0), at(2e-9)])).unwrap();
    let instances = |hits: &[Hit]| -> Vec<u32> { hits.iter().map(|hit| hit.primitive.instance).collect() };
    for (start, order) in [(-5.3, [1, 0, 2]), (5.3, [2, 0, 1])] {
        let ray = Ray64::new([0.1, 0.1, start], [0.0, 0.0, -start]);
        let first = |hit: Option<Hit>| instances(hit.as_slice());
        assert_eq!(first(scene.nearest(&ray)), [order[0]]);
        let keep = |_: &_, hit: &Hit| hit.primitive.instance != order[0];
        let accept = Accept { filter: Some(&keep), ..Accept::default() };
        assert_eq!(first(scene.nearest_accepted(&ray, &accept)), [order[1]]);
        let (mut all, mut two) = (Vec::new(), Vec::new());
        scene.all_hits(&ray, &Accept::default(), &mut all);
        scene.nearest_hits(&ray, 2, &Accept::default(), &mut two);
        assert_eq!((&instances(&all)[..], &instances(&two)[..]), (&order[..], &order[..2]));
        let mut batch = vec![Hit::MISS; 100];
        scene.batch(&[ray; 100]).nearest(&mut batch);
        assert_eq!(instances(&batch), [order[0]; 100]);
    }
}

/// A random transform: rows of four.
fn matrix(rng: &mut Rng) -> [f64; 12] {
    let coarse = rng.below(2) == 0;
    std::array::from_fn(|i| {
        let x = unit(rng) * 2.0;
        let x = if coarse { (x * 8.0).round() / 8.0 } else { x };
        if i % 5 == 0 { x + 3.0 } else { x }
    })
}

fn image(m: &[f64; 12], corners: &Corners) -> [[f64; 3]; 3] {
    corners.map(|p| {
        let [x, y, z] = p.map(f64::from);
        [0, 4, 8].map(|row| m[row] * x + m[row + 1] * y + m[row + 2] * z + m[row + 3])
    })
}
