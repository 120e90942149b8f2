use super::super::samples::{clutter, exponential, grid, soup};
use super::super::validate::validate_wide;
use super::super::{BvhOptions, CollapseOptions, Quality, Weighed, build, build_part, collapse};
use super::*;

/// The wide tree of a mesh, built in parts of at most `most` triangles.
fn in_parts(mesh: &Mesh, most: usize, quality: Quality) -> (Wide, CollapseReport) {
    let Parts { ids, whole } = Parts::of(mesh, most, &Silent).expect("splits");
    assert!(ids.iter().all(|ids| !ids.is_empty() && ids.len() <= most && ids.is_sorted()));
    let build = |ids: Vec<u32>| {
        let (tree, _) = build_part(mesh, &ids, quality, &Silent).expect("builds");
        let options = CollapseOptions { whole, ..CollapseOptions::default() };
        let (wide, report) = collapse(mesh, &tree, &[], &options, &Silent).expect("collapses");
        Part { wide, root: tree.nodes[0], report }
    };
    join(ids.into_iter().map(build).collect()).expect("joins")
}

/// The wide tree of a mesh, built at once.
fn at_once(mesh: &Mesh, quality: Quality) -> (BinaryBvh, Wide, CollapseReport) {
    let (tree, _) = build(mesh, &BvhOptions { quality, ..BvhOptions::default() }, &Silent).expect("builds");
    let (wide, report) =
        collapse(mesh, Weighed::from(&tree), &[], &CollapseOptions::default(), &Silent).expect("collapses");
    (tree, wide, report)
}

#[test]
fn joined_trees_hold_each_triangle_once_in_exact_boxes() {
    for (mesh, sizes) in [
        (soup(1, 1), [1, 2, 3]),
        (soup(300, 2), [1, 7, 299]),
        (clutter(3000, &[0.0, 1.0, 2.5, 7.0, -3.0, 8.0], 3), [40, 500, 3000]),
        (exponential(200), [30, 99, 199]),
        (grid(40, 1.0, 5), [100, 1000, 1601]),
    ] {
        let (tree, whole, _) = at_once(&mesh, Quality::Fast);
        for most in sizes {
            let (wide, report) = in_parts(&mesh, most, Quality::Fast);
            validate_wide(&mesh, &tree, &[], &wide);
            assert_eq!(wide.widened_boxes, whole.widened_boxes);
            assert_eq!(report.indexed_triangles + report.raw_triangles, wide.triangle_ids.len() as u64);
        }
        assert_eq!(in_parts(&mesh, usize::MAX, Quality::Fast).0, whole);
    }
    assert_eq!(in_parts(&Mesh::default(), 10, Quality::Fast).0.root, NONE);
}

/// Where parts are large, as they are in use, rays take at most 5 % more steps.
#[test]
fn joined_trees_cost_little() {
    for mesh in [grid(180, 1.0, 7), grid(200, 40.0, 8), soup(60_000, 9)] {
        let (_, _, whole) = at_once(&mesh, Quality::Balanced);
        let (_, report) = in_parts(&mesh, mesh.triangles.len() / 2, Quality::Balanced);
        let steps = |report: &CollapseReport| report.node_visits + report.leaf_visits;
        let ratio = steps(&report) / steps(&whole);
        assert!(ratio < 1.05, "{} triangles: {ratio}", mesh.triangles.len());
    }
}
