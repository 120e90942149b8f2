use super::super::build::{Quality, build_with};
use super::super::collapse::{CollapseOptions, collapse};
use super::super::poses::Weighed;
use super::super::samples::{clutter, grid, soup};
use super::super::validate::{validate_binary, validate_wide};
use super::super::{Costs, MAX_LEVELS, Wide};
use super::*;
use bth_format::layout::{Child, NONE, WideNode};
use bth_import::monitor::Silent;
use bth_random::Rng;
use proptest::prelude::*;
use zerocopy::{FromBytes, IntoBytes};

fn options(quality: Quality, keep_zero_area: bool) -> PoseOptions {
    PoseOptions { effort: quality.effort(), keep_zero_area }
}

/// Poses in which the mesh is twisted about the z axis, by up to a full turn from end to end.
fn twisted(mesh: &Mesh, count: usize) -> Vec<Vec<[f32; 3]>> {
    let end = mesh.positions.iter().map(|p| p[2].abs()).fold(1e-30, f32::max);
    let pose = |pose: usize| {
        let turn = |p: &[f32; 3]| {
            let angle = std::f32::consts::TAU * pose as f32 / count as f32 * p[2] / end;
            let (sin, cos) = angle.sin_cos();
            [cos * p[0] - sin * p[1], sin * p[0] + cos * p[1], p[2]]
        };
        mesh.positions.iter().map(turn).collect()
    };
    (0..count).map(pose).collect()
}

/// Half the area of the box of some triangles in a pose, from its definition.
fn slow_area(mesh: &Mesh, positions: &[[f32; 3]], ids: &[u32]) -> f64 {
    let points: Vec<[f32; 3]> =
        ids.iter().flat_map(|id| mesh.triangles[*id as usize].map(|row| positions[row as usize])).collect();
    let extent = |k: usize| {
        let along = points.iter().map(|p| f64::from(p[k]));
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    };
    extent(0) * extent(1) + extent(1) * extent(2) + extent(2) * extent(0)
}

/// The mean over poses of the sum of all nodes' areas over the root's, from its definition.
fn slow_visits(mesh: &Mesh, bvh: &BinaryBvh, poses: &[Vec<[f32; 3]>]) -> f64 {
    let area = |positions: &[[f32; 3]], at: usize| {
        let node = &bvh.nodes[at];
        slow_area(mesh, positions, &bvh.order[node.first as usize..][..node.count as usize])
    };
    let counted: Vec<_> = poses.iter().filter(|positions| area(positions, 0) > 0.0).collect();
    let one = |positions: &&Vec<[f32; 3]>| {
        (0..bvh.nodes.len()).map(|at| area(positions, at)).sum::<f64>() / area(positions, 0)
    };
    counted.iter().map(one).sum::<f64>() / counted.len().max(1) as f64
}

fn near(a: f64, b: f64) -> bool {
    // The builder sums areas of boxes that were scaled in f32.
    (a - b).abs() <= 1e-4 * b.abs()
}

fn check(mesh: &Mesh, positions: &[Vec<[f32; 3]>], quality: Quality) -> BinaryBvh {
    let poses = Poses::new(mesh, positions).unwrap();
    let (bvh, report) = build_poses(mesh, &poses, &options(quality, false), &Silent).unwrap();
    assert_eq!(report.levels, validate_binary(mesh, &bvh));
    assert!(report.levels <= MAX_LEVELS);
    for pair in report.visits.windows(2) {
        assert!(pair[1] <= pair[0] * (1.0 + 1e-9), "reinsertion never makes the tree dearer: {pair:?}");
    }
    if bvh.nodes.is_empty() {
        return bvh;
    }
    let slow = slow_visits(mesh, &bvh, positions);
    let probabilities = poses.probabilities(mesh, &bvh);
    let sum: f64 = probabilities.iter().sum();
    assert!((sum - slow).abs() <= 1e-9 * slow, "probabilities are those of the boxes: {sum} {slow}");
    assert!((0.0..=1.0 + 1e-9).contains(&probabilities[0]));
    if let Some(&fast) = report.visits.last() {
        assert!(near(fast, slow), "{fast} {slow}");
    }
    bvh
}

#[test]
fn the_tree_of_several_poses_is_valid_and_its_cost_is_that_of_its_boxes() {
    for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
        for (mesh, count) in
            [(grid(12, 3.0, 1), 2), (soup(700, 2), 4), (soup(500, 3), 7), (grid(9, 1.0, 4), 16)]
        {
            check(&mesh, &twisted(&mesh, count), quality);
        }
    }
}

#[test]
fn one_pose_gives_the_tree_of_the_mesh() {
    for mesh in [grid(40, 3.0, 1), soup(3000, 2), clutter(500, &[0.0, 1.0, -2.5, 1e-30], 5)] {
        for quality in [Quality::Fast, Quality::Balanced, Quality::Best] {
            let positions = [mesh.positions.clone()];
            let poses = Poses::new(&mesh, &positions).unwrap();
            let several = build_poses(&mesh, &poses, &options(quality, false), &Silent).unwrap();
            assert_eq!(several, build_with(&mesh, &quality.effort(), false, &Silent).unwrap());
        }
    }
}

/// Two sheets that lie in each other in one pose and apart in others.
#[test]
fn parts_that_separate_in_some_pose_are_separate_in_the_tree() {
    let sheet = grid(16, 0.0, 1);
    let rows = sheet.positions.len() as u32;
    let mut mesh = sheet.clone();
    mesh.positions.extend(sheet.positions.iter().map(|p| [p[0] + 0.5, p[1] + 0.5, p[2]]));
    mesh.triangles.extend(sheet.triangles.iter().map(|t| t.map(|row| row + rows)));
    let apart = |z: f32| -> Vec<[f32; 3]> {
        let lift =
            |(row, p): (usize, &[f32; 3])| [p[0], p[1], if row as u32 >= rows { p[2] + z } else { p[2] }];
        mesh.positions.iter().enumerate().map(lift).collect()
    };
    let positions = [apart(0.0), apart(30.0), apart(60.0), apart(90.0)];
    let bvh = check(&mesh, &positions, Quality::Balanced);
    let (still, _) = build_with(&mesh, &Quality::Balanced.effort(), false, &Silent).unwrap();
    let (ours, theirs) = (slow_visits(&mesh, &bvh, &positions), slow_visits(&mesh, &still, &positions));
    assert!(ours < 0.7 * theirs, "a tree for all poses costs {ours}, that of the first {theirs}");
}

#[test]
fn triangles_without_area_are_kept_on_request() {
    let positions = vec![[0.0; 3], [1.0; 3], [2.0; 3], [0.0, 1.0, 0.0]];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3], [1, 1, 3]], ..Mesh::default() };
    let positions = [mesh.positions.clone()];
    let poses = Poses::new(&mesh, &positions).unwrap();
    let (bvh, report) = build_poses(&mesh, &poses, &options(Quality::Balanced, true), &Silent).unwrap();
    assert_eq!((report.triangles, report.dropped, bvh.nodes.len()), (3, 0, 5));
    let (bvh, report) = build_poses(&mesh, &poses, &options(Quality::Balanced, false), &Silent).unwrap();
    assert_eq!((report.triangles, report.dropped, bvh.order), (1, 2, vec![1]));
}

#[test]
fn poses_that_do_not_fit_are_refused() {
    let mesh = soup(3, 1);
    let good = mesh.positions.clone();
    let mut bad = good.clone();
    bad[1][2] = f32::NAN;
    for positions in
        [vec![], vec![good.clone(); MAX_POSES + 1], vec![good[1..].to_vec()], vec![good.clone(), bad]]
    {
        assert!(Poses::new(&mesh, &positions).is_err());
    }
}

#[test]
fn poses_without_area_and_with_extreme_extents_count_for_nothing_or_little() {
    let mesh = soup(200, 8);
    let flat = vec![[1.0; 3]; mesh.positions.len()];
    let thin: Vec<_> = mesh.positions.iter().map(|p| [p[0] * 3e38, p[1] * 1e-38, 0.0]).collect();
    let huge: Vec<_> = mesh.positions.iter().map(|p| p.map(|x| (x - 0.5) * 3e38)).collect();
    for positions in [vec![flat.clone(); 3], vec![flat, mesh.positions.clone(), thin, huge]] {
        let poses = Poses::new(&mesh, &positions).unwrap();
        let (bvh, report) = build_poses(&mesh, &poses, &options(Quality::Balanced, false), &Silent).unwrap();
        validate_binary(&mesh, &bvh);
        assert!(report.visits.iter().all(|visits| !visits.is_infinite()), "{report:?}");
    }
}

/// Cost of a wide tree in a pose, from the ids below each child.
fn slow_cost(mesh: &Mesh, wide: &Wide, costs: &Costs, positions: &[[f32; 3]]) -> f64 {
    fn below(
        (mesh, wide, costs, positions): (&Mesh, &Wide, &Costs, &[[f32; 3]]),
        code: u32,
    ) -> (Vec<u32>, f64) {
        let all = (mesh, wide, costs, positions);
        let bytes = |line: u32, lines: usize| wide.lines[line as usize..][..lines].as_bytes();
        let leaf = |ids: &[u32], [entry, each]: [f32; 2]| {
            let area = slow_area(mesh, positions, ids);
            (ids.to_vec(), area * f64::from(entry + each * ids.len() as f32))
        };
        let ids = |first: u32, count: u32| &wide.triangle_ids[first as usize..][..count as usize];
        match Child::from_code(code).unwrap() {
            Child::Node(line) => {
                let node = WideNode::read_from_bytes(bytes(line, bth_format::layout::NODE_LINES)).unwrap();
                let (mut found, mut cost) = (Vec::new(), 0.0);
                for code in node.child.into_iter().filter(|code| *code != NONE) {
                    let (more, of_child) = below(all, code);
                    found.extend(more);
                    cost += of_child;
                }
                let area = slow_area(mesh, positions, &found);
                (found, cost + area * f64::from(costs.node))
            }
            Child::Indexed(line) => {
                let lines = bth_format::layout::INDEXED_LINES;
                let found = bth_format::layout::IndexedLeaf::read_from_bytes(bytes(line, lines)).unwrap();
                leaf(ids(found.first, found.triangles), costs.indexed)
            }
            Child::Raw(line) => {
                let lines = bth_format::layout::RAW_LINES;
                let found = bth_format::layout::RawLeaf::read_from_bytes(bytes(line, lines)).unwrap();
                leaf(ids(found.first, found.triangles), costs.raw)
            }
            other => panic!("{other:?}"),
        }
    }
    let (ids, cost) = below((mesh, wide, costs, positions), wide.root);
    cost / slow_area(mesh, positions, &ids)
}

#[test]
fn the_wide_tree_is_chosen_by_the_mean_cost_over_the_poses() {
    let mesh = soup(900, 6);
    let positions = twisted(&mesh, 5);
    let poses = Poses::new(&mesh, &positions).unwrap();
    let (bvh, _) = build_poses(&mesh, &poses, &options(Quality::Balanced, false), &Silent).unwrap();
    let probabilities = poses.probabilities(&mesh, &bvh);
    let weighed = Weighed { bvh: &bvh, probabilities: Some(&probabilities) };
    // Without a price of lines the cost is the cost of visits alone.
    let costs = Costs { line: 0.0, ..Costs::default() };
    let options = CollapseOptions { costs, ..CollapseOptions::default() };
    let (wide, report) = collapse(&mesh, weighed, &[], &options, &Silent).unwrap();
    validate_wide(&mesh, &bvh, &[], &wide);
    let mean_cost = |wide: &Wide| {
        let costs = positions.iter().map(|positions| slow_cost(&mesh, wide, &costs, positions));
        costs.sum::<f64>() / positions.len() as f64
    };
    let mean = mean_cost(&wide);
    assert!(near(report.cost, mean), "{} {mean}", report.cost);
    let (plain, _) = collapse(&mesh, &bvh, &[], &options, &Silent).unwrap();
    let plain = mean_cost(&plain);
    assert!(mean <= plain * (1.0 + 1e-6), "{mean} {plain}");
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let mesh = soup(20_000, 9);
    let positions = twisted(&mesh, 4);
    let poses = Poses::new(&mesh, &positions).unwrap();
    let build = || build_poses(&mesh, &poses, &options(Quality::Fast, true), &Silent).unwrap().0;
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    assert!(pool(1).install(build) == pool(3).install(build));
}

proptest! {
    #[test]
    fn any_poses_give_a_valid_tree(seed: u64, count in 1usize..=9, faces in 1usize..60, wild: bool) {
        let mut random = Rng::new(seed);
        let values = [-2.0, 0.0, 1.0, 1.5, 1e-3, f32::MAX, -1e30];
        let usable = if wild { values.len() } else { 5 };
        let mesh = clutter(faces, &values[..usable], seed);
        let mut pose = || -> Vec<[f32; 3]> {
            let coordinate = |random: &mut Rng| values[random.below(usable as u64) as usize];
            mesh.positions.iter().map(|_| std::array::from_fn(|_| coordinate(&mut random))).collect()
        };
        let positions: Vec<_> = (0..count).map(|_| pose()).collect();
        let poses = Poses::new(&mesh, &positions).unwrap();
        let (bvh, report) = build_poses(&mesh, &poses, &options(Quality::Balanced, false), &Silent).unwrap();
        prop_assert_eq!(report.levels, validate_binary(&mesh, &bvh));
        if !bvh.nodes.is_empty() && !wild {
            let slow = slow_visits(&mesh, &bvh, &positions);
            let fast = *report.visits.last().unwrap();
            // A pose without area counts for nothing in either sum.
            let flat = positions.iter().any(|p| slow_area(&mesh, p, &bvh.order) == 0.0);
            prop_assert!(flat || near(fast, slow), "{} {}", fast, slow);
        }
    }
}

#[test]
fn large_meshes_of_many_poses_need_little_stack() {
    // More triangles than are binned in one piece, and threads with half of the usual stack.
    let mesh = grid(140, 0.2, 3);
    assert!(mesh.triangles.len() > 1 << 15);
    let positions = twisted(&mesh, MAX_POSES);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).stack_size(1 << 20).build().unwrap();
    let built = pool.install(|| {
        let poses = Poses::new(&mesh, &positions).unwrap();
        let effort = Effort { sweep_count: 64, reinsertion: Vec::new(), ..Quality::Fast.effort() };
        build_poses(&mesh, &poses, &PoseOptions { effort, keep_zero_area: true }, &Silent).unwrap()
    });
    assert_eq!(built.1.triangles, mesh.triangles.len() as u64);
}
