//! Batches of rays from starts through files with free directions.

use crate::{scaled, starts_about_hits, turn};
use bth::rays::{PrimitiveRef, Start, StartRay};
use bth::{Isa, Scene, SceneBuilder};
use bth_compile::Silent;
use bth_compile::free::{FreeOptions, KeepFree, Kept};
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_format::layout::GridBits;
use bth_random::Rng;
use bth_scenes::{Model, gyroid::gyroid, knot::torus_knot};
use bth_tests::rays::{alone, check_batch};

/// Compiled with free directions or distances of all triangles, on a grid or not.
fn with_free_directions(model: &Model, options: CompileOptions, keep: KeepFree) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("model.ply");
    bth_scenes::write::file(model, &path).expect("a model file");
    let free = FreeOptions { keep, ..FreeOptions::default() };
    let options = CompileOptions { structure: Structure::Bvh, free, ..options };
    let (compiled, report) = compile(&path, &options, &Silent).expect("a model that compiles");
    assert!(report.free.is_some_and(|free| free.kept != Kept::None && free.beyond[0] > 0.1));
    bth::from_bytes(&compiled.bytes).expect("a file that opens")
}

/// Rays from points of triangles, of their edges and corners, in all directions. Some end early.
fn rays_off_the_surface(corners: &[[[f32; 3]; 3]], count: usize, seed: u64) -> Vec<StartRay> {
    let mut rng = Rng::new(seed);
    let of_ray = |i: usize, rng: &mut Rng| {
        let triangle = rng.below(corners.len() as u64);
        let [a, b, _] = corners[triangle as usize];
        let (u, v) = match i % 4 {
            0 => (0.0, 0.0),
            1 => (rng.unit_f64() as f32, 0.0),
            _ => (0.5 * rng.unit_f64() as f32, 0.5 * rng.unit_f64() as f32),
        };
        let d = rng.unit_vector().map(|x| x as f32);
        let length = |p: [f32; 3]| p.iter().map(|x| x * x).sum::<f32>().sqrt();
        let edge = length([0, 1, 2].map(|k| b[k] - a[k]));
        // Lengths of directions and ranges vary.
        let scale = [1.0, 1e-3, 3e5, 1e-30][i / 16 % 4];
        let tmax = [f32::INFINITY, 10.0 * edge / scale, 0.5 * edge / scale][i % 3];
        let triangle = if rng.below(50) == 0 { triangle + corners.len() as u64 } else { triangle };
        let start = Start { primitive: PrimitiveRef { instance: 0, triangle: triangle as u32 }, u, v };
        start.ray(d.map(|x| x * scale)).with_tmax(tmax)
    };
    (0..count).map(|i| of_ray(i, &mut rng)).collect()
}

/// Returns true if a ray points to the side of a triangle from which its corners go around
/// counterclockwise.
fn is_outward(ray: &StartRay, [a, b, c]: &[[f32; 3]; 3]) -> bool {
    let [p, q] = [b, c].map(|corner| [0, 1, 2].map(|k| corner[k] - a[k]));
    let normal = [0, 1, 2].map(|k| p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3]);
    (0..3).map(|k| f64::from(normal[k]) * f64::from(ray.direction[k])).sum::<f64>() > 0.0
}

/// Of [`rays_off_the_surface`], 100,000 of them, those that leave the outside of a triangle, and
/// some of all: many of them end without being traced.
fn rays_of_which_many_end(corners: &[[[f32; 3]; 3]], seed: u64) -> Vec<StartRay> {
    let leaves = |i: usize, ray: &StartRay| {
        let of = corners.get(ray.start.primitive.triangle as usize);
        i % 4 >= 2 && of.is_some_and(|corners| is_outward(ray, corners))
    };
    let all = rays_off_the_surface(corners, 100_000, seed).into_iter().enumerate();
    all.filter(|(i, ray)| i % 36 == 5 || leaves(*i, ray)).map(|(_, ray)| ray).collect()
}

/// Groups of 64 rays in almost the same direction, each from the outside of a triangle near the one
/// before: such rays go in packets.
fn parallel_rays(corners: &[[[f32; 3]; 3]], groups: usize, seed: u64) -> Vec<StartRay> {
    const GROUP: usize = 64;
    let mut rng = Rng::new(seed);
    let mut all = Vec::new();
    while all.len() < groups * GROUP {
        let d = rng.unit_vector().map(|x| x as f32);
        let first = rng.below(corners.len() as u64) as usize;
        let of_triangle = |i: usize| {
            let triangle = ((first + i) % corners.len()) as u32;
            let direction = d.map(|x| x * (1.0 + 1e-4 * (i % 7) as f32));
            let third = 1.0 / 3.0;
            Start { primitive: PrimitiveRef { instance: 0, triangle }, u: third, v: third }.ray(direction)
        };
        let facing = (0..corners.len()).map(of_triangle);
        let facing = facing.filter(|ray| is_outward(ray, &corners[ray.start.primitive.triangle as usize]));
        all.extend(facing.take(GROUP));
    }
    all
}

/// Free directions and distances change no bit.
fn check_free_directions(model: &Model, options: CompileOptions) {
    let _turn = turn();
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    for keep in [KeepFree::All, KeepFree::Distances] {
        check_starts(&with_free_directions(model, options.clone(), keep), &corners);
    }
}

/// Rays from starts in batches, with all instruction sets, against rays that are traced one by one,
/// for which the file tells nothing.
fn check_starts(scene: &Scene, corners: &[[[f32; 3]; 3]]) {
    let mut rays = starts_about_hits(scene, corners, 3000, 11);
    rays.extend(rays_off_the_surface(corners, 30_000, 12));
    rays.extend(rays_of_which_many_end(corners, 13));
    check_parts(scene, &rays, 1000);
}

/// Compares batches of `size` rays with rays traced alone; returns the number of hits.
fn check_parts(scene: &Scene, rays: &[StartRay], size: usize) -> usize {
    let expected = alone(scene, rays);
    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
        isa.choose().expect("an instruction set that is available");
        for (rays, expected) in rays.chunks(size).zip(expected.chunks(size)) {
            check_batch(scene, rays, expected, isa);
        }
    }
    Isa::best().choose().expect("the best is available");
    expected.iter().filter(|hit| hit.is_hit()).count()
}

#[test]
fn free_directions_change_no_answer() {
    check_free_directions(&torus_knot(2000), CompileOptions::default());
    check_free_directions(&gyroid(3000), CompileOptions::default());
}

/// What is hit lies just behind the distance of a level, so that ranges begin just before it, or
/// just before that distance.
#[test]
fn what_lies_just_behind_a_distance_is_hit() {
    let _turn = turn();
    let start = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]];
    let far = [[0.0, 0.0, -8.0], [9.0, 0.0, -8.0], [0.0, 9.0, -8.0]];
    let diagonal = |height: f32| (18.0f64 * 18.0 * 2.0 + (8.0 + f64::from(height)).powi(2)).sqrt();
    let mut later = 0;
    for level in [1.0 / 128.0, 1.0 / 16.0, 1.0 / 4.0] {
        for beyond in [0.96, 0.999, 1.0001, 1.001, 1.02] {
            // The diagonal grows with the height.
            let height = (0..50).fold(0.0f32, |height, _| (level * diagonal(height) * beyond) as f32);
            let above = [[-9.0, -9.0, height], [9.0, -9.0, height], [0.0, 9.0, height]];
            let positions = [start, far, above].concat();
            let model = Model { positions, triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]] };
            let scene = with_free_directions(&model, CompileOptions::default(), KeepFree::Distances);
            let mut rng = Rng::new(3);
            let primitive = PrimitiveRef { instance: 0, triangle: 0 };
            let rays: Vec<StartRay> = (0..4096)
                .map(|_| {
                    let mut number = |size: f32| rng.unit_f64() as f32 * size;
                    let [u, v, along, scale] = [number(0.4), number(0.4), number(0.1), number(30.0) + 0.03];
                    let direction = [scale * (0.1 * along - 0.005), scale * 0.3 * along, scale];
                    Start { primitive, u, v }.ray(direction).with_tmax(1e30)
                })
                .collect();
            later += usize::from(scene.nearest(&rays[0]).is_some_and(|hit| hit.primitive.triangle == 2));
            check_parts(&scene, &rays, 4096);
            // The same, cut right about their hits.
            let cut = (rays.iter().zip(alone(&scene, &rays)).filter(|(_, hit)| hit.is_hit())).enumerate();
            let cut: Vec<StartRay> = cut
                .map(|(i, (ray, hit))| ray.with_tmax([hit.t, hit.t.next_up(), hit.t.next_down()][i % 3]))
                .collect();
            check_parts(&scene, &cut, 4096);
        }
    }
    assert_eq!(later, 15, "the triangle above is hit");
}

#[test]
fn free_directions_on_a_grid_and_far_from_the_origin_change_no_answer() {
    let mut on_grid = CompileOptions::default();
    on_grid.coordinates.bits = Some(GridBits::B16);
    check_free_directions(&torus_knot(800), on_grid);
    let far = scaled(torus_knot(800), 1.0, [300.0, -700.0, 1100.0]);
    check_free_directions(&far, CompileOptions::default());
}

/// A scene of some instances of an object with free directions, moved, turned, mirrored, scaled and
/// sheared, and their transforms. Several overlap.
fn instances_of(object: &Scene, count: usize, seed: u64) -> (Scene, Vec<[f32; 12]>) {
    let mut rng = Rng::new(seed);
    let mut number = |size: f32| (2.0 * rng.unit_f64() as f32 - 1.0) * size;
    let transforms: Vec<[f32; 12]> = (0..count)
        .map(|i| {
            let scale = [1.0, -0.3, 40.0, 1e-25][i % 4];
            let mut rows = [0.0; 12];
            for k in 0..3 {
                (0..3).for_each(|j| {
                    rows[4 * k + j] = scale * (number(0.4) + if j == (k + i) % 3 { 1.0 } else { 0.0 })
                });
                rows[4 * k + 3] = number([3.0, 3.0, 60.0, 1e-24][i % 4]);
            }
            rows
        })
        .collect();
    let mut builder = SceneBuilder::new();
    let object = builder.add(object);
    for transform in &transforms {
        builder.instance(object, transform).expect("an object");
    }
    builder.commit().expect("transforms that can be inverted");
    (builder.into_scene(), transforms)
}

/// The ray from an instance of an object, in about the direction of the object.
fn placed(ray: &StartRay, instance: u32, rows: &[f32; 12]) -> StartRay {
    let times =
        |v: [f32; 3], k: usize| (0..3).map(|j| f64::from(rows[4 * k + j]) * f64::from(v[j])).sum::<f64>();
    let mut placed = *ray;
    placed.start.primitive.instance = instance;
    placed.direction = [0, 1, 2].map(|k| times(ray.direction, k) as f32);
    placed
}

/// Rays that start on instances; some of the instances do not exist.
#[test]
fn free_directions_of_instances_change_no_answer() {
    let _turn = turn();
    let model = torus_knot(2000);
    let corners: Vec<[[f32; 3]; 3]> = (0..model.triangles.len()).map(|i| model.corners(i)).collect();
    let objects = [KeepFree::All, KeepFree::Distances]
        .map(|keep| with_free_directions(&model, CompileOptions::default(), keep));
    let mut rng = Rng::new(5);
    // A single visible instance is traced in another way.
    for (i, count) in [1, 3, 24, 1, 3, 24].into_iter().enumerate() {
        let object = &objects[i / 3];
        let (scene, transforms) = instances_of(object, count, 21 + count as u64);
        let single = rays_of_which_many_end(&corners, 22);
        let parallel = parallel_rays(&corners, 300, 23);
        let mut packet = 0;
        let rays = parallel.into_iter().chain(single).enumerate().map(|(i, ray)| {
            if i % 64 == 0 {
                packet = rng.below(count as u64) as u32;
            }
            let instance = if i < 300 * 64 { packet } else { rng.below(count as u64) as u32 };
            let mut ray = placed(&ray, instance, &transforms[instance as usize]);
            if rng.below(50) == 0 {
                ray.start.primitive.instance = rng.below(count as u64 + 2) as u32;
            }
            ray
        });
        let rays: Vec<StartRay> = rays.collect();
        let hits = check_parts(&scene, &rays, 5000);
        assert!(hits > 1000, "{count}: {hits} of {}", rays.len());
    }
}
