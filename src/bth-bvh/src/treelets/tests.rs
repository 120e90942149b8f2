use super::super::bounds::Bounds;
use super::super::plan::{Role, children};
use super::super::samples::{clutter, exponential, grid, model, soup};
use super::super::validate::validate_binary;
use super::super::{Quality, build};
use super::agglomerate::agglomerate;
use super::wide::TreeletPlan;
use super::*;
use crate::sampling::{entered, from_surface, visits};
use bth_format::layout::WIDTH;
use bth_import::monitor::Silent;
use bth_random::Rng;
use proptest::prelude::*;

/// The share of each node's area of the root's.
fn by_areas(bvh: &BinaryBvh) -> Vec<f64> {
    let root = bvh.nodes[0].half_area();
    bvh.nodes.iter().map(|node| node.half_area() / root).collect()
}

/// The smallest cost of a wide tree over a BVH, by areas, with lines at the price that they have
/// over another BVH.
fn cost(mesh: &Mesh, bvh: &BinaryBvh, priced: &BinaryBvh) -> f32 {
    let planner = |bvh| Planner::new(mesh, Weighed::from(bvh), Costs::default(), &Silent);
    let mut planned = planner(bvh);
    planned.line = planner(priced).line;
    planned.run(&[]).unwrap().1
}

fn built(mesh: &Mesh, quality: Quality) -> (BinaryBvh, BvhReport) {
    build(mesh, &super::super::BvhOptions { quality, ..Default::default() }, &Silent).unwrap()
}

fn rebuilt(mesh: &Mesh, quality: Quality, rounds: usize) -> (BinaryBvh, BinaryBvh, BvhReport) {
    let (before, mut report) = built(mesh, quality);
    let after = rebuild_treelets(mesh, before.clone(), rounds, &by_areas, &mut report, &Silent).unwrap();
    (before, after, report)
}

#[test]
fn rebuilt_trees_are_valid_and_hold_the_same_triangles() {
    let values = [-1.0, 0.0, 0.25, 0.5, 2.0];
    let meshes =
        [soup(1, 1), soup(40, 2), soup(900, 3), grid(30, 0.4, 4), clutter(700, &values, 5), exponential(300)];
    for mesh in &meshes {
        for quality in [Quality::Fast, Quality::Balanced] {
            let (_, after, report) = rebuilt(mesh, quality, 4);
            assert_eq!(validate_binary(mesh, &after), report.levels);
            assert!(report.levels <= MAX_LEVELS);
        }
    }
}

#[test]
fn wide_trees_cost_less_and_never_more() {
    for mesh in [soup(3000, 1), grid(60, 3.0, 2), clutter(2000, &[0.0, 0.1, 0.5, 0.7, 1.0, 4.0], 3)] {
        let (before, after, report) = rebuilt(&mesh, Quality::Balanced, 4);
        let [was, is] = [&before, &after].map(|tree| cost(&mesh, tree, &before));
        assert!(report.treelets.len() == 4 && report.treelets.iter().any(|count| *count > 0), "{report:?}");
        assert!(is < was, "{was} {is}");
        let mut last = before;
        for rounds in 1..=4 {
            let (_, next, _) = rebuilt(&mesh, Quality::Balanced, rounds);
            let [was, is] = [&last, &next].map(|tree| cost(&mesh, tree, &last));
            // f32 rounds the sums of the plans.
            assert!(is <= was * (1.0 + 1e-5), "{rounds} rounds: {was} {is}");
            last = next;
        }
    }
}

/// Wide nodes and leaves that rays from surfaces enter, in the mean, if the tree is planned by
/// these probabilities or by areas. The rays are others than those that plans follow.
fn entered_by_others(mesh: &Mesh, bvh: &BinaryBvh, probabilities: Option<&[f64]>) -> f64 {
    let mut rays = from_surface(mesh, bvh, 0..bvh.order.len(), 60_000, 97);
    rays.retain(|ray| ray.tmax == f64::INFINITY);
    let counts = entered(mesh, bvh, &rays);
    let judge: Vec<f64> = counts.into_iter().map(|count| f64::from(count) / rays.len() as f64).collect();
    let planner = Planner::new(mesh, Weighed { bvh, probabilities }, Costs::default(), &Silent);
    let (decisions, _) = planner.run(&[]).unwrap();
    let (mut visits, mut stack) = (0.0, vec![0]);
    while let Some(at) = stack.pop() {
        visits += judge[at as usize];
        if decisions[at as usize].role() == Role::Node {
            stack.extend(children(bvh, &decisions, at));
        }
    }
    visits
}

#[test]
#[allow(clippy::print_stdout, reason = "says what was skipped")]
fn rays_in_rooms_enter_fewer_nodes_than_of_trees_by_areas() {
    for (name, most) in [("living-room.ply", 0.95), ("sponza_dabrovic.ply", 0.965)] {
        let Some(mesh) = model(name) else {
            println!("skipped: {name} is not there");
            continue;
        };
        let (before, mut report) = built(&mesh, Quality::Balanced);
        let by_areas = entered_by_others(&mesh, &before, None);
        let plan = visits(&mesh, &before, None);
        let by_visits = entered_by_others(&mesh, &before, Some(&plan));
        let count = |bvh: &BinaryBvh| visits(&mesh, bvh, None);
        let after = rebuild_treelets(&mesh, before, 3, &count, &mut report, &Silent).unwrap();
        let rebuilt = entered_by_others(&mesh, &after, Some(&visits(&mesh, &after, None)));
        assert!(by_visits < 0.985 * by_areas, "{name}: {by_areas}, by visits {by_visits}");
        assert!(rebuilt < most * by_areas, "{name}: {by_areas}, by visits {by_visits}, rebuilt {rebuilt}");
    }
}

#[test]
fn the_tree_is_the_same_at_any_number_of_threads() {
    let mesh = soup(4000, 7);
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| rebuilt(&mesh, Quality::Balanced, 3).1)
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn rounds_can_be_cancelled() {
    struct Cancelled;
    impl Monitor for Cancelled {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let mesh = soup(400, 1);
    let (before, mut report) = built(&mesh, Quality::Fast);
    let result = rebuild_treelets(&mesh, before, 1, &by_areas, &mut report, &Cancelled);
    assert!(matches!(result, Err(bth_import::Error::Cancelled)));
}

/// The smallest area of wide nodes of a subtree in at most `slots` slots, by trying everything.
fn least_area(treelet: &BinaryBvh, at: usize, slots: usize) -> f64 {
    let node = &treelet.nodes[at];
    if node.is_leaf() {
        return 0.0;
    }
    let shared = |slots: usize| {
        let of = |left: usize| {
            least_area(treelet, at + 1, left) + least_area(treelet, node.right as usize, slots - left)
        };
        (1..slots).map(of).fold(f64::INFINITY, f64::min)
    };
    // A wide node over two or three leaves is never worse for having fewer slots below it.
    let own = node.half_area() + if node.count as usize <= WIDTH { 0.0 } else { shared(WIDTH) };
    if node.count as usize <= slots { 0.0 } else { own.min(shared(slots)) }
}

#[test]
fn treelet_plans_have_the_least_area() {
    for (count, seed) in [(2, 1), (16, 2), (17, 3), (22, 4), (26, 5)] {
        let mesh = soup(count, seed);
        let (treelet, _) = built(&mesh, Quality::Fast);
        let slots = |at: usize| least_area(&treelet, at, 1);
        let right = treelet.nodes[0].right as usize;
        let shares = (1..WIDTH).map(|k| least_area(&treelet, 1, k) + least_area(&treelet, right, WIDTH - k));
        let expected = shares.fold(f64::INFINITY, f64::min);
        let plan = TreeletPlan::new(&treelet);
        let tolerance = 1e-5 * treelet.nodes[0].half_area();
        assert!((plan.area - expected).abs() <= tolerance, "{count}: {} {expected} {}", plan.area, slots(0));
    }
}

/// Does the same as [`agglomerate`], but computes all areas again before each step. Returns the
/// boxes of the inner nodes.
fn joined_slowly(boxes: &[Bounds]) -> Vec<Bounds> {
    let (mut open, mut inner) = (boxes.to_vec(), Vec::new());
    while open.len() > 1 {
        let pairs = (0..open.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let area = |(a, b): (usize, usize)| open[a].union(&open[b]).half_area();
        let (a, b) = pairs.min_by(|p, q| area(*p).total_cmp(&area(*q))).unwrap();
        let joined = open[a].union(&open[b]);
        open[b] = joined;
        open.swap_remove(a);
        inner.push(joined);
    }
    inner
}

proptest! {
    #[test]
    fn boxes_are_joined_by_the_least_area(count in 1usize..=WIDTH, seed: u64) {
        let mut random = Rng::new(seed);
        let point = |random: &mut Rng| [(); 3].map(|()| random.unit_f32());
        let boxes: Vec<Bounds> =
            (0..count).map(|_| Bounds::of_points(&[point(&mut random), point(&mut random)])).collect();
        let joined = agglomerate(&boxes);
        prop_assert_eq!(&joined.bounds[..count], &boxes[..]);
        prop_assert_eq!(&joined.bounds[count..], &joined_slowly(&boxes)[..]);
        for (inner, [left, right]) in joined.children.iter().enumerate() {
            prop_assert_eq!(joined.bounds[count + inner], joined.bounds[*left].union(&joined.bounds[*right]));
        }
    }

    #[test]
    fn random_meshes_stay_valid(count in 1usize..400, seed: u64, kind in 0..3, rounds in 0usize..4) {
        let mesh = match kind {
            0 => soup(count, seed),
            1 => clutter(count, &[0.0, -0.5, 1.0, 3.0], seed),
            _ => grid(1 + count / 20, 1.0, seed),
        };
        let (_, after, report) = rebuilt(&mesh, Quality::Fast, rounds);
        prop_assert_eq!(validate_binary(&mesh, &after), report.levels);
    }
}
