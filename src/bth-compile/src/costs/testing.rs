//! Trees for tests.

use crate::bvh::{BinaryBvh, Node};
use crate::marks::Marks;

/// A tree of random shape over boxes that shrink from parent to child.
pub(super) fn tree(seed: u64, leaves: u32) -> BinaryBvh {
    fn grow(nodes: &mut Vec<Node>, seed: &mut u64, first: u32, count: u32, size: f32) {
        let i = nodes.len();
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        nodes.push(Node { lower: [0.0; 3], upper: [size, size * 0.5, size * 0.25], first, count, right: 0 });
        if count > 1 {
            let left = 1 + (*seed >> 33) as u32 % (count - 1);
            grow(nodes, seed, first, left, size * 0.72);
            nodes[i].right = nodes.len() as u32;
            grow(nodes, seed, first + left, count - left, size * 0.78);
        }
    }
    let mut bvh = BinaryBvh { nodes: Vec::new(), order: (0..leaves).collect() };
    let mut seed = seed;
    grow(&mut bvh.nodes, &mut seed, 0, leaves, 1.0);
    bvh
}

/// Suitable where the first triangle is past the given row: closed under descending.
pub(super) fn marks_beyond(bvh: &BinaryBvh, row: u32) -> Marks {
    Marks { suitable: bvh.nodes.iter().map(|n| n.first >= row || n.count == 1).collect() }
}
