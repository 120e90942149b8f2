//! Trees for tests.

use crate::marks::Marks;
use bth_bvh::{BinaryBvh, Node};
use bth_random::Rng;

/// A tree of random shape over boxes that shrink from parent to child.
pub(super) fn tree(seed: u64, leaves: u32) -> BinaryBvh {
    fn grow(nodes: &mut Vec<Node>, random: &mut Rng, first: u32, count: u32, size: f32) {
        let i = nodes.len();
        nodes.push(Node { lower: [0.0; 3], upper: [size, size * 0.5, size * 0.25], first, count, right: 0 });
        if count > 1 {
            let left = 1 + random.below(u64::from(count) - 1) as u32;
            grow(nodes, random, first, left, size * 0.72);
            nodes[i].right = nodes.len() as u32;
            grow(nodes, random, first + left, count - left, size * 0.78);
        }
    }
    let mut bvh = BinaryBvh { nodes: Vec::new(), order: (0..leaves).collect() };
    grow(&mut bvh.nodes, &mut Rng::new(seed), 0, leaves, 1.0);
    bvh
}

/// Marks that call a node suitable if its first row is at least the given one, or if it is a leaf.
/// As with real marks, every node below a suitable one is suitable.
pub(super) fn marks_beyond(bvh: &BinaryBvh, row: u32) -> Marks {
    Marks { suitable: bvh.nodes.iter().map(|n| n.first >= row || n.count == 1).collect() }
}
