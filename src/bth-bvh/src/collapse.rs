//! The collapse of a binary BVH to the wide BVH: plans the nodes and leaves, and has their lines
//! written.

use super::plan::{Costs, Planner};
use super::poses::Weighed;
use super::slot_order::SlotOrder;
use super::wide::{CollapseReport, Wide};
use super::wide_lines::greatest_coordinate;
use super::wide_tree::Writer;
use super::{BinaryBvh, MAX_LEVELS, Node};
use bth_format::layout::NONE;
use bth_format::object::{WIDENED_RANGE, far_away};
use bth_import::Mesh;
use bth_import::error::{Error, Result};
use bth_import::monitor::Monitor;

/// Options of [`collapse`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CollapseOptions {
    /// True if the vertices of leaves are recorded. No node may be cut then.
    pub leaf_vertices: bool,
    /// Costs by which the tree is chosen.
    pub costs: Costs,
    /// A node over all of the object, if the tree is of a part of it ([`Parts`](super::Parts)).
    pub whole: Option<Node>,
}

/// Collapses a binary BVH to the nodes and leaves of the file, chosen by the nodes' areas or by
/// given probabilities. The nodes in `cut` (ascending, none below another) become tet leaves: the
/// i-th is child `Child::Tets(i)`, in a slot with its node's exact box.
///
/// # Errors
/// [`Error::Limit`] when the lines exceed what a child code can address or the tree is too deep,
/// [`Error::Internal`] when `cut` is not as described, [`Error::Cancelled`].
pub fn collapse<'a>(
    mesh: &Mesh,
    bvh: impl Into<Weighed<'a>>,
    cut: &[u32],
    options: &CollapseOptions,
    monitor: &dyn Monitor,
) -> Result<(Wide, CollapseReport)> {
    let weighed = bvh.into();
    let bvh = weighed.bvh;
    check_cut(bvh, cut)?;
    if options.leaf_vertices && !cut.is_empty() {
        let message = "tet leaves of a deformable object".to_owned();
        return Err(Error::Internal { code: "BTH-X203", message });
    }
    monitor.stage("collapse", None);
    let object = options.whole.as_ref().or(bvh.nodes.first());
    let greatest = object.map_or(0.0, greatest_coordinate);
    // Readers compute the boxes of a deforming object again and do not widen them. For an object
    // that is far from the origin, widening would be large for its size, and readers need not allow
    // for it.
    let is_far = object.is_some_and(|root| far_away(&root.lower, &root.upper).is_some());
    let widened_boxes = !options.leaf_vertices && !is_far && WIDENED_RANGE.contains(&greatest);
    let mut wide = Wide { root: NONE, widened_boxes, ..Wide::default() };
    let mut report = CollapseReport::default();
    if bvh.nodes.is_empty() {
        return Ok((wide, report));
    }
    let planner = Planner::new(mesh, weighed, options.costs, monitor);
    let (decisions, cost) = planner.run(cut)?;
    report.cost = f64::from(cost);
    let root_area = weighed.area(0);
    let mut writer = Writer {
        mesh,
        bvh,
        weighed,
        cut,
        decisions: &decisions,
        slot_order: SlotOrder::new(mesh, bvh),
        leaf_vertices: options.leaf_vertices,
        monitor,
        wide: &mut wide,
        report: &mut report,
    };
    let root = writer.tree()?;
    wide.root = root;
    check_depth(wide.depth)?;

    report.depth = wide.depth;
    if root_area > 0.0 {
        report.node_visits /= root_area;
        report.leaf_visits /= root_area;
    }
    report.measure(&wide);
    Ok((wide, report))
}

fn check_cut(bvh: &BinaryBvh, cut: &[u32]) -> Result<()> {
    let mut free = 0u64;
    for &at in cut {
        let node = bvh.nodes.get(at as usize);
        let Some(node) = node.filter(|_| u64::from(at) >= free) else {
            return Err(Error::Internal {
                code: "BTH-X202",
                message: format!(
                    "tet leaf {at} is no node, not in ascending order or below another tet leaf"
                ),
            });
        };
        free = u64::from(at) + 2 * u64::from(node.count) - 1;
    }
    Ok(())
}

pub(super) fn check_depth(depth: u32) -> Result<()> {
    const { assert!(MAX_LEVELS as usize <= bth_format::limits::MAX_DEPTH) };
    if depth as usize <= bth_format::limits::MAX_DEPTH {
        return Ok(());
    }
    Err(Error::Limit {
        code: "BTH-L203",
        message: format!("the BVH is {depth} nodes deep; {} can be traversed", bth_format::limits::MAX_DEPTH),
    })
}

#[cfg(test)]
#[path = "collapse_tests.rs"]
mod tests;
