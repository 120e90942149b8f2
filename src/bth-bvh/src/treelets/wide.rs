//! Opens what lies below each wide node, splits it again by a full sweep, and plans it again.

use super::super::bounds::Bounds;
use super::super::build::{Effort, split_with};
use super::super::plan::{Decision, Pair, Role, children};
use super::super::split::Reference;
use super::super::sweep_split::Scratch;
use super::super::{BinaryBvh, Node, Quality};
use super::agglomerate::agglomerate;
use super::copy_subtree;
use bth_format::layout::WIDTH;
use bth_import::error::Result;
use bth_import::monitor::Monitor;

/// Largest number of subtrees into which a wide node is opened. With twice to sixteen times as
/// many nothing more is gained.
const MOST_ENTRIES: usize = 64;

/// A child of a wide node.
#[derive(Clone, Copy)]
enum Child {
    /// Index of a wide node.
    Wide(usize),
    /// A node of the binary BVH that becomes a leaf.
    Leaf(u32),
}

/// A child with its box.
#[derive(Clone, Copy)]
struct Entry {
    bounds: Bounds,
    child: Child,
}

/// The planned BVH with treelets below wide nodes replaced where that leaves less area to wide
/// nodes, and the number of these.
pub(super) fn rebuild(
    bvh: &BinaryBvh,
    decisions: &[Decision],
    monitor: &dyn Monitor,
) -> Result<(BinaryBvh, u64)> {
    let mut tree = WideTree { bvh, nodes: Vec::new() };
    let root = tree.add(decisions, 0);
    let count = tree.improve(monitor)?;
    let mut rebuilt =
        BinaryBvh { nodes: Vec::with_capacity(bvh.nodes.len()), order: Vec::with_capacity(bvh.order.len()) };
    tree.write(root, &mut rebuilt);
    Ok((rebuilt, count))
}

/// The wide tree that is planned; `nodes` holds the children of each wide node.
struct WideTree<'a> {
    bvh: &'a BinaryBvh,
    nodes: Vec<Vec<Entry>>,
}

impl WideTree<'_> {
    /// Adds what is planned below a node of the BVH.
    fn add(&mut self, decisions: &[Decision], at: u32) -> Entry {
        let bounds = Bounds::of_node(&self.bvh.nodes[at as usize]);
        if decisions[at as usize].role() != Role::Node {
            return Entry { bounds, child: Child::Leaf(at) };
        }
        let index = self.nodes.len();
        self.nodes.push(Vec::new());
        let entries = children(self.bvh, decisions, at);
        self.nodes[index] = entries.into_iter().map(|child| self.add(decisions, child)).collect();
        Entry { bounds, child: Child::Wide(index) }
    }

    /// Rebuilds treelets from the root down, and counts them.
    fn improve(&mut self, monitor: &dyn Monitor) -> Result<u64> {
        let effort = Effort { sweep_count: usize::MAX, ..Quality::Balanced.effort() };
        let mut scratch = Scratch::default();
        let mut rebuilt = 0;
        let mut stack: Vec<usize> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = stack.pop() {
            monitor.check()?;
            let (entries, area) = self.opened(at);
            if entries.len() > self.nodes[at].len() {
                let row = |(id, entry): (usize, &Entry)| Reference { bounds: entry.bounds, id: id as u32 };
                let mut references: Vec<_> = entries.iter().enumerate().map(row).collect();
                let treelet = split_with(&mut references, &effort, &mut scratch, monitor)?;
                let plan = TreeletPlan::new(&treelet);
                if plan.area < area {
                    self.nodes[at] = self.replaced(&plan, &entries, 0);
                    rebuilt += 1;
                }
            }
            stack.extend(self.nodes[at].iter().filter_map(|entry| match entry.child {
                Child::Wide(index) => Some(index),
                Child::Leaf(_) => None,
            }));
        }
        Ok(rebuilt)
    }

    /// What lies below a wide node when wide nodes below it are opened, the largest first, and the
    /// half area of those.
    fn opened(&self, at: usize) -> (Vec<Entry>, f64) {
        let mut entries = self.nodes[at].clone();
        let mut area = 0.0;
        loop {
            let fits = |entry: &Entry| match entry.child {
                Child::Wide(index) => entries.len() - 1 + self.nodes[index].len() <= MOST_ENTRIES,
                Child::Leaf(_) => false,
            };
            let places = (0..entries.len()).filter(|&place| fits(&entries[place]));
            let half_area = |place: usize| entries[place].bounds.half_area();
            let Some(place) = places.max_by(|&a, &b| half_area(a).total_cmp(&half_area(b))) else { break };
            let entry = entries.swap_remove(place);
            area += entry.bounds.half_area();
            if let Child::Wide(index) = entry.child {
                entries.extend_from_slice(&self.nodes[index]);
            }
        }
        (entries, area)
    }

    /// The children of a wide node of the plan, below which new wide nodes are added.
    fn replaced(&mut self, plan: &TreeletPlan<'_>, entries: &[Entry], at: u32) -> Vec<Entry> {
        let mut replaced = Vec::with_capacity(WIDTH);
        for child in children(plan.treelet, &plan.decisions, at) {
            let node = &plan.treelet.nodes[child as usize];
            replaced.push(if node.is_leaf() {
                entries[plan.treelet.order[node.first as usize] as usize]
            } else {
                let index = self.nodes.len();
                self.nodes.push(Vec::new());
                self.nodes[index] = self.replaced(plan, entries, child);
                Entry { bounds: Bounds::of_node(node), child: Child::Wide(index) }
            });
        }
        replaced
    }

    /// Writes the binary tree below a child. The children of a wide node are joined by
    /// agglomeration: any tree over them serves the present plan, and one of small nodes the next.
    fn write(&self, entry: Entry, to: &mut BinaryBvh) {
        let index = match entry.child {
            Child::Wide(index) => index,
            Child::Leaf(at) => return copy_subtree(self.bvh, at, to),
        };
        let entries = &self.nodes[index];
        let boxes: Vec<Bounds> = entries.iter().map(|entry| entry.bounds).collect();
        let joined = agglomerate(&boxes);
        // The root is written first; each right child sets its index in its parent.
        let mut stack = vec![(joined.bounds.len() - 1, None)];
        // Inner nodes and the end of what is below them, to count triangles.
        let from = to.nodes.len();
        while let Some((node, parent)) = stack.pop() {
            let at = to.nodes.len() as u32;
            if let Some(parent) = parent {
                to.nodes[parent as usize].right = at;
            }
            let Some(inner) = node.checked_sub(entries.len()) else {
                self.write(entries[node], to);
                continue;
            };
            let bounds = joined.bounds[node];
            let (lower, upper) = (bounds.lower(), bounds.upper());
            to.nodes.push(Node { lower, upper, first: to.order.len() as u32, count: 0, right: 0 });
            let [left, right] = joined.children[inner];
            stack.extend([(right, Some(at)), (left, None)]);
        }
        // Only the nodes that were joined here have no count yet; children come after their
        // parents.
        for at in (from..to.nodes.len()).rev() {
            if to.nodes[at].count == 0 {
                let right = to.nodes[at].right as usize;
                to.nodes[at].count = to.nodes[at + 1].count + to.nodes[right].count;
            }
        }
    }
}

/// The plan of smallest area of wide nodes over a treelet. Each leaf takes one slot.
pub(super) struct TreeletPlan<'a> {
    treelet: &'a BinaryBvh,
    decisions: Vec<Decision>,
    /// Half area of the wide nodes below the root.
    pub(super) area: f64,
}

impl<'a> TreeletPlan<'a> {
    pub(super) fn new(treelet: &'a BinaryBvh) -> Self {
        let mut decisions = vec![Decision::default(); treelet.nodes.len()];
        // Leaves cost nothing in any number of slots. Areas are relative to the root's, so that
        // they keep within f32.
        let mut costs = vec![[0.0; WIDTH]; treelet.nodes.len()];
        let root = treelet.nodes[0].half_area();
        let mut below_root = 0.0;
        for (at, node) in treelet.nodes.iter().enumerate().rev().filter(|(_, node)| !node.is_leaf()) {
            let (left, right) = (costs[at + 1], costs[node.right as usize]);
            let leaves =
                [at + 1, node.right as usize].map(|at| (treelet.nodes[at].count as usize).min(WIDTH - 1));
            let pair = Pair { costs: [&left, &right], leaves };
            let (below, share) = pair.distribute(WIDTH);
            let (decision, cost) = (&mut decisions[at], &mut costs[at]);
            decision.set_share(WIDTH, share);
            cost[1] = (node.half_area() / root) as f32 + below;
            pair.in_several_slots(decision, cost);
            below_root = below;
        }
        Self { treelet, decisions, area: f64::from(below_root) * root }
    }
}
