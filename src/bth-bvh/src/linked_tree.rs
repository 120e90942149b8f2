//! A binary BVH with parent links, in which subtrees can be moved.

use super::bounds::Bounds;
use super::extent::Extent;
use super::{BinaryBvh, MAX_LEVELS, Node, sum};
use bth_format::layout::NONE;
use rayon::prelude::*;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;

/// Node of a [`LinkedTree`].
#[derive(Clone, Copy)]
pub(super) struct LinkedNode<E> {
    pub(super) bounds: E,
    /// `NONE` for the root.
    pub(super) parent: u32,
    /// `NONE` for a leaf.
    pub(super) left: u32,
    /// For a leaf: its triangle's id.
    pub(super) right: u32,
}

impl<E> LinkedNode<E> {
    #[inline(always)]
    pub(super) fn is_leaf(&self) -> bool {
        self.left == NONE
    }
}

/// A binary BVH whose nodes keep their index while they move.
pub(super) struct LinkedTree<E> {
    nodes: Vec<LinkedNode<E>>,
    /// Edges to the deepest leaf below; at most [`MAX_LEVELS`].
    heights: Vec<u8>,
    root: u32,
}

/// Subtrees of more nodes are linked and laid out as separate tasks.
const LINK_TASK: usize = 1 << 13;

impl LinkedTree<Bounds> {
    /// The tree of a BVH, with the BVH's boxes.
    pub(super) fn new(bvh: &BinaryBvh) -> Self {
        Self::linked(bvh, |node, _| Bounds::of_node(node), |node, _, _| *node)
    }
}

impl<E: Extent> LinkedTree<E> {
    /// The tree of a BVH, with bounds that `leaf` gives for a triangle.
    pub(super) fn of_leaves(bvh: &BinaryBvh, leaf: impl Fn(u32) -> E + Sync) -> Self {
        let bounds = |node: &Node, triangle: u32| if node.is_leaf() { leaf(triangle) } else { E::EMPTY };
        Self::linked(bvh, bounds, |_, left, right| left.union(right))
    }

    /// Links the nodes of a BVH. `bounds` gives the bounds of a node, and is told the triangle of a
    /// leaf. `inner` then gives the bounds of an inner node from these and the bounds of its
    /// children.
    fn linked(
        bvh: &BinaryBvh,
        bounds: impl Fn(&Node, u32) -> E + Sync,
        inner: impl Fn(&E, &E, &E) -> E + Sync,
    ) -> Self {
        let node = |(node, at): (&Node, u32)| {
            let (left, right) = match node.is_leaf() {
                true => (NONE, bvh.order[node.first as usize]),
                false => (at + 1, node.right),
            };
            LinkedNode { bounds: bounds(node, right), parent: NONE, left, right }
        };
        let all = 0..bvh.nodes.len() as u32;
        let mut nodes: Vec<LinkedNode<E>> = bvh.nodes.par_iter().zip(all).map(node).collect();
        let mut heights = vec![0u8; nodes.len()];
        link(&mut nodes, &mut heights, 0, &inner);
        LinkedTree { nodes, heights, root: 0 }
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    #[inline(always)]
    pub(super) fn node(&self, at: u32) -> &LinkedNode<E> {
        &self.nodes[at as usize]
    }

    /// The other child of the parent, which there must be.
    #[inline(always)]
    pub(super) fn sibling(&self, at: u32) -> u32 {
        let parent = self.node(self.node(at).parent);
        if parent.left == at { parent.right } else { parent.left }
    }

    /// Sum of all nodes' areas over the root's.
    pub(super) fn visits(&self) -> f64 {
        sum(self.nodes.len(), |at| self.node(at).bounds.half_area()) / self.node(self.root).bounds.half_area()
    }

    /// Returns true if `moved`, which has a grandparent, may become the sibling of `target`: the
    /// move must change the tree, must not place a subtree below itself, and must keep within
    /// [`MAX_LEVELS`].
    pub(super) fn can_move(&self, moved: u32, target: u32) -> bool {
        let parent = self.node(moved).parent;
        if parent == NONE || self.node(parent).parent == NONE {
            return false;
        }
        if target == parent || target == self.sibling(moved) {
            return false;
        }
        let (mut at, mut level) = (target, 0u32);
        while at != NONE {
            if at == moved {
                return false;
            }
            at = self.node(at).parent;
            level += 1;
        }
        // `level` includes the target itself, which moves down by one edge.
        let height = self.heights[moved as usize].max(self.heights[target as usize]);
        level + u32::from(height) <= MAX_LEVELS
    }

    /// Makes `moved` the sibling of `target` where [`LinkedTree::can_move`]. Its former parent,
    /// which has no other child then, becomes the parent of both. Returns the change of the sum of
    /// all areas.
    pub(super) fn move_beside(&mut self, moved: u32, target: u32) -> f64 {
        let parent = self.node(moved).parent;
        let grandparent = self.node(parent).parent;
        let sibling = self.sibling(moved);
        let mut change = -self.node(parent).bounds.half_area();
        self.replace_child(grandparent, parent, sibling);
        change += self.refit(grandparent);

        let above = self.node(target).parent;
        let bounds = self.node(moved).bounds.union(&self.node(target).bounds);
        self.nodes[parent as usize] = LinkedNode { bounds, parent: NONE, left: moved, right: target };
        self.heights[parent as usize] = 1 + self.heights[moved as usize].max(self.heights[target as usize]);
        self.replace_child(above, target, parent);
        self.nodes[target as usize].parent = parent;
        change + bounds.half_area() + self.refit(above)
    }

    /// Replaces the child `old` of `parent` by `new`, or the root.
    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        self.nodes[new as usize].parent = parent;
        if parent == NONE {
            self.root = new;
            return;
        }
        let parent = &mut self.nodes[parent as usize];
        if parent.left == old {
            parent.left = new;
        } else {
            parent.right = new;
        }
    }

    /// Recomputes boxes and heights from `at` up until nothing changes; returns the change of area.
    fn refit(&mut self, mut at: u32) -> f64 {
        let mut change = 0.0;
        while at != NONE {
            let LinkedNode { bounds: before, parent, left, right } = *self.node(at);
            let bounds = self.node(left).bounds.union(&self.node(right).bounds);
            let height = 1 + self.heights[left as usize].max(self.heights[right as usize]);
            if bounds == before && height == self.heights[at as usize] {
                break;
            }
            change += bounds.half_area() - before.half_area();
            self.nodes[at as usize].bounds = bounds;
            self.heights[at as usize] = height;
            at = parent;
        }
        change
    }

    /// Writes the tree in preorder, into the memory of the tree that it was made from.
    pub(super) fn into_preorder(self, mut bvh: BinaryBvh) -> BinaryBvh {
        let counts: Vec<AtomicU32> =
            (0..self.nodes.len()).into_par_iter().map(|_| AtomicU32::new(1)).collect();
        self.count(self.root, 0, &counts);
        let place = Place { node: 0, first: 0 };
        self.write(self.root, place, &counts, &mut bvh.nodes, &mut bvh.order);
        bvh
    }

    /// Counts the triangles below a node and below each node of its subtree. `level` edges lie
    /// above it.
    fn count(&self, at: u32, level: u32, counts: &[AtomicU32]) -> u32 {
        let node = self.node(at);
        if node.is_leaf() {
            return 1;
        }
        let [left, right] = [node.left, node.right];
        let (left, right) = if level < COUNT_TASK_LEVELS && self.nodes.len() > LINK_TASK {
            rayon::join(|| self.count(left, level + 1, counts), || self.count(right, level + 1, counts))
        } else {
            (self.count(left, level + 1, counts), self.count(right, level + 1, counts))
        };
        counts[at as usize].store(left + right, Relaxed);
        left + right
    }

    /// Writes a subtree into as many nodes and rows of the order as it takes.
    fn write(&self, at: u32, to: Place, counts: &[AtomicU32], nodes: &mut [Node], order: &mut [u32]) {
        let node = self.node(at);
        let bounds = node.bounds.node_box();
        let (lower, upper) = (bounds.lower(), bounds.upper());
        let Place { node: place, first } = to;
        nodes[0] = Node { lower, upper, first, count: order.len() as u32, right: 0 };
        if node.is_leaf() {
            order[0] = node.right;
            return;
        }
        // A subtree of n triangles takes 2 n - 1 nodes.
        let left = counts[node.left as usize].load(Relaxed);
        nodes[0].right = place + 2 * left;
        let (left_nodes, right_nodes) = nodes[1..].split_at_mut(2 * left as usize - 1);
        let (left_order, right_order) = order.split_at_mut(left as usize);
        let right_to = Place { node: place + 2 * left, first: first + left };
        let left_to = Place { node: place + 1, first };
        let write_left = |nodes, order| self.write(node.left, left_to, counts, nodes, order);
        if left_nodes.len() + right_nodes.len() > LINK_TASK {
            rayon::join(
                || write_left(left_nodes, left_order),
                || self.write(node.right, right_to, counts, right_nodes, right_order),
            );
        } else {
            write_left(left_nodes, left_order);
            self.write(node.right, right_to, counts, right_nodes, right_order);
        }
    }
}

/// Levels from the root above which subtrees are counted as separate tasks.
const COUNT_TASK_LEVELS: u32 = 12;

/// Where the nodes and rows of a subtree go.
#[derive(Clone, Copy)]
struct Place {
    /// Index of its root.
    node: u32,
    /// First row of `order`.
    first: u32,
}

/// Sets the parents, heights and bounds of a subtree, given its nodes in preorder; `at` is the
/// index of the first one, whose parent is not changed. Returns its height.
fn link<E: Extent>(
    nodes: &mut [LinkedNode<E>],
    heights: &mut [u8],
    at: u32,
    inner: &(impl Fn(&E, &E, &E) -> E + Sync),
) -> u8 {
    let Some((node, below)) = nodes.split_first_mut().filter(|(node, _)| !node.is_leaf()) else { return 0 };
    let left_size = (node.right - at - 1) as usize;
    let (left, right) = below.split_at_mut(left_size);
    let (left_heights, right_heights) = heights[1..].split_at_mut(left_size);
    let (left_at, right_at) = (node.left, node.right);
    let (a, b) = if left.len() + right.len() > LINK_TASK {
        rayon::join(
            || link(left, left_heights, left_at, inner),
            || link(right, right_heights, right_at, inner),
        )
    } else {
        (link(left, left_heights, left_at, inner), link(right, right_heights, right_at, inner))
    };
    left[0].parent = at;
    right[0].parent = at;
    node.bounds = inner(&node.bounds, &left[0].bounds, &right[0].bounds);
    heights[0] = 1 + a.max(b);
    heights[0]
}
