use super::super::bounds::Bounds;
use super::super::samples::{clutter, exponential, grid, model, soup};
use super::super::validate::validate_wide;
use super::super::wide_tree::check_lines;
use super::super::{BvhOptions, Quality, build};
use super::*;
use bth_format::layout::WideNode;
use bth_format::layout::{Child, INDEXED_LINES, NODE_LINES, RAW_LINES};
use bth_import::monitor::Silent;
use bth_random::Rng;
use proptest::prelude::*;
use zerocopy::{FromBytes, IntoBytes};

fn built(mesh: &Mesh, quality: Quality) -> BinaryBvh {
    build(mesh, &BvhOptions { quality, ..BvhOptions::default() }, &Silent).expect("builds").0
}

fn collapsed(mesh: &Mesh, bvh: &BinaryBvh, cut: &[u32]) -> (Wide, CollapseReport) {
    let (wide, report) = collapse(mesh, bvh, cut, &CollapseOptions::default(), &Silent).expect("collapses");
    validate_wide(mesh, bvh, cut, &wide);
    assert_eq!(report.tet_leaves as usize, cut.len());
    (wide, report)
}

/// Disjoint nodes, each taken with probability 1 in `odds`, walking down from the root.
fn random_cut(bvh: &BinaryBvh, odds: usize, random: &mut Rng) -> Vec<u32> {
    let mut cut = Vec::new();
    let mut at = 0;
    while at < bvh.nodes.len() {
        let taken = random.below(odds as u64) == 0;
        if taken {
            cut.push(at as u32);
        }
        at += if taken { 2 * bvh.nodes[at].count as usize - 1 } else { 1 };
    }
    cut
}

#[test]
fn an_empty_tree_has_no_root() {
    let (wide, report) = collapsed(&Mesh::default(), &BinaryBvh::default(), &[]);
    assert_eq!((wide.root, wide.depth, report.bytes), (NONE, 0, 0));
}

#[test]
fn a_single_triangle_is_a_leaf_as_root() {
    let mesh = soup(1, 1);
    let (wide, _) = collapsed(&mesh, &built(&mesh, Quality::Fast), &[]);
    assert_eq!((wide.root, wide.depth), (Child::Indexed(0).code(), 0));
    assert_eq!(wide.lines.len(), INDEXED_LINES);
}

#[test]
fn a_cut_root_is_the_whole_tree() {
    let mesh = grid(10, 1.0, 2);
    let bvh = built(&mesh, Quality::Fast);
    let (wide, _) = collapsed(&mesh, &bvh, &[0]);
    assert_eq!((wide.root, wide.depth, wide.lines.len()), (Child::Tets(0).code(), 0, 0));
}

#[test]
fn a_cut_leaf_is_atomic_too() {
    let mesh = soup(40, 3);
    let bvh = built(&mesh, Quality::Fast);
    let cut: Vec<u32> = (0..bvh.nodes.len() as u32).filter(|&i| bvh.nodes[i as usize].is_leaf()).collect();
    let (wide, report) = collapsed(&mesh, &bvh, &cut);
    assert_eq!((report.tet_leaves, wide.triangle_ids.len()), (40, 0));
}

#[test]
fn cut_nodes_out_of_order_out_of_range_or_nested_are_refused() {
    let mesh = soup(40, 3);
    let bvh = built(&mesh, Quality::Fast);
    for cut in [vec![0, 1], vec![5, 3], vec![4, 4], vec![bvh.nodes.len() as u32]] {
        let result = collapse(&mesh, &bvh, &cut, &CollapseOptions::default(), &Silent);
        assert!(matches!(result, Err(Error::Internal { .. })), "{cut:?}");
    }
}

/// Where the vertices of leaves are recorded, nodes and then leaves lie in depth-first order, and
/// no node is cut.
#[test]
fn nodes_and_leaves_lie_depth_first_where_vertices_are_recorded() {
    let mesh = grid(60, 1.0, 2);
    let bvh = built(&mesh, Quality::Fast);
    let options = CollapseOptions { leaf_vertices: true, ..CollapseOptions::default() };
    let (wide, _) = collapse(&mesh, &bvh, &[], &options, &Silent).expect("collapses");
    validate_wide(&mesh, &bvh, &[], &wide);
    let (mut nodes, mut leaves, mut stack) = (Vec::new(), Vec::new(), vec![wide.root]);
    while let Some(code) = stack.pop() {
        match Child::from_code(code) {
            Some(Child::Node(line)) => {
                nodes.push((line, NODE_LINES));
                let bytes = wide.lines[line as usize..][..NODE_LINES].as_bytes();
                let node = WideNode::read_from_bytes(bytes).expect("a node");
                stack.extend(node.child.iter().rev().filter(|code| **code != NONE));
            }
            Some(Child::Indexed(line)) => leaves.push((line, INDEXED_LINES)),
            Some(Child::Raw(line)) => leaves.push((line, RAW_LINES)),
            other => panic!("{other:?}"),
        }
    }
    assert!(nodes.len() > 10 && leaves.len() > 100);
    let mut next = 0;
    for (line, lines) in nodes.into_iter().chain(leaves) {
        assert_eq!(line as usize, next);
        next += lines;
    }
    assert_eq!(next, wide.lines.len());
    assert!(matches!(collapse(&mesh, &bvh, &[1], &options, &Silent), Err(Error::Internal { .. })));
}

#[test]
fn too_many_lines_or_levels_are_refused() {
    assert!(check_lines(Child::INDEX_LIMIT as usize).is_ok());
    assert!(matches!(check_lines(Child::INDEX_LIMIT as usize + 1), Err(Error::Limit { .. })));
    assert!(check_depth(96).is_ok());
    assert!(matches!(check_depth(97), Err(Error::Limit { .. })));
}

#[test]
fn chains_collapse_within_the_depth_limit() {
    let mesh = exponential(3000);
    let (wide, _) = collapsed(&mesh, &built(&mesh, Quality::Best), &[]);
    assert!(wide.depth as usize <= bth_format::limits::MAX_DEPTH);
}

#[test]
fn the_lines_are_the_same_at_any_number_of_threads() {
    let mesh = grid(120, 10.0, 4);
    let bvh = built(&mesh, Quality::Fast);
    let cut = random_cut(&bvh, 200, &mut Rng::new(9));
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| collapsed(&mesh, &bvh, &cut).0)
    };
    let one = at(1);
    assert!(one == at(2) && one == at(5));
}

#[test]
fn random_cuts_leave_valid_trees() {
    for (mesh, seed) in
        [(grid(40, 9.0, 6), 1), (soup(2000, 7), 2), (clutter(1500, &[0.0, 1.0, 2.0, 5.0], 8), 3)]
    {
        let bvh = built(&mesh, Quality::Fast);
        let cut = random_cut(&bvh, 150, &mut Rng::new(seed));
        collapsed(&mesh, &bvh, &cut);
    }
}

/// Oracle: smallest cost of a subtree in at most `slots` slots, by the recursive definition.
fn cost_by_definition(mesh: &Mesh, bvh: &BinaryBvh, planner: &Planner, at: u32, slots: usize) -> f64 {
    let node = &bvh.nodes[at as usize];
    let Costs { node: node_cost, indexed, raw, .. } = planner.costs;
    let area = Bounds::of_node(node).half_area() / Bounds::of_node(&bvh.nodes[0]).half_area();
    let line = f64::from(planner.line);
    let leaf = |c: [f32; 2], lines: usize| {
        area * (f64::from(c[0]) + f64::from(c[1]) * f64::from(node.count)) + line * lines as f64
    };
    let ids = &bvh.order[node.first as usize..][..node.count as usize];
    let vertices: std::collections::BTreeSet<u32> =
        ids.iter().flat_map(|&id| mesh.triangles[id as usize]).collect();
    let mut best = f64::INFINITY;
    if ids.len() <= 16 && vertices.len() <= 16 {
        best = best.min(leaf(indexed, INDEXED_LINES));
    }
    if ids.len() <= 16 && ids.len() > 1 {
        best = best.min(leaf(raw, RAW_LINES));
    }
    if !node.is_leaf() {
        let part = |at, slots| cost_by_definition(mesh, bvh, planner, at, slots);
        let spread = |slots: usize| {
            let split = |j| part(at + 1, j) + part(node.right, slots - j);
            (1..slots).map(split).fold(f64::INFINITY, f64::min)
        };
        best = best.min(area * f64::from(node_cost) + line * NODE_LINES as f64 + spread(16));
        best = (2..=slots).map(spread).fold(best, f64::min);
    }
    best
}

#[test]
fn the_plan_has_the_least_cost_by_definition() {
    let tables = [
        Costs::default(),
        Costs { node: 0.2, indexed: [1.0, 0.0], raw: [1.2, 0.0], line: 0.0 },
        Costs { node: 1.0, indexed: [0.5, 0.5], raw: [0.1, 1.0], line: 0.01 },
    ];
    for costs in tables {
        for mesh in [soup(4, 1), soup(5, 2), grid(1, 0.5, 3), clutter(6, &[0.0, 1.0, 0.25], 4)] {
            let bvh = built(&mesh, Quality::Best);
            let options = CollapseOptions { costs, ..CollapseOptions::default() };
            let (_, report) = collapse(&mesh, &bvh, &[], &options, &Silent).expect("collapses");
            let planner = Planner::new(&mesh, (&bvh).into(), costs, &Silent);
            let least = cost_by_definition(&mesh, &bvh, &planner, 0, 1);
            assert!((report.cost - least).abs() <= 1e-5 * least, "{} {least}", report.cost);
        }
    }
}

#[test]
fn the_written_tree_costs_what_the_plan_says() {
    // With one price for all leaves the cost follows from the visits and the number of lines.
    let costs = Costs { node: 1.3, indexed: [0.9, 0.0], raw: [0.9, 0.0], line: 0.03 };
    for mesh in [soup(3000, 1), grid(60, 4.0, 2), clutter(3000, &[0.0, 1.0, 2.0, 4.0, 8.0, 9.0], 3)] {
        let bvh = built(&mesh, Quality::Balanced);
        let options = CollapseOptions { costs, ..CollapseOptions::default() };
        let (wide, report) = collapse(&mesh, &bvh, &[], &options, &Silent).expect("collapses");
        let line = f64::from(Planner::new(&mesh, (&bvh).into(), costs, &Silent).line);
        let cost = 1.3 * report.node_visits + 0.9 * report.leaf_visits + line * wide.lines.len() as f64;
        assert!((report.cost - cost).abs() <= 1e-3 * cost, "{} {cost}", report.cost);
    }
}

#[test]
#[allow(clippy::print_stdout, reason = "says what was measured and what was skipped")]
fn leaves_are_small_on_disk() {
    let mut cases = vec![
        ("soup".to_string(), Some(soup(50_000, 5)), 110.0),
        ("grid".to_string(), Some(grid(200, 5.0, 6)), 45.0),
    ];
    let models = [
        ("stanford-bunny.ply", 45.0),
        ("armadillo86k.ply", 45.0),
        ("nefertiti.ply", 45.0),
        ("fandisk.ply", 45.0),
        ("sanmiguel_leaves.ply", 110.0),
        ("sponza_dabrovic.ply", 60.0),
    ];
    cases.extend(models.iter().map(|&(name, limit)| (name.to_string(), model(name), limit)));
    for (name, mesh, limit) in cases {
        let Some(mesh) = mesh else {
            println!("skipped {name}: the shared test data is absent");
            continue;
        };
        let bvh = built(&mesh, Quality::Balanced);
        let (_, report) = collapsed(&mesh, &bvh, &[]);
        println!(
            "{name}: {:.1} bytes a triangle, {} nodes of {:.1} children, {} indexed leaves of {:.1}, {} raw of {:.1}, visits {:.2} + {:.2}",
            report.bytes_per_triangle,
            report.nodes,
            report.children as f64 / report.nodes as f64,
            report.indexed_leaves,
            report.indexed_triangles as f64 / report.indexed_leaves as f64,
            report.raw_leaves,
            report.raw_triangles as f64 / report.raw_leaves as f64,
            report.node_visits,
            report.leaf_visits,
        );
        assert!(report.bytes_per_triangle <= limit, "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn random_meshes_and_cuts_collapse_to_valid_trees(
        count in 1usize..400, seed: u64, kind in 0..3, odds in 1usize..60,
    ) {
        let mut random = Rng::new(seed);
        let mesh = match kind {
            0 => soup(count, seed),
            1 => clutter(count, &[0.0, 1.0, 2.0, 0.5], seed),
            _ => grid(1 + random.below(14) as usize, random.unit_f32(), seed),
        };
        let bvh = built(&mesh, Quality::Balanced);
        let cut = random_cut(&bvh, odds, &mut random);
        collapsed(&mesh, &bvh, &cut);
        collapsed(&mesh, &bvh, &[]);
    }
}
