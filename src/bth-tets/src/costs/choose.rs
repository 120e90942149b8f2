//! The selection: the paper's rule, or the choice of min expected time.

use super::bottom_up::Candidates;
use super::gains::{Gain, Sampled, sample};
use super::least_useful::{Weighed, least_useful};
use super::options::{Choice, CostOptions, CostReport, Select, SelectionOutcome, Verdict};
use super::prices::Prices;
use super::subtree_sums::depths;
use super::top_down;
use crate::marks::Marks;
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::KnownRays;
use bth_format::layout::RecordKind;
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;

/// How the tetrahedra will be stored, and the size of the object without them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Storage {
    /// Record that stores a tetrahedron.
    pub record: RecordKind,
    /// Bytes of the object without tetrahedra, for the limit on bytes; estimated from the number of
    /// triangles where absent.
    pub plain_bytes: Option<u64>,
}

impl Storage {
    /// Bytes of an object of this many triangles without tetrahedra, estimated where they are not
    /// known.
    fn plain_bytes(&self, triangles: usize) -> f64 {
        self.plain_bytes.map_or(BVH_BYTES * triangles as f64, |bytes| bytes as f64)
    }
}

/// Chooses nodes to tetrahedralize.
///
/// # Errors
/// [`Error::Cancelled`]; `BTH-X030` when `marks` belongs to another BVH.
pub fn choose(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    storage: Storage,
    monitor: &dyn Monitor,
) -> Result<(Choice, CostReport)> {
    monitor.stage("costs", None);
    if marks.suitable.len() != bvh.nodes.len() {
        let message = format!("{} marks for {} nodes", marks.suitable.len(), bvh.nodes.len());
        return Err(Error::Internal { code: "BTH-X030", message });
    }
    let prices = Prices::new(options, storage.record);
    let limits = Limits::new(mesh.triangles.len(), options, &prices, storage);
    let (mut choice, cost_bvh, mut cost_with_tets) = match &options.select {
        Select::Paper => {
            let (mut choice, cost, with) =
                top_down::choose(bvh, marks, options, &prices, |n| limits.allow(n), monitor)?;
            let lost = refuse_beyond(&mut choice, &limits);
            (choice, cost, with + lost)
        }
        Select::Best => best(mesh, bvh, marks, options, &limits, monitor)?,
        Select::Nodes(nodes) => (Choice { chosen: nodes.clone(), verdicts: Vec::new() }, 0.0, 0.0),
    };
    if !choice.chosen.is_empty() && cost_bvh - cost_with_tets < options.minimum_gain * cost_bvh {
        for verdict in choice.verdicts.iter_mut().filter(|v| v.decision == SelectionOutcome::Chosen) {
            verdict.decision = SelectionOutcome::RefusedGain;
        }
        choice.chosen.clear();
        cost_with_tets = cost_bvh;
    }
    let triangles: u64 = choice.chosen.iter().map(|&i| u64::from(bvh.nodes[i as usize].count)).sum();
    let refused = |v: &&Verdict| v.decision == SelectionOutcome::RefusedCost;
    let report = CostReport {
        options: options.clone(),
        examined: choice.verdicts.len() as u64,
        chosen: choice.chosen.len() as u64,
        triangles,
        share: triangles as f64 / bvh.order.len().max(1) as f64,
        refused_for_cost: choice.verdicts.iter().filter(refused).count() as u64,
        cost_bvh,
        cost_with_tets,
    };
    Ok((choice, report))
}

/// Chooses as if all nodes were suitable. If no node is chosen then, none is whatever the marks,
/// where [`CostOptions::more_suitable_gain_more`].
///
/// # Errors
/// [`Error::Cancelled`].
pub fn choose_of_all(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    options: &CostOptions,
    storage: Storage,
    monitor: &dyn Monitor,
) -> Result<(Choice, CostReport)> {
    let all = Marks { suitable: vec![true; bvh.nodes.len()] };
    choose(mesh, bvh, &all, options, storage, monitor)
}

/// Limits on the bytes of tetrahedra and on the seconds to make them.
struct Limits<'a> {
    prices: &'a Prices<'a>,
    /// Most bytes and seconds; `None` where they are not limited.
    most: [Option<f64>; 2],
    /// Bytes of the BVH saved for each triangle of a tet leaf.
    pruned: f64,
}

impl<'a> Limits<'a> {
    fn new(triangles: usize, options: &CostOptions, prices: &'a Prices<'a>, storage: Storage) -> Self {
        let count = triangles as f64;
        let plain = storage.plain_bytes(triangles);
        // A file with any tet leaf also holds the map from triangles to faces.
        let map = size_of::<u32>() as f64 * count;
        let bytes = options.max_bytes_per_triangle.map(|most| (most * count - plain - map).max(0.0));
        Limits { prices, most: [bytes, options.budget], pruned: plain / count.max(1.0) }
    }

    /// Expected bytes and seconds of a node's tetrahedra, both above zero.
    fn takes(&self, triangles: u32) -> [f64; 2] {
        let bytes = self.prices.bytes(triangles);
        let net = bytes - self.pruned * f64::from(triangles);
        [net.max(LEAST_SHARE * bytes), self.prices.seconds(triangles)]
    }

    /// Returns true if the tetrahedra of a single node are within the limits.
    fn allow(&self, triangles: u32) -> bool {
        let takes = self.takes(triangles);
        self.most.iter().zip(takes).all(|(most, takes)| most.is_none_or(|most| takes <= most))
    }
}

/// Min share of the bytes of a node's tetrahedra that is counted against the limit: the node's
/// BVH is dropped in exchange. Keeps the bytes positive, so that gain per byte stays defined.
const LEAST_SHARE: f64 = 0.1;

/// Refuses the chosen nodes of min gain per byte or second until the others are within the limits;
/// returns the lost gain.
fn refuse_beyond(choice: &mut Choice, limits: &Limits<'_>) -> f64 {
    let mut lost = 0.0;
    for kind in 0..2 {
        let Some(most) = limits.most[kind] else { continue };
        let verdicts = choice.verdicts.iter_mut().filter(|v| v.decision == SelectionOutcome::Chosen);
        let mut chosen: Vec<&mut Verdict> = verdicts.collect();
        let weigh = |v: &&mut Verdict| Weighed { gain: v.gain, takes: limits.takes(v.count)[kind] };
        let items: Vec<Weighed> = chosen.iter().map(weigh).collect();
        let excess = items.iter().map(|item| item.takes).sum::<f64>() - most;
        for k in least_useful(&items, excess) {
            chosen[k].decision = SelectionOutcome::RefusedLimit;
            lost += chosen[k].gain;
        }
        choice.chosen =
            chosen.iter().filter(|v| v.decision == SelectionOutcome::Chosen).map(|v| v.node).collect();
    }
    lost
}

/// The choice of max gain, with the cost of a ray before and after.
fn best(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    limits: &Limits<'_>,
    monitor: &dyn Monitor,
) -> Result<(Choice, f64, f64)> {
    let top = nodes_from(bvh, options.minimum_triangles);
    monitor.check()?;
    let fits = |i: &u32| {
        let count = bvh.nodes[*i as usize].count;
        marks.suitable[*i as usize]
            && (options.minimum_triangles..=options.maximum_triangles).contains(&count)
    };
    let nodes: Vec<u32> = top.iter().copied().filter(fits).collect();
    if nodes.is_empty() {
        // Without candidates no rays need to be traced.
        let verdicts = top.iter().map(|&i| verdict(bvh, marks, options, i, None)).collect();
        return Ok((Choice { chosen: Vec::new(), verdicts }, 0.0, 0.0));
    }
    let weights = options.rays.as_deref().map_or(options.optimize_for.weights(), KnownRays::shares);
    let sampled: Sampled = sample(mesh, bvh, options);
    monitor.check()?;
    let depths = depths(bvh, &top, &nodes);
    let gains = sampled.gains(bvh, &depths, &nodes, limits.prices, weights);
    let count = |i: u32| bvh.nodes[i as usize].count;
    let takes: Vec<[f64; 2]> = nodes.iter().map(|&i| limits.takes(count(i))).collect();
    let candidates = Candidates { bvh, nodes: &nodes, gains: &gains, takes: &takes };
    let rows = candidates.best(limits.most);
    let chosen: Vec<u32> = rows.iter().map(|&k| nodes[k]).collect();
    let saved: f64 = rows.iter().map(|&k| gains[k].saved).sum();

    let limited = limits.most.iter().any(Option::is_some);
    let mut verdicts: Vec<Verdict> = Vec::with_capacity(top.len());
    let mut skip_to = 0;
    for &i in top.iter() {
        if i < skip_to {
            continue;
        }
        let row = nodes.binary_search(&i).ok();
        let mut v = verdict(bvh, marks, options, i, row.map(|k| &gains[k]));
        if chosen.binary_search(&i).is_ok() {
            v.decision = SelectionOutcome::Chosen;
            skip_to = i + 2 * v.count - 1;
        } else if row.is_some() && v.gain > 0.0 {
            v.decision =
                if limited { SelectionOutcome::RefusedLimit } else { SelectionOutcome::RefusedParts };
        }
        verdicts.push(v);
    }
    Ok((Choice { chosen, verdicts }, sampled.cost_bvh, sampled.cost_bvh - saved))
}

/// Assumed bytes of the BVH for each triangle of a mesh where its size is not known.
const BVH_BYTES: f64 = 36.0;

/// The nodes of at least this many triangles and their smaller children, ascending.
pub(super) fn nodes_from(bvh: &BinaryBvh, triangles: u32) -> Vec<u32> {
    let (mut nodes, mut i) = (Vec::new(), 0);
    while i < bvh.nodes.len() {
        nodes.push(i as u32);
        let count = bvh.nodes[i].count;
        i += if count < triangles { 2 * count as usize - 1 } else { 1 };
    }
    nodes
}

fn verdict(bvh: &BinaryBvh, marks: &Marks, options: &CostOptions, i: u32, gain: Option<&Gain>) -> Verdict {
    let count = bvh.nodes[i as usize].count;
    let suitable = marks.suitable[i as usize];
    let decision = match () {
        _ if count < options.minimum_triangles => SelectionOutcome::RefusedSmall,
        _ if !suitable => SelectionOutcome::Unsuitable,
        _ if count > options.maximum_triangles => SelectionOutcome::RefusedLarge,
        _ => SelectionOutcome::RefusedCost,
    };
    let gain = gain.copied().unwrap_or_default();
    let Gain { saved, tets, bvh, steps } = gain;
    Verdict { node: i, count, suitable, cost_tet: tets, cost_bvh: bvh, n_avg: steps, gain: saved, decision }
}
