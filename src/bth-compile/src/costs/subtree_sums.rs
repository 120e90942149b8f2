//! Areas and depths of every subtree, the inputs of the cost model, summed in one pass from the leaves to the root.

use crate::bvh::{BinaryBvh, Node};

/// Sums over the subtree of a node, the node included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Surface areas of the inner nodes, object space squared.
    pub(super) inner_area: f64,
    /// Surface areas of the leaves.
    pub(super) leaf_area: f64,
    /// Edges from the node down to each of its leaves.
    pub(super) depth: u64,
}

/// Half the surface area of a node's box; the sums above are of half areas too. Never zero: a triangle of non-zero area
/// extends along two axes, and f64 holds the product of any two extents.
pub(super) fn half_area(node: &Node) -> f64 {
    let side = |k: usize| f64::from(node.upper[k]) - f64::from(node.lower[k]);
    side(0) * side(1) + side(1) * side(2) + side(2) * side(0)
}

/// The sums of every node.
pub(super) fn subtree_sums(bvh: &BinaryBvh) -> Vec<Sums> {
    let mut sums = vec![Sums::default(); bvh.nodes.len()];
    for (i, node) in bvh.nodes.iter().enumerate().rev() {
        let area = half_area(node);
        sums[i] = if node.is_leaf() {
            Sums { inner_area: 0.0, leaf_area: area, depth: 0 }
        } else {
            let (l, r) = (sums[i + 1], sums[node.right as usize]);
            Sums {
                inner_area: l.inner_area + r.inner_area + area,
                leaf_area: l.leaf_area + r.leaf_area,
                depth: l.depth + r.depth + u64::from(node.count),
            }
        };
    }
    sums
}
