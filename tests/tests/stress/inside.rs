//! Crossings and winding numbers on hard surfaces, checked exactly; `bth-bench stress` asks for
//! many more points, of scans.

use bth::rays::Ray;
use bth::{Crossings, Scene};
use bth_compile::pipeline::Structure;
use bth_random::Rng;
use bth_scenes::Model;
use bth_tests::stress::{Corners, InsideStatistics, is_closed, run_inside, shapes};
use bth_tests::structures::{compiled, every_structure, options};
use bth_tests::{by_day, oracle};

fn bvh(model: &Model) -> Scene {
    compiled(model, &options(Structure::Bvh))
}

fn corners_of(scene: &Scene) -> Vec<Corners> {
    oracle::triangles(&scene.object(0)).iter().map(|triangle| triangle.corners).collect()
}

#[test]
fn winding_numbers_are_exact_on_every_closed_surface_and_in_every_structure() {
    for (i, shape) in shapes(1).iter().enumerate() {
        for traced in every_structure(&shape.grid.model(), false) {
            let corners = corners_of(&traced.scene);
            assert!(is_closed(&corners), "{}", shape.name);
            let mut found = InsideStatistics::default();
            run_inside(&traced.scene, &corners, by_day(768, 3072), 16, i as u64, &mut found);
            assert_eq!(found.defects(), 0, "{}, {}: {found:#?}", shape.name, traced.name);
            assert!(found.compared >= 48 && found.aimed > found.points / 8, "{}: {found:?}", shape.name);
        }
    }
}

/// A mesh with known winding numbers: unit cubes of a grid that are filled or not, as shells of
/// squares between filled and empty cubes; and the same with a shell for every cube.
fn cubes(filled: &dyn Fn([i32; 3]) -> bool, size: i32, merged: bool) -> Model {
    let mut model = Model::default();
    for cell in (0..size * size * size).map(|i| [i % size, i / size % size, i / size / size]) {
        if !filled(cell) {
            continue;
        }
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beyond = cell;
            beyond[axis] += 2 * side - 1;
            if merged && filled(beyond) {
                continue;
            }
            let first = model.positions.len() as u32;
            for (di, dj) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut p = cell;
                p[axis] += side;
                p[(axis + 1) % 3] += di;
                p[(axis + 2) % 3] += dj;
                model.positions.push(p.map(|x| x as f32));
            }
            let order = if side == 1 { [[0, 1, 2], [0, 2, 3]] } else { [[0, 2, 1], [0, 3, 2]] };
            model.triangles.extend(order.map(|t: [u32; 3]| t.map(|v| first + v)));
        }
    }
    model
}

/// A point is in the cube that it enters when it is moved a little along x, less along y and even
/// less along z: for a point of the grid the cube whose smallest corner it is.
#[test]
fn points_of_a_grid_of_cubes_are_in_the_cube_above_them() {
    const SIZE: i32 = 5;
    let mut rng = Rng::new(31);
    for merged in [true, false] {
        let pattern: Vec<bool> = (0..SIZE * SIZE * SIZE).map(|_| rng.below(3) > 0).collect();
        let filled = |c: [i32; 3]| {
            c.iter().all(|x| (0..SIZE).contains(x)) && pattern[(c[0] + SIZE * (c[1] + SIZE * c[2])) as usize]
        };
        let scene = bvh(&cubes(&filled, SIZE, merged));
        let halves = || (-2..=2 * SIZE + 2).map(|half| half as f32 / 2.0);
        let mut asked = 0;
        for point in halves().flat_map(|x| halves().flat_map(move |y| halves().map(move |z| [x, y, z]))) {
            let cell = point.map(|x| x.floor() as i32);
            let expected = i32::from(filled(cell));
            assert_eq!(scene.winding(point), expected, "{point:?}");
            assert_eq!(scene.contains(point), filled(cell), "{point:?}");
            let direction = [(); 3].map(|()| rng.below(5) as f32 - 2.0);
            if direction != [0.0; 3] {
                assert_eq!(
                    scene.crossings(&Ray::new(point, direction)).winding,
                    expected,
                    "{point:?}, {direction:?}"
                );
            }
            asked += expected;
        }
        assert!(asked > 300);
    }
}

#[test]
fn ranges_that_share_an_end_hold_each_crossing_once() {
    let scene = bvh(&cubes(&|c| c.iter().all(|x| (0..3).contains(x)), 3, false));
    let corners = corners_of(&scene);
    let mut rng = Rng::new(37);
    let mut crossed = 0;
    for _ in 0..4000 {
        let origin = [(); 3].map(|()| rng.below(13) as f32 / 2.0 - 1.5);
        let direction = [(); 3].map(|()| rng.below(7) as f32 - 3.0);
        let ray = Ray::new(origin, direction);
        let found = |from: f32, to: f32| {
            let ray = ray.with_range(from, to);
            let found = scene.crossings(&ray);
            assert_eq!(found, oracle::crossings(&corners, ray), "{ray:?}");
            found
        };
        let ends = [f32::NEG_INFINITY, -1.0, 0.0, 0.5, 1.0, f32::INFINITY];
        let mut sum = Crossings::default();
        for pair in ends.windows(2) {
            let part = found(pair[0], pair[1]);
            (sum.count, sum.winding) = (sum.count + part.count, sum.winding + part.winding);
        }
        assert_eq!(sum, found(ends[0], ends[5]), "{ray:?}");
        assert_eq!(sum.winding, 0, "{ray:?}");
        crossed += sum.count;
    }
    assert!(crossed > 5000, "{crossed}");
}

#[test]
fn points_and_rays_that_are_not_finite_are_outside_of_everything() {
    let scene = bvh(&cubes(&|c| c == [0; 3], 1, true));
    assert!(scene.contains([0.5; 3]));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e-45] {
        for k in 0..3 {
            let mut point = [0.5; 3];
            point[k] = bad;
            assert_eq!(scene.winding(point), 0, "{point:?}");
            let none = Ray::new(point, [1.0, 0.5, 0.25]).with_range(0.0, f32::NAN);
            assert_eq!(scene.crossings(&none), Crossings::default());
            if !bad.is_finite() {
                assert_eq!(scene.crossings(&Ray::new(point, [1.0, 0.0, 0.0])), Crossings::default());
                assert_eq!(scene.crossings(&Ray::new([0.5; 3], point)), Crossings::default());
            }
        }
    }
    assert_eq!(scene.crossings(&Ray::new([0.5; 3], [0.0; 3])), Crossings::default());
}

/// Coordinates from the smallest to the largest f32, where differences overflow, and products in
/// f32 would, too.
#[test]
fn the_ends_of_the_range_of_f32_are_exact() {
    for unit in [f32::from_bits(1), f32::MIN_POSITIVE, f32::MAX / 4.0, f32::MAX] {
        let model = Model {
            positions: [
                [-1.0, -1.0, -1.0],
                [1.0, -1.0, -1.0],
                [-1.0, 1.0, -1.0],
                [-1.0, -1.0, 1.0],
                [1.0, 1.0, 1.0],
            ]
            .map(|p| p.map(|x| x * unit))
            .to_vec(),
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [4, 1, 2], [4, 3, 1], [4, 2, 3]],
        };
        let scene = bvh(&model);
        let corners = corners_of(&scene);
        assert!(is_closed(&corners) && corners.len() == 6);
        assert_eq!(scene.winding([0.0; 3]), 1);
        let mut found = InsideStatistics::default();
        run_inside(&scene, &corners, 3072, 8, 5, &mut found);
        assert_eq!(found.defects(), 0, "{unit}: {found:#?}");
    }
}

/// Closed models next to the checkout, in `BTH_DATA` or `../shared/data`.
#[test]
#[allow(clippy::print_stdout, reason = "it prints what it skips")]
fn winding_numbers_in_closed_scans_are_exact() {
    let folder = std::env::var_os("BTH_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        std::path::PathBuf::from,
    );
    for name in ["static/fandisk.ply", "static/neptun_torus_knot.ply", "messy/thingi/112544.off"] {
        let path = folder.join(name);
        if !path.is_file() {
            println!("SKIPPED: no {} (set BTH_DATA to the folder of the test models)", path.display());
            continue;
        }
        let options = options(Structure::Bvh);
        let (file, _) = bth_compile::pipeline::compile(&path, &options, &bth_compile::Silent).unwrap();
        let scene = bth::from_bytes(&file.bytes).unwrap();
        let corners = corners_of(&scene);
        assert!(is_closed(&corners), "{name}");
        assert_eq!(scene.is_closed(0), Some(true), "{name}");
        let mut found = InsideStatistics::default();
        run_inside(&scene, &corners, 20 * 1024, 256, 3, &mut found);
        assert_eq!(found.defects(), 0, "{name}: {found:#?}");
        assert!(found.inside > found.points / 50 && found.aimed > found.points / 20, "{name}: {found:?}");
    }
}
