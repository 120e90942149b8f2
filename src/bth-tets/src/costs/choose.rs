//! The selection: the nodes of min expected time.

use super::bottom_up::Candidates;
use super::gains::{Sampled, sample};
use super::options::{CostOptions, CostReport, Select};
use super::prices::Prices;
use crate::marks::Marks;
use bth_bvh::BinaryBvh;
use bth_bvh::sampling::KnownRays;
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;

/// Chooses nodes to tetrahedralize, ascending; none lies below another.
///
/// # Errors
/// [`Error::Cancelled`]; `BTH-X030` when `marks` belongs to another BVH.
pub fn choose(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    monitor: &dyn Monitor,
) -> Result<(Vec<u32>, CostReport)> {
    monitor.stage("costs", None);
    if marks.suitable.len() != bvh.nodes.len() {
        let message = format!("{} marks for {} nodes", marks.suitable.len(), bvh.nodes.len());
        return Err(Error::Internal { code: "BTH-X030", message });
    }
    let mut report = CostReport { options: options.clone(), ..CostReport::default() };
    let mut chosen = match &options.select {
        Select::Best => best(mesh, bvh, marks, &mut report, monitor)?,
        Select::Nodes(nodes) => nodes.clone(),
    };
    if report.cost_bvh - report.cost_with_tets < options.minimum_gain * report.cost_bvh {
        chosen.clear();
        report.cost_with_tets = report.cost_bvh;
    }
    report.chosen = chosen.len() as u64;
    report.triangles = chosen.iter().map(|&i| u64::from(bvh.nodes[i as usize].count)).sum();
    report.share = report.triangles as f64 / bvh.order.len().max(1) as f64;
    Ok((chosen, report))
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
) -> Result<(Vec<u32>, CostReport)> {
    let all = Marks { suitable: vec![true; bvh.nodes.len()] };
    choose(mesh, bvh, &all, options, monitor)
}

/// The choice of max gain. Notes in the report what was examined, and the cost of a ray before and
/// after.
fn best(
    mesh: &Mesh,
    bvh: &BinaryBvh,
    marks: &Marks,
    report: &mut CostReport,
    monitor: &dyn Monitor,
) -> Result<Vec<u32>> {
    let options = &report.options;
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
        report.examined = top.len() as u64;
        return Ok(Vec::new());
    }
    let weights = options.rays.as_deref().map_or(options.optimize_for.weights(), KnownRays::shares);
    let sampled: Sampled = sample(mesh, bvh, options);
    monitor.check()?;
    let gains = sampled.gains(bvh, &nodes, &Prices::new(options), weights);
    let rows = Candidates { bvh, nodes: &nodes, gains: &gains }.best();
    let chosen: Vec<u32> = rows.iter().map(|&k| nodes[k]).collect();
    let saved: f64 = rows.iter().map(|&k| gains[k]).sum();
    (report.cost_bvh, report.cost_with_tets) = (sampled.cost_bvh, sampled.cost_bvh - saved);

    // Nodes below a chosen or a small node are not examined.
    let mut skip_to = 0;
    for &i in top.iter() {
        if i < skip_to {
            continue;
        }
        report.examined += 1;
        if chosen.binary_search(&i).is_ok() {
            skip_to = i + 2 * bvh.nodes[i as usize].count - 1;
        } else if nodes.binary_search(&i).is_ok_and(|k| gains[k] <= 0.0) {
            report.refused_for_cost += 1;
        }
    }
    Ok(chosen)
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
