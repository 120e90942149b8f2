//! A binary BVH with parent links, in which subtrees can be moved.

use super::bounds::Bounds;
use super::extent::Extent;
use super::{BinaryBvh, MAX_LEVELS, Node};
use bth_format::layout::NONE;

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

impl LinkedTree<Bounds> {
    /// The tree of a BVH, with the BVH's boxes.
    pub(super) fn new(bvh: &BinaryBvh) -> Self {
        Self::linked(bvh, |node, _| Bounds::of_node(node))
    }
}

impl<E: Extent> LinkedTree<E> {
    /// The tree of a BVH, with bounds that `leaf` gives for a triangle.
    pub(super) fn of_leaves(bvh: &BinaryBvh, leaf: impl Fn(u32) -> E) -> Self {
        let bounds = |node: &Node, triangle: u32| if node.is_leaf() { leaf(triangle) } else { E::EMPTY };
        let mut tree = Self::linked(bvh, bounds);
        for at in (0..tree.nodes.len()).rev() {
            let LinkedNode { left, right, .. } = tree.nodes[at];
            if left != NONE {
                tree.nodes[at].bounds = tree.node(left).bounds.union(&tree.node(right).bounds);
            }
        }
        tree
    }

    /// The tree of a BVH; `bounds` gives those of a node, which for a leaf is told its triangle.
    fn linked(bvh: &BinaryBvh, bounds: impl Fn(&Node, u32) -> E) -> Self {
        let mut nodes: Vec<LinkedNode<E>> = bvh
            .nodes
            .iter()
            .zip(0u32..)
            .map(|(node, at)| {
                let (left, right) = if node.is_leaf() {
                    (NONE, bvh.order[node.first as usize])
                } else {
                    (at + 1, node.right)
                };
                LinkedNode { bounds: bounds(node, right), parent: NONE, left, right }
            })
            .collect();
        let mut heights = vec![0u8; nodes.len()];
        for at in (0..nodes.len()).rev() {
            let LinkedNode { left, right, .. } = nodes[at];
            if left != NONE {
                nodes[left as usize].parent = at as u32;
                nodes[right as usize].parent = at as u32;
                heights[at] = 1 + heights[left as usize].max(heights[right as usize]);
            }
        }
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
        self.nodes.iter().map(|n| n.bounds.half_area()).sum::<f64>() / self.node(self.root).bounds.half_area()
    }

    /// Whether `moved`, which has a grandparent, may become the sibling of `target`: the move must change the tree, must
    /// not place a subtree below itself, and must keep within [`MAX_LEVELS`].
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

    /// Makes `moved` the sibling of `target` where [`LinkedTree::can_move`]. Its former parent, which has no other child
    /// then, becomes the parent of both. Returns the change of the sum of all areas.
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
        let mut visited = Vec::with_capacity(self.nodes.len());
        let mut stack = vec![self.root];
        bvh.order.clear();
        while let Some(at) = stack.pop() {
            let node = self.node(at);
            let first = bvh.order.len() as u32;
            let out = &mut bvh.nodes[visited.len()];
            let Bounds { lower, upper } = node.bounds.node_box();
            *out = Node { lower, upper, first, count: 1, right: 0 };
            visited.push(at);
            if node.is_leaf() {
                bvh.order.push(node.right);
            } else {
                stack.push(node.right);
                stack.push(node.left);
            }
        }
        // A subtree of n triangles takes 2 n - 1 nodes, so the left child's count gives the right child's place.
        for at in (0..visited.len()).rev() {
            if !self.node(visited[at]).is_leaf() {
                let left = bvh.nodes[at + 1].count;
                let right = at + 2 * left as usize;
                bvh.nodes[at].right = right as u32;
                bvh.nodes[at].count = left + bvh.nodes[right].count;
            }
        }
        bvh
    }
}
