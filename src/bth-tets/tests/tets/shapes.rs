//! Made-up shapes through the whole stage.

use bth_import::Mesh;
use bth_import::Silent;
use bth_tets::{Outcome, TetMesh, TetOptions, WorkerStatus, build};

use crate::meshes::{bumps, bvh, cube, grid, nodes_of_at_most, torus, weld};
use crate::oracle::{assert_covers_once, assert_holds};
use crate::with_worker;

fn build_whole(mesh: &Mesh, options: &TetOptions) -> TetMesh {
    let bvh = bvh(mesh);
    let (built, report) = build(mesh, &bvh, &[0], options, &Silent).unwrap();
    assert_eq!(report.built, 1, "{report:?}");
    assert_eq!(report.built_triangles as usize, mesh.triangles.len());
    assert_eq!(report.tets as usize, built[0].1.tets.len());
    assert_holds(mesh, &bvh, 0, &built[0].1);
    built.into_iter().next().unwrap().1
}

#[test]
fn a_cube_a_torus_and_a_flat_sheet_hold() {
    let Some(options) = with_worker("shapes") else { return };
    for mesh in [cube(), torus(24, 12), grid(8, 8, |i, j| [i as f32, j as f32, 1.0])] {
        assert_covers_once(&build_whole(&mesh, &options), 200);
        build_whole(&mesh, &TetOptions { free_space: 0, ..options.clone() });
        build_whole(&mesh, &TetOptions { inflation: 0.0, ..options.clone() });
    }
}

#[test]
fn a_single_triangle_of_any_size_holds() {
    let Some(options) = with_worker("a single triangle") else { return };
    for scale in [1e-18f32, 1e-6, 1.0, 1e6, 1e18] {
        for offset in [0.0, 3.0, -100.0] {
            let p = |x: f32, y: f32, z: f32| [x + offset, y + offset, z].map(|c| c * scale);
            build_whole(&weld([[p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.5), p(0.0, 1.0, 0.25)]]), &options);
        }
    }
}

#[test]
fn random_clean_patches_hold() {
    let Some(options) = with_worker("random patches") else { return };
    let mut nudged = 0;
    for seed in 0..30 {
        let offset = [0.0, 10.0, 300.0, 3000.0, 30_000.0][seed as usize % 5];
        let n = 2 + seed as u32 % 9;
        let scale = if seed % 2 == 0 { 1.0 } else { 0.03 };
        let mesh = bumps(n, seed, [offset, -offset, offset * 0.5], scale);
        let tree = bvh(&mesh);
        let (built, report) = build(&mesh, &tree, &[0], &options, &Silent).unwrap();
        assert_eq!(report.built, 1, "seed {seed}: {report:?}");
        assert_holds(&mesh, &tree, 0, &built[0].1);
        nudged += report.nudged;
    }
    println!("random patches: {nudged} points nudged");
}

#[test]
fn the_result_does_not_depend_on_the_number_of_workers() {
    let Some(options) = with_worker("determinism") else { return };
    let mesh = torus(60, 30);
    let bvh = bvh(&mesh);
    let chosen = nodes_of_at_most(&bvh, 500);
    let run =
        |workers| build(&mesh, &bvh, &chosen, &TetOptions { workers, ..options.clone() }, &Silent).unwrap();
    let (one, report) = run(1);
    let (two, _) = run(2);
    assert!(one == two && one.len() == chosen.len());
    assert!(matches!(report.worker, WorkerStatus::Ready { .. }));
    assert!(one.iter().map(|(n, _)| *n).eq(chosen.iter().copied()));
    for (node, tets) in &one {
        assert_holds(&mesh, &bvh, *node, tets);
    }
}

#[test]
fn duplicate_triangles_fail_and_stay_in_the_bvh() {
    let Some(options) = with_worker("duplicates") else { return };
    let mut mesh = cube();
    mesh.triangles.push(mesh.triangles[3]);
    let (built, report) = build(&mesh, &bvh(&mesh), &[0], &options, &Silent).unwrap();
    assert!(built.is_empty());
    assert_eq!((report.given_up, report.given_up_triangles), (1, 13));
    assert_eq!(report.nodes[0].outcome, Outcome::GivenUp);
    assert!(!report.nodes[0].failures.is_empty());
}

#[test]
fn crossing_triangles_are_replaced_by_cells_without_them() {
    let Some(options) = with_worker("crossing triangles") else { return };
    let mut mesh = bumps(12, 1, [0.0; 3], 1.0);
    let p = |x: f32, y: f32, z: f32| [x, y, z];
    let n = mesh.positions.len() as u32;
    mesh.positions.extend([p(0.5, 0.5, -1.0), p(0.75, 0.5, 4.0), p(0.5, 0.75, 4.0)]);
    mesh.triangles.push([n, n + 1, n + 2]);
    let bvh = bvh(&mesh);
    let options = TetOptions { cells: vec![80], minimum: 20, ..options };
    let (built, report) = build(&mesh, &bvh, &[0], &options, &Silent).unwrap();
    assert_eq!(report.split, 1);
    assert_eq!(report.given_up, 1, "{:?}", report.nodes);
    assert_eq!(report.built_triangles + report.given_up_triangles, mesh.triangles.len() as u64);
    assert!(!built.is_empty() && report.failures.values().sum::<u64>() > 1);
    for (node, tets) in &built {
        assert_holds(&mesh, &bvh, *node, tets);
    }
}
