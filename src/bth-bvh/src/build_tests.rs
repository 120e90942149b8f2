use super::super::samples::{clutter, exponential, grid, soup};
use super::super::validate::validate_binary;
use super::*;
use bth_import::monitor::Silent;
use bth_random::Rng;
use proptest::prelude::*;

const ALL: [Quality; 3] = [Quality::Fast, Quality::Balanced, Quality::Best];

fn built(mesh: &Mesh, quality: Quality) -> (BinaryBvh, BvhReport) {
    build(mesh, &BvhOptions { quality, ..BvhOptions::default() }, &Silent).expect("builds")
}

fn check(mesh: &Mesh) {
    for quality in ALL {
        let (bvh, report) = built(mesh, quality);
        let levels = validate_binary(mesh, &bvh);
        assert_eq!(report.levels, levels);
        assert!(levels <= MAX_LEVELS);
        assert_eq!(report.triangles + report.dropped, mesh.triangles.len() as u64);
        assert_eq!(report.nodes as usize, bvh.nodes.len());
        for pair in report.visits.windows(2) {
            assert!(pair[1] <= pair[0] * (1.0 + 1e-9), "reinsertion never makes the tree dearer: {pair:?}");
        }
        if let Some(&last) = report.visits.last() {
            let recomputed = visits(&bvh);
            assert!((last - recomputed).abs() <= 1e-9 * recomputed, "{last} {recomputed}");
        }
    }
}

#[test]
fn no_triangle_gives_no_node() {
    let (bvh, report) = built(&Mesh::default(), Quality::Balanced);
    assert_eq!(bvh, BinaryBvh::default());
    assert_eq!(report.triangles, 0);
}

#[test]
fn triangles_without_area_are_left_out_and_counted() {
    let positions = vec![[0.0; 3], [1.0; 3], [2.0; 3], [0.0, 1.0, 0.0]];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3], [1, 1, 3]], ..Mesh::default() };
    let (bvh, report) = built(&mesh, Quality::Balanced);
    assert_eq!(bvh.order, [1]);
    assert_eq!((report.triangles, report.dropped), (1, 2));
}

#[test]
fn grids_and_soups_build_valid_trees() {
    check(&grid(40, 3.0, 1));
    check(&grid(40, 0.0, 1));
    check(&soup(5000, 2));
}

#[test]
fn big_nodes_split_the_same_in_parallel() {
    // More than the size from which bins are filled in chunks.
    check(&grid(150, 10.0, 3));
}

#[test]
fn coincident_triangles_are_halved_by_id() {
    let mut mesh = soup(1, 5);
    mesh.triangles = vec![mesh.triangles[0]; 1000];
    for quality in ALL {
        let (bvh, report) = built(&mesh, quality);
        validate_binary(&mesh, &bvh);
        assert!(report.levels <= 16, "{quality:?}: {} levels", report.levels);
    }
}

#[test]
fn chains_are_cut_off_at_the_depth_limit() {
    check(&exponential(3000));
}

#[test]
fn extreme_coordinates_build_valid_trees() {
    let values = [-f32::MAX, f32::MAX, 0.0, 1.0, f32::from_bits(1), -1e30, 1e-30];
    check(&clutter(2000, &values, 7));
    check(&clutter(500, &[0.0, f32::from_bits(1), f32::from_bits(2)], 8));
}

#[test]
fn the_tree_is_the_same_at_any_number_of_threads() {
    for mesh in [grid(150, 10.0, 11), soup(20_000, 12)] {
        for quality in ALL {
            let at = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
                pool.install(|| built(&mesh, quality).0)
            };
            let one = at(1);
            assert!(one == at(2) && one == at(5), "{quality:?}");
        }
    }
}

#[test]
fn better_quality_costs_fewer_visits() {
    for mesh in [soup(20_000, 21), grid(100, 30.0, 22)] {
        let cost = ALL.map(|quality| *built(&mesh, quality).1.visits.last().expect("visits"));
        assert!(cost[1] < cost[0] && cost[2] < cost[1], "{cost:?}");
    }
}

#[test]
fn bad_indices_and_positions_are_reported() {
    let mesh = Mesh { positions: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 3]], ..Mesh::default() };
    assert!(matches!(build(&mesh, &BvhOptions::default(), &Silent), Err(Error::Internal { .. })));
    let mesh = Mesh { positions: vec![[f32::NAN; 3]; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() };
    assert!(matches!(build(&mesh, &BvhOptions::default(), &Silent), Err(Error::Internal { .. })));
}

/// A monitor that cancels after a number of checks.
struct Stop(std::sync::atomic::AtomicI32);

impl Monitor for Stop {
    fn cancelled(&self) -> bool {
        self.0.fetch_sub(1, std::sync::atomic::Ordering::Relaxed) <= 0
    }
}

#[test]
fn a_build_can_be_cancelled_anywhere() {
    let mesh = soup(20_000, 31);
    for looks in [0, 1, 5, 20] {
        let result = build(
            &mesh,
            &BvhOptions { quality: Quality::Best, ..BvhOptions::default() },
            &Stop(looks.into()),
        );
        assert!(matches!(result, Err(Error::Cancelled)), "after {looks}");
    }
}

/// Oracle: the smallest sum of areas over all splits of a few triangles, tried one by one.
fn best_split_by_trial(references: &[Reference<Bounds>]) -> f64 {
    let mut best = f64::INFINITY;
    for axis in 0..3 {
        let mut sorted = references.to_vec();
        sorted.sort_by(|a, b| a.bounds.half_center()[axis].total_cmp(&b.bounds.half_center()[axis]));
        for left in 1..sorted.len() {
            best = best.min(split_cost(&sorted, left));
        }
    }
    best
}

fn split_cost(references: &[Reference<Bounds>], left: usize) -> f64 {
    let cost = |part: &[Reference<Bounds>]| {
        let bounds = part.iter().fold(Bounds::EMPTY, |b, r| b.union(&r.bounds));
        bounds.half_area() * part.len() as f64
    };
    cost(&references[..left]) + cost(&references[left..])
}

fn references_of(mesh: &Mesh) -> Vec<Reference<Bounds>> {
    (0..mesh.triangles.len() as u32)
        .map(|id| Reference { bounds: Bounds::of_points(&mesh.corners(id)), id })
        .collect()
}

#[test]
fn a_sweep_finds_the_best_split_and_bins_come_near() {
    for seed in 0..20 {
        let mesh = soup(100, seed);
        let mut references = references_of(&mesh);
        let best = best_split_by_trial(&references);
        let left = sweep_split::split(&mut references, &mut sweep_split::Scratch::default());
        assert!((split_cost(&references, left) - best).abs() <= 1e-12 * best);
        let centers = measure(&references).centers;
        let left = binned_split::split(&mut references, &centers, 32).expect("separable").left;
        let cost = split_cost(&references, left);
        assert!(cost >= best * (1.0 - 1e-12) && cost <= best * 1.1, "{cost} {best}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn random_meshes_build_valid_trees(count in 1usize..300, seed: u64, kind in 0..3) {
        let mut random = Rng::new(seed);
        let mesh = match kind {
            0 => soup(count, seed),
            1 => clutter(count, &[0.0, 1.0, 2.0, 0.5], seed),
            _ => grid(1 + random.below(12) as usize, random.unit_f32(), seed),
        };
        check(&mesh);
    }
}
