//! Areas and depths of every subtree, the inputs of the cost model, summed in one pass from the
//! leaves to the root.

use bth_bvh::{BinaryBvh, Node};
use rayon::prelude::*;

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

/// [`Sums::depth`] of each of `nodes`. These and `top` are ascending; `top` holds the root, and
/// with a node all nodes above it.
pub(super) fn depths(bvh: &BinaryBvh, top: &[u32], nodes: &[u32]) -> Vec<u64> {
    // A leaf is as deep below a node as there are inner nodes above it, so each inner node adds its
    // leaves. In preorder the nodes of a subtree are a range, which the nodes of `top` divide into
    // parts.
    let end = |k: usize| top.get(k + 1).map_or(bvh.nodes.len(), |next| *next as usize);
    let inner = |part: &[Node]| part.iter().filter(|n| !n.is_leaf()).map(|n| u64::from(n.count)).sum();
    let parts: Vec<u64> =
        top.par_iter().enumerate().map(|(k, &i)| inner(&bvh.nodes[i as usize..end(k)])).collect();
    let mut before = Vec::with_capacity(top.len() + 1);
    before.push(0);
    for part in parts {
        before.push(before[before.len() - 1] + part);
    }
    let depth = |&i: &u32| {
        let behind = i + 2 * bvh.nodes[i as usize].count - 1;
        let [first, last] = [i, behind].map(|node| top.partition_point(|t| *t < node));
        before[last] - before[first]
    };
    nodes.iter().map(depth).collect()
}

/// The sums of every node.
pub(super) fn subtree_sums(bvh: &BinaryBvh) -> Vec<Sums> {
    let mut sums = vec![Sums::default(); bvh.nodes.len()];
    for (i, node) in bvh.nodes.iter().enumerate().rev() {
        let area = node.half_area();
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
