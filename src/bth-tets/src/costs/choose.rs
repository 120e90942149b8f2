//! The selection: the nodes of min expected time.

use super::bottom_up::Candidates;
use super::gains::{Gain, Sampled, sample};
use super::options::{Choice, CostOptions, CostReport, Select, SelectionOutcome, Verdict};
use super::prices::Prices;
use crate::marks::Marks;
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::KnownRays;
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;

/// Chooses nodes to tetrahedralize.
///
/// # Errors
/// [`Error::Cancelled`]; `BTH-X030` when `marks` belongs to another BVH.
pub fn choose(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    monitor: &dyn Monitor,
) -> Result<(Choice, CostReport)> {
    monitor.stage("costs", None);
    if marks.suitable.len() != bvh.nodes.len() {
        let message = format!("{} marks for {} nodes", marks.suitable.len(), bvh.nodes.len());
        return Err(Error::Internal { code: "BTH-X030", message });
    }
    let prices = Prices::new(options);
    let (mut choice, cost_bvh, mut cost_with_tets) = match &options.select {
        Select::Best => best(mesh, bvh, marks, options, &prices, monitor)?,
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
    monitor: &dyn Monitor,
) -> Result<(Choice, CostReport)> {
    let all = Marks { suitable: vec![true; bvh.nodes.len()] };
    choose(mesh, bvh, &all, options, monitor)
}

/// The choice of max gain, with the cost of a ray before and after.
fn best(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    prices: &Prices<'_>,
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
    let gains = sampled.gains(bvh, &nodes, prices, weights);
    let rows = Candidates { bvh, nodes: &nodes, gains: &gains }.best();
    let chosen: Vec<u32> = rows.iter().map(|&k| nodes[k]).collect();
    let saved: f64 = rows.iter().map(|&k| gains[k].saved).sum();

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
            v.decision = SelectionOutcome::RefusedParts;
        }
        verdicts.push(v);
    }
    Ok((Choice { chosen, verdicts }, sampled.cost_bvh, sampled.cost_bvh - saved))
}

/// The nodes of at least this many triangles and their smaller children, ascending.
fn nodes_from(bvh: &BinaryBvh, triangles: u32) -> Vec<u32> {
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
