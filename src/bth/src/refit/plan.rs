//! How a refit is divided into tasks: subtrees, whose nodes and whose leaves lie next to each other
//! each, because both lie in depth-first order in deformable objects. The tasks do not depend on
//! the number of threads.

use crate::bvh::nodes::leaf_size;
use bth_format::layout::{NODE_LINES, NONE, WIDTH};
use bth_format::object::ObjectView;

/// Subtrees of at most this many leaves are tasks.
const TASK_LEAVES: u32 = 512;

/// A range of leaves in depth-first order.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LeafRange {
    /// Line of the first leaf.
    pub(super) line: u32,
    /// Number of lines.
    pub(super) lines: u32,
    /// Row of LEAF_VERTICES of the first leaf.
    pub(super) row: u32,
    /// Number of rows.
    pub(super) rows: u32,
}

/// A child of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChildSlot {
    /// Line of the node.
    pub(super) node: u32,
    pub(super) slot: u32,
}

/// A subtree.
#[derive(Clone, Copy, Debug)]
pub(super) struct RefitTask {
    /// Where its box is stored; `None` if it is the whole tree.
    pub(super) parent: Option<ChildSlot>,
    /// Line of its root; the other nodes follow.
    pub(super) node: u32,
    /// Number of lines of its nodes.
    pub(super) node_lines: u32,
    pub(super) leaves: LeafRange,
}

/// A leaf that does not belong to a task.
#[derive(Clone, Copy, Debug)]
pub(super) struct TopLeaf {
    /// Where its box is stored; `None` if it is the whole tree.
    pub(super) parent: Option<ChildSlot>,
    /// Its code.
    pub(super) code: u32,
    /// Its row of LEAF_VERTICES.
    pub(super) row: u32,
}

/// The division of an object's tree.
#[derive(Debug, Default)]
pub(super) struct RefitPlan {
    /// Lines of all nodes; leaves come behind.
    pub(super) node_lines: u32,
    /// Subtrees, ascending by line, which cover all leaves but `leaves` and all nodes but `nodes`.
    pub(super) tasks: Vec<RefitTask>,
    /// Lines of the nodes above the tasks, ascending.
    pub(super) nodes: Vec<u32>,
    /// Leaves of these nodes.
    pub(super) leaves: Vec<TopLeaf>,
}

/// Size of a subtree.
#[derive(Clone, Copy, Debug, Default)]
struct Size {
    node_lines: u32,
    leaves: u32,
    leaf_lines: u32,
    rows: u32,
}

impl Size {
    /// The size of a leaf; `None` if the code is of a node.
    fn of_leaf(code: u32) -> Option<Size> {
        let (leaf_lines, rows) = leaf_size(code)?;
        Some(Size { node_lines: 0, leaves: 1, leaf_lines, rows })
    }

    fn add(&mut self, other: Size) {
        self.node_lines += other.node_lines;
        self.leaves += other.leaves;
        self.leaf_lines += other.leaf_lines;
        self.rows += other.rows;
    }
}

impl RefitPlan {
    /// The plan for a deformable object.
    pub(super) fn new(view: &ObjectView<'_>) -> RefitPlan {
        let root = view.header.root;
        if Size::of_leaf(root).is_some() {
            let leaves = vec![TopLeaf { parent: None, code: root, row: 0 }];
            return RefitPlan { leaves, ..RefitPlan::default() };
        }
        let sizes = sizes(view);
        let node_lines = (sizes.len() * NODE_LINES) as u32;
        let mut plan = RefitPlan { node_lines, ..RefitPlan::default() };
        // Nodes that are still to be divided, with their parent's slot and their first leaf.
        let mut stack = vec![(None, root, node_lines, 0)];
        while let Some((parent, node, line, row)) = stack.pop() {
            let size = sizes[node as usize / NODE_LINES];
            if size.leaves <= TASK_LEAVES {
                let leaves = LeafRange { line, lines: size.leaf_lines, row, rows: size.rows };
                plan.tasks.push(RefitTask { parent, node, node_lines: size.node_lines, leaves });
                continue;
            }
            plan.nodes.push(node);
            let (first, mut line, mut row) = (stack.len(), line, row);
            for (slot, code) in children(view, node).enumerate() {
                let parent = Some(ChildSlot { node, slot: slot as u32 });
                let size = Size::of_leaf(code).unwrap_or_else(|| {
                    stack.push((parent, code, line, row));
                    sizes[code as usize / NODE_LINES]
                });
                if leaf_size(code).is_some() {
                    plan.leaves.push(TopLeaf { parent, code, row });
                }
                line += size.leaf_lines;
                row += size.rows;
            }
            // The first child is divided next, so that nodes and tasks ascend.
            stack[first..].reverse();
        }
        plan
    }
}

/// The codes of a node's children.
fn children<'a>(view: &'a ObjectView<'_>, node: u32) -> impl DoubleEndedIterator<Item = u32> + 'a {
    let codes = &view.node(node).child;
    let used = codes.iter().position(|code| *code == NONE).unwrap_or(WIDTH);
    codes[..used].iter().copied()
}

/// The sizes of the subtrees of all nodes.
fn sizes(view: &ObjectView<'_>) -> Vec<Size> {
    let mut count = 0;
    let mut stack = vec![view.header.root];
    // The nodes are the first ones of the lines. The last one in depth-first order has the max
    // line.
    while let Some(node) = stack.pop() {
        count = count.max(node as usize / NODE_LINES + 1);
        stack.extend(children(view, node).rev().find(|code| leaf_size(*code).is_none()));
    }
    let mut sizes = vec![Size::default(); count];
    for node in (0..count).rev() {
        let mut size = Size { node_lines: NODE_LINES as u32, ..Size::default() };
        for code in children(view, (node * NODE_LINES) as u32) {
            size.add(Size::of_leaf(code).unwrap_or_else(|| sizes[code as usize / NODE_LINES]));
        }
        sizes[node] = size;
    }
    sizes
}
