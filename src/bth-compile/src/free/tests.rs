//! What is called free against every triangle of a mesh, exactly.

use super::*;
use crate::bvh::{self, BvhOptions};
use crate::marks::testing::{patch, sphere, weld};
use bth::rays::Ray;
use bth_format::layout::{FREE_BINS, free_bin};
use bth_import::Silent;
use bth_oracle::{intersection, to_f64};
use bth_random::Rng;

fn free_of(mesh: &Mesh) -> Free {
    let (tree, _) = bvh::build(mesh, &BvhOptions::default(), &Silent).unwrap();
    find(mesh, &tree, &FreeOptions::default(), &Silent).unwrap().0
}

/// A height field of integer steps, with flat parts.
fn terraces(side: usize, seed: u64) -> Mesh {
    let mut random = Rng::new(seed);
    let heights: Vec<f32> = (0..(side + 1) * (side + 1)).map(|_| (random.below(9) / 6) as f32).collect();
    let at = |x: usize, y: usize| [x as f32, y as f32, heights[y * (side + 1) + x]];
    let mut corners = Vec::new();
    for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
        corners.push([at(x, y), at(x + 1, y), at(x, y + 1)]);
        corners.push([at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
    }
    weld(&corners)
}

fn soup(count: usize, seed: u64) -> Mesh {
    let mut random = Rng::new(seed);
    let mut corners = Vec::new();
    for _ in 0..count {
        let at: [f64; 3] = std::array::from_fn(|_| random.between(-3.0, 3.0));
        corners.push(std::array::from_fn(|_| {
            let d = random.unit_vector();
            std::array::from_fn(|k| (at[k] + d[k]) as f32)
        }));
    }
    weld(&corners)
}

/// A start on a triangle: a corner, a point of an edge, or one inside, moved a little along the direction or not at all.
fn start(random: &mut Rng, corners: [[f32; 3]; 3], direction: [f32; 3]) -> [f32; 3] {
    let mut weights = match random.below(3) {
        0 => [1.0, 0.0, 0.0],
        1 => [random.unit_f64(), 0.0, 0.0],
        _ => [random.unit_f64(), random.unit_f64(), 0.0],
    };
    if weights[0] + weights[1] > 1.0 {
        weights = [1.0 - weights[0], 1.0 - weights[1], 0.0];
    }
    weights[2] = 1.0 - weights[0] - weights[1];
    weights.rotate_left(random.below(3) as usize);
    let along = [0.0, 1e-6, 1e-3, -1e-3][random.below(4) as usize];
    std::array::from_fn(|k| {
        let p: f64 = (0..3).map(|c| weights[c] * f64::from(corners[c][k])).sum();
        (p + along * f64::from(direction[k])) as f32
    })
}

/// Traces rays through the triangles of a mesh in directions that are called free, and returns how many were.
fn check(mesh: &Mesh, rays: usize, seed: u64) -> usize {
    let free = free_of(mesh);
    let reach = f64::from(free.reach);
    let mut random = Rng::new(seed);
    let mut used = 0;
    for _ in 0..rays {
        let triangle = random.below(mesh.triangles.len() as u64) as usize;
        let direction = match random.below(4) {
            // Directions on the borders of bins and along axes are among these.
            0 => std::array::from_fn(|_| random.below(3) as f32 - 1.0),
            _ => random.unit_vector().map(|x| x as f32),
        };
        if direction == [0.0; 3] {
            continue;
        }
        let class = FreeDirections { place: NONE, classes: free.classes[triangle] }.class(free_bin(direction));
        let corners = mesh.corners(triangle as u32);
        let ray = Ray::new(start(&mut random, corners, direction), direction);
        let Some(from) = intersection(&ray, corners).filter(|_| class != FreeClass::Unknown) else { continue };
        used += 1;
        let length = direction.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
        for other in 0..mesh.triangles.len() as u32 {
            let Some(hit) = intersection(&ray, mesh.corners(other)).filter(|hit| hit.t > from.t) else { continue };
            let distance = to_f64(&(hit.t - &from.t)) * length;
            let found = format!("{triangle} {corners:?} to {other} {:?}: {ray:?}", mesh.corners(other));
            assert_eq!(class, FreeClass::Near, "{found}");
            assert!(distance > reach * (1.0 - 1e-9), "{distance} below {reach}: {found}");
        }
    }
    used
}

#[test]
fn rays_in_free_directions_meet_nothing() {
    let mut used = 0;
    for seed in 0..6 {
        used += check(&terraces(6, seed), 3000, seed);
        used += check(&soup(60, seed), 3000, seed);
        used += check(&patch(seed, 12), 3000, seed);
    }
    used += check(&sphere(10, [0.0; 3]), 4000, 1);
    used += check(&sphere(9, [1000.0, -50.0, 3.0]), 4000, 2);
    assert!(used > 10_000, "{used}");
}

#[test]
fn a_convex_solid_is_free_outside_and_blocked_inside() {
    let mesh = sphere(12, [0.0; 3]);
    let free = free_of(&mesh);
    for (triangle, classes) in free.classes.iter().enumerate() {
        let row = FreeDirections { place: NONE, classes: *classes };
        let outwards = Ray::new([0.0; 3], mesh.corners(triangle as u32)[0]).direction;
        assert_eq!(row.class(free_bin(outwards)), FreeClass::All);
        assert_eq!(row.class(free_bin(outwards.map(|x| -x))), FreeClass::Near);
        let all = (0..FREE_BINS).filter(|bin| row.class(*bin) == FreeClass::All).count();
        assert!((24..=48).contains(&all), "{all}");
    }
}

#[test]
fn a_plane_is_free_on_both_sides_though_its_triangles_touch() {
    let mut mesh = terraces(5, 1);
    mesh.positions.iter_mut().for_each(|p| p[2] = 0.1);
    for classes in free_of(&mesh).classes {
        let row = FreeDirections { place: NONE, classes };
        // All bins but those around the horizon.
        let all = (0..FREE_BINS).filter(|bin| row.class(*bin) == FreeClass::All).count();
        assert_eq!(all, 2 * 32);
    }
}

#[test]
fn duplicates_and_triangles_without_area_block_nothing() {
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]];
    let single = free_of(&weld(&[[a, b, c]]));
    let mesh = weld(&[[a, b, c], [c, b, a], [a, b, c], [a, a, [0.2, 0.2, 9.0]], [[0.25; 3], [0.5; 3], [0.75; 3]]]);
    let free = free_of(&mesh);
    // The reach differs with the box, but nothing is beyond it.
    assert!(free.classes[..3].iter().all(|classes| *classes == single.classes[0]));
    assert!(free.classes[3..].iter().all(|classes| *classes == [0; FREE_BYTES]));
}

#[test]
fn distant_triangles_block_beyond_the_reach_only() {
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let above = |height: f32, half: f32| {
        [[-half, -half, height], [half, -half, height], [0.0, half, height]]
    };
    let up = free_bin([0.1, 0.1, 1.0]);
    let class = |height: f32, half: f32| {
        let free = free_of(&weld(&[[a, b, c], above(height, half)]));
        FreeDirections { place: NONE, classes: free.classes[0] }.class(up)
    };
    assert_eq!(class(10.0, 20.0), FreeClass::Near);
    assert_eq!(class(1.0, 20.0), FreeClass::Unknown);
}

#[test]
fn results_do_not_depend_on_threads() {
    let mesh = soup(700, 3);
    let in_pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| free_of(&mesh))
    };
    assert_eq!(in_pool(1), in_pool(3));
}

#[test]
fn huge_and_tiny_meshes_have_no_reach_but_are_right() {
    for scale in [1e-30f32, 1e30] {
        let mut mesh = soup(20, 5);
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        assert_eq!(free_of(&mesh).reach, 0.0);
        assert!(check(&mesh, 500, 6) > 10);
    }
    let free = free_of(&Mesh::default());
    assert_eq!((free.reach, free.classes.len()), (0.0, 0));
}
