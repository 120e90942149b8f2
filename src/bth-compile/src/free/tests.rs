//! What is called free against every triangle of a mesh, exactly.

use super::*;
use crate::bvh::{self, BvhOptions};
use bth::rays::Ray;
use bth_bvh::testing::{patch, sphere, weld};
use bth_format::layout::{FREE_MARGIN, FreeBins, FreeLevels, KnownFree, free_axes, free_bin};
use bth_import::Silent;
use bth_oracle::{intersection, to_f64};
use bth_random::Rng;

fn found(mesh: &Mesh, keep: KeepFree) -> (Free, FreeReport) {
    let (tree, _) = bvh::build(mesh, &BvhOptions::default(), &Silent).unwrap();
    find(mesh, &tree, &FreeOptions { keep, ..FreeOptions::default() }, &Silent).unwrap()
}

fn free_of(mesh: &Mesh) -> Free {
    found(mesh, KeepFree::All).0
}

impl Free {
    fn known(&self, triangle: usize) -> KnownFree {
        let directions = self.directions.get(triangle).map(KnownFree::from);
        let distances = || self.distances.get(triangle).map(KnownFree::from);
        directions.or_else(distances).unwrap_or(KnownFree::from(&FreeDistances::UNKNOWN))
    }

    fn bins(&self, triangle: usize) -> FreeBins {
        self.directions[triangle].bins()
    }

    /// The distance within which rays hit nothing in a bin of a side, infinite where it is free.
    fn distance(&self, triangle: usize, (bin, is_back): (usize, bool)) -> f64 {
        let known = self.known(triangle);
        if known.bins.is_free(bin) && known.bins.is_back() == is_back {
            return f64::INFINITY;
        }
        let level = known.sectors[usize::from(is_back)].level_of_bin(bin);
        f64::from(FreeLevels { distance: self.levels, reserved: 0 }.within(level))
    }
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

/// Triangles with the same corners in the same order are decided once, with what each would find by
/// itself.
#[test]
fn coincident_triangles_are_decided_together() {
    let pile: Vec<u32> = (0..600).map(|i| [0, 0, 0, 1, 1, 2][i % 6]).collect();
    let mut mesh = soup(40, 21);
    let pile: Vec<[u32; 3]> = pile.into_iter().map(|i| mesh.triangles[i as usize]).collect();
    mesh.triangles.splice(0..0, pile);
    let (tree, _) = bvh::build(&mesh, &BvhOptions::default(), &Silent).unwrap();
    let wide = Tree::new(&mesh, &tree).unwrap();
    for kept in [Kept::Directions, Kept::Distances] {
        let levels = levels(&tree, 1.0 / 16.0);
        let around = Surroundings { mesh: &mesh, order: &tree.order, tree: wide.clone(), levels, kept };
        let rows = tree.order.len();
        let runs: Vec<_> = around.coincident(0..rows).collect();
        assert!(runs.len() < rows / 2, "{}", runs.len());
        assert!(runs.iter().flat_map(Clone::clone).eq(0..rows));
        let alone = |row: usize| Isa::chosen().run(Decide { around: &around, rows: row..row + 1 });
        let together = Isa::chosen().run(Decide { around: &around, rows: 0..rows });
        assert!(together == (0..rows).flat_map(alone).collect::<Vec<_>>());
    }
}

/// A start on a triangle: a corner, a point of an edge, or one inside, moved a little along the
/// direction or not at all.
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

/// Traces rays through the triangles of a mesh in directions that are called free, at all or up to
/// a distance, and returns how many were.
fn check(mesh: &Mesh, rays: usize, seed: u64) -> usize {
    let both = [KeepFree::All, KeepFree::Distances];
    both.map(|keep| check_found(mesh, &found(mesh, keep).0, rays, seed)).into_iter().sum()
}

fn check_found(mesh: &Mesh, free: &Free, rays: usize, seed: u64) -> usize {
    let mut random = Rng::new(seed);
    let mut used = 0;
    for _ in 0..rays {
        let triangle = random.below(mesh.triangles.len() as u64) as usize;
        let corners = mesh.corners(triangle as u32);
        let Some(axes) = free_axes(corners) else {
            assert!(free.known(triangle).is_nothing());
            continue;
        };
        let direction: [f64; 3] = match random.below(4) {
            // Along axes, edges and diagonals.
            0 => std::array::from_fn(|_| random.below(3) as f64 - 1.0),
            1 => {
                let to = mesh.corners(random.below(mesh.triangles.len() as u64) as u32)[0];
                std::array::from_fn(|k| f64::from(to[k]) - f64::from(corners[0][k]))
            }
            _ => random.unit_vector(),
        };
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        // The bin may be the bin of another direction within the margin.
        let jitter = random.unit_vector();
        let within = 0.9 * FREE_MARGIN * random.unit_f64();
        let other = std::array::from_fn(|k| direction[k] / length + within * jitter[k]);
        let within = free_bin(&axes, other).map_or(0.0, |found| free.distance(triangle, found));
        let direction = direction.map(|x| (x / length) as f32);
        let ray = Ray::new(start(&mut random, corners, direction), direction);
        let Some(from) = intersection(ray, corners).filter(|_| within > 0.0) else { continue };
        used += 1;
        for other in 0..mesh.triangles.len() as u32 {
            let Some(hit) = intersection(ray, mesh.corners(other)).filter(|hit| hit.t > from.t) else {
                continue;
            };
            let distance = to_f64(&(hit.t - &from.t));
            let found = format!("{triangle} {corners:?} to {other} {:?}: {ray:?}", mesh.corners(other));
            assert!(distance > within * (1.0 - 1e-6), "{distance} below {within}: {found}");
        }
    }
    used
}

#[test]
fn rays_in_free_directions_meet_nothing() {
    let mut used = 0;
    for seed in 0..12 {
        used += check(&terraces(6, seed), 4000, seed);
        used += check(&soup(60, seed), 4000, seed);
        used += check(&patch(seed, 12), 4000, seed);
    }
    used += check(&sphere(10, [0.0; 3]), 4000, 1);
    used += check(&sphere(9, [1000.0, -50.0, 3.0]), 4000, 2);
    assert!(used > 25_000, "{used}");
}

#[test]
fn a_convex_solid_is_free_outside() {
    let free = free_of(&sphere(12, [0.0; 3]));
    let open: Vec<u32> = (0..free.directions.len())
        .map(|triangle| {
            let bins = free.bins(triangle).0;
            assert_eq!(bins & !FreeBins::ALL, 0, "{triangle}: of the front, and at any distance");
            bins.count_ones()
        })
        .collect();
    // Boxes reach beyond the solid, and what is small for its distance blocks bins close to the
    // horizon without a proof.
    let all = open.iter().filter(|bins| **bins == FreeBins::ALL.count_ones()).count();
    assert!(all * 3 >= open.len() * 2, "{all} of {} triangles are free in all directions", open.len());
    assert!(open.iter().all(|bins| bins * 3 >= FreeBins::ALL.count_ones() * 2), "{open:?}");
}

#[test]
fn a_solid_that_is_inside_out_is_free_on_the_back() {
    let mut mesh = sphere(8, [0.0; 3]);
    mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    // Rays from the back hit nothing at all. Where rays from the front hit nothing up to some
    // distance, the row may hold that instead.
    let free = free_of(&mesh);
    let is_open = |t: usize| free.bins(t).0 & FreeBins::ALL == FreeBins::ALL;
    let is_told =
        |t: usize| if free.bins(t).is_back() { is_open(t) } else { free.directions[t].sectors != 0 };
    assert!((0..free.directions.len()).all(is_told));
    let distances = found(&mesh, KeepFree::Distances).0.distances;
    assert!(distances.iter().all(|row| row.sectors[1] == u32::MAX && row.sectors[0] != u32::MAX));
}

#[test]
fn a_plane_is_free_though_its_triangles_touch() {
    let mut mesh = terraces(5, 1);
    mesh.positions.iter_mut().for_each(|p| p[2] = 0.1);
    let free = free_of(&mesh);
    assert!((0..free.directions.len()).all(|triangle| free.bins(triangle).0 == FreeBins::ALL));
}

#[test]
fn duplicates_and_triangles_without_area_block_nothing() {
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]];
    let mesh =
        weld([[a, b, c], [c, b, a], [a, b, c], [a, a, [0.2, 0.2, 9.0]], [[0.25; 3], [0.5; 3], [0.75; 3]]]);
    let free = free_of(&mesh);
    assert!((0..3).all(|triangle| free.bins(triangle).0 == FreeBins::ALL));
    assert!((3..5).all(|triangle| free.known(triangle).is_nothing()));
}

#[test]
fn distant_triangles_block_beyond_their_distance_only() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let above = |height: f32| [[-40.0, -40.0, height], [40.0, -40.0, height], [0.0, 40.0, height]];
    let up = free_bin(&free_axes(corners).unwrap(), [0.1, 0.1, 1.0]).unwrap();
    assert!(!up.1);
    for height in [0.01, 0.5, 1.0, 3.0, 10.0, 25.0, 50.0] {
        let mesh = weld([corners, above(height)]);
        let free = found(&mesh, KeepFree::Distances).0;
        // The largest level below the height, since nothing else is there.
        let levels = free.levels.map(f64::from);
        let expected =
            levels.into_iter().filter(|level| *level < f64::from(height) * 0.999).fold(0.0, f64::max);
        assert_eq!(free.distance(0, up), expected, "{height}: {levels:?}");
        let downwards = free.known(0).sectors[1];
        assert_eq!(downwards.0, u32::MAX, "nothing is below");
        // Where one side is told, it is the back if nothing is known of the front.
        let bins = free_of(&mesh).bins(0);
        assert_eq!(bins.is_back(), expected == 0.0, "{height}");
        assert!(!bins.is_back() || bins.0 & FreeBins::ALL == FreeBins::ALL, "{height}");
    }
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
fn results_do_not_depend_on_the_instruction_set() {
    for mesh in [terraces(12, 3), soup(200, 4), patch(5, 14), sphere(10, [7.0, 1e4, 0.0])] {
        let (binary, _) = bvh::build(&mesh, &BvhOptions::default(), &Silent).unwrap();
        let wide = Tree::new(&mesh, &binary).unwrap();
        let levels = [0.1, 0.5, 2.0];
        let kept = Kept::Directions;
        let mut around = Surroundings { mesh: &mesh, order: &binary.order, tree: wide, levels, kept };
        for kept in [Kept::Directions, Kept::Distances] {
            around.kept = kept;
            let of = |isa: Isa| isa.run(Decide { around: &around, rows: 0..binary.order.len() });
            let scalar = of(Isa::Scalar);
            assert!(scalar.iter().any(|found| *found != Found::default()));
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                assert_eq!(of(isa), scalar, "{isa}");
            }
        }
    }
}

#[test]
fn what_is_kept_is_decided_by_rays() {
    // So much of both sides that neither is free, but far from what is next to it, or not.
    for (scale, expected) in [(0.05, Kept::Distances), (0.5, Kept::None)] {
        let mut mesh = soup(4000, 9);
        for corners in mesh.triangles.clone() {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            let middle: [f32; 3] = std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0);
            for corner in corners {
                let p = &mut mesh.positions[corner as usize];
                *p = std::array::from_fn(|k| middle[k] + scale * (p[k] - middle[k]));
            }
        }
        let (free, report) = found(&mesh, KeepFree::Auto);
        assert_eq!(report.kept, expected, "{report:?}");
        assert_eq!(free.distances.is_empty(), expected == Kept::None);
        assert!(free.directions.is_empty());
        let (_, all) = found(&mesh, KeepFree::Distances);
        let worth = report.worth.unwrap();
        for seen in [worth.from_outside, worth.from_within] {
            assert!((seen.open - all.beyond[0]).abs() < 0.1, "{worth:?} {all:?}");
        }
        assert!(worth.free < 0.3, "{worth:?}");
    }
    // Where most is free, all of it is found.
    let mesh = sphere(24, [0.0; 3]);
    let (free, report) = found(&mesh, KeepFree::Auto);
    assert!(report.worth.unwrap().free > 0.9, "{report:?}");
    assert_eq!((free, FreeReport { worth: None, ..report }), found(&mesh, KeepFree::All));
}

/// Many small triangles in a ball, of radius 1 before it is scaled.
fn dense(count: usize, radius: f64) -> Mesh {
    let mut mesh = soup(count, 7);
    let length = |p: &[f32; 3]| p.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    let greatest = mesh.positions.iter().map(length).fold(0.0, f64::max);
    mesh.positions.iter_mut().flatten().for_each(|x| *x *= (radius / greatest) as f32);
    mesh
}

#[test]
fn what_no_ray_sees_does_not_count() {
    // In a solid that is free from outside most triangles are small and crowded.
    for (radius, expected) in [(0.05, Kept::Directions), (0.9, Kept::None)] {
        let mut mesh = sphere(24, [0.0; 3]);
        let (first, inner) = (mesh.positions.len() as u32, dense(20_000, radius));
        mesh.triangles.extend(inner.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        mesh.positions.extend(&inner.positions);
        let (_, report) = found(&mesh, KeepFree::Auto);
        let worth = report.worth.unwrap();
        assert_eq!(report.kept, expected, "{report:?}");
        assert!(worth.from_outside.open > 0.9, "{worth:?}");
        assert_eq!(worth.from_within.open > 0.5, expected == Kept::Directions, "{worth:?}");
    }
}

#[test]
fn solids_are_seen_from_outside_and_rooms_from_within() {
    // Large triangles that touch others are closed to the other side. Four corners of a
    // tetrahedron, each face turned outwards.
    let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let outwards = [[a, c, b], [a, b, d], [a, d, c], [b, c, d]];
    assert_eq!(found(&weld(outwards), KeepFree::Auto).1.kept, Kept::Directions);
    let (_, report) = found(&weld(outwards.map(|[a, b, c]| [a, c, b])), KeepFree::Auto);
    let worth = report.worth.unwrap();
    assert_eq!(report.kept, Kept::None, "{report:?}");
    assert!(worth.from_outside.open > 0.9 && worth.from_within.open < 0.1, "{worth:?}");
    assert!(worth.from_within.rays > 0, "{worth:?}");
}

#[test]
fn what_no_ray_meets_is_not_worthwhile() {
    // A ray that lies in a plane hits no triangle of it, so no ray from within counts.
    let mut mesh = terraces(5, 1);
    mesh.positions.iter_mut().for_each(|p| p[2] = 0.1);
    let (_, report) = found(&mesh, KeepFree::Auto);
    let worth = report.worth.unwrap();
    assert_eq!((report.kept, worth.from_within.rays), (Kept::Directions, 0), "{report:?}");
    assert!(worth.from_outside.rays > 100, "{report:?}");
    // No ray can hit anything.
    let a = [0.5; 3];
    let (_, report) = found(&weld([[a, a, a]]), KeepFree::Auto);
    assert_eq!((report.kept, report.worth.unwrap_or_default()), (Kept::None, Worth::default()), "{report:?}");
}

#[test]
fn huge_and_tiny_meshes_have_no_free_directions() {
    for scale in [1e-30f32, 1e30] {
        let mut mesh = soup(20, 5);
        mesh.positions.iter_mut().flatten().for_each(|x| *x *= scale);
        let free = free_of(&mesh);
        assert_eq!(free.levels, [0.0; 3]);
        assert!((0..mesh.triangles.len()).all(|triangle| free.known(triangle).is_nothing()));
    }
    let free = free_of(&Mesh::default());
    assert_eq!((free.levels, free.directions.len()), ([0.0; 3], 0));
}
