//! The paper's selection (§3.2, §3.3): top-down, the first suitable nodes for which tetrahedra are
//! the cheaper structure for rays from outside.

use super::options::{Choice, CostOptions, SelectionOutcome, Verdict};
use super::prices::{LINES_THAT_HIT, Prices};
use super::subtree_sums::subtree_sums;
use super::{Estimator, Start};
use crate::marks::Marks;
use bth_bvh::BinaryBvh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;

/// Nodes between two checks for cancellation.
const NODES_BETWEEN_CHECKS: usize = 1 << 14;

/// Costs of the paper's rule, nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PaperCosts {
    pub(super) estimator: Estimator,
    /// C_t and C_i: the visit of a node or leaf.
    pub(super) visit: f64,
}

/// Chooses nodes from the root down: a suitable node of fitting size becomes a tet leaf if
/// `C_tet N_avg` (the paper's equation 2) plus the cost of entering the tetrahedra is below the
/// cost of its BVH. Otherwise its children are examined.
pub(super) fn choose(
    bvh: &BinaryBvh,
    marks: &Marks,
    options: &CostOptions,
    prices: &Prices<'_>,
    monitor: &dyn Monitor,
) -> Result<(Choice, f64, f64)> {
    let paper = PaperCosts { estimator: options.estimator, visit: options.profile.bvh.outside };
    let sums = subtree_sums(bvh);
    let mut choice = Choice::default();
    let mut saved = 0.0;
    let Some(root) = bvh.nodes.first() else { return Ok((choice, 0.0, 0.0)) };
    let mut i = 0;
    // In preorder the nodes below a node follow it, so a subtree is skipped by advancing the index.
    while i < bvh.nodes.len() {
        if choice.verdicts.len().is_multiple_of(NODES_BETWEEN_CHECKS) {
            monitor.check()?;
        }
        let (node, sum) = (&bvh.nodes[i], &sums[i]);
        let suitable = marks.suitable[i];
        let depth = sum.depth as f64 / f64::from(node.count);
        let n_avg = paper.estimator.steps(Start::Outside, node.count, depth);
        let cost_tet = prices.outside(node.count, n_avg, LINES_THAT_HIT);
        let cost_bvh = paper.visit * (sum.inner_area + sum.leaf_area) / node.half_area();
        let decision = if node.count < options.minimum_triangles {
            SelectionOutcome::RefusedSmall
        } else if !suitable {
            SelectionOutcome::Unsuitable
        } else if node.count > options.maximum_triangles {
            SelectionOutcome::RefusedLarge
        } else if cost_tet < cost_bvh {
            SelectionOutcome::Chosen
        } else {
            SelectionOutcome::RefusedCost
        };
        let gain = node.half_area() / root.half_area() * (cost_bvh - cost_tet);
        let verdict = Verdict {
            node: i as u32,
            count: node.count,
            suitable,
            cost_tet,
            cost_bvh,
            n_avg,
            gain,
            decision,
        };
        choice.verdicts.push(verdict);
        if decision == SelectionOutcome::Chosen {
            choice.chosen.push(i as u32);
            saved += gain;
        }
        i += match decision {
            SelectionOutcome::Chosen | SelectionOutcome::RefusedSmall => 2 * node.count as usize - 1,
            _ => 1,
        };
    }
    let cost = choice.verdicts[0].cost_bvh;
    Ok((choice, cost, cost - saved))
}
