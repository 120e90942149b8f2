//! The BVH with sixteen children a node and blocks of up to sixteen triangles, for lanes.

use crate::bvh::BinaryBvh;
use bth::simd::LANES;
use bth_format::layout::NONE;
use bth_import::Mesh;

/// Bit of a child that is a block.
pub(super) const BLOCK: u32 = 1 << 31;
/// The largest coordinate in absolute value: products of three differences of coordinates do not
/// overflow.
const GREATEST: f32 = (1u64 << 36) as f32;

/// The children of a node with their boxes. Lanes after the last child repeat its box.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    pub(super) lower: [[f32; LANES]; 3],
    pub(super) upper: [[f32; LANES]; 3],
    /// A node, a block, or [`NONE`] after the last child.
    pub(super) child: [u32; LANES],
    /// Bits of the children.
    pub(super) children: u32,
}

/// Triangles that follow each other in the order of the BVH. Lanes after the last one repeat it.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    /// By corner and axis.
    pub(super) corner: [[[f32; LANES]; 3]; 3],
    /// Row of the first in the order of the BVH.
    pub(super) first: u32,
    pub(super) count: u32,
}

/// The nodes, the root first, and the blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
}

impl Tree {
    /// `None` if coordinates are too large for arithmetic in f32, or there is nothing.
    pub(super) fn new(mesh: &Mesh, binary: &BinaryBvh) -> Option<Self> {
        let root = binary.nodes.first()?;
        if !root.lower.iter().chain(&root.upper).all(|x| x.abs() <= GREATEST) {
            return None;
        }
        let mut tree = Tree::default();
        // Each entry is a node of the binary BVH, and where to store the index of the wide one.
        let mut stack = vec![(0u32, None)];
        while let Some((node, parent)) = stack.pop() {
            let index = tree.nodes.len() as u32;
            if let Some((parent, slot)) = parent {
                let parent: &mut Node = &mut tree.nodes[parent as usize];
                parent.child[slot] = index;
            }
            let children = children(binary, node);
            let mut wide = Node::new(binary, &children);
            for (slot, child) in children.into_iter().enumerate() {
                if is_block(binary, child) {
                    wide.child[slot] = BLOCK | tree.blocks.len() as u32;
                    tree.blocks.push(Block::new(mesh, binary, child));
                } else {
                    stack.push((child, Some((index, slot))));
                }
            }
            tree.nodes.push(wide);
        }
        Some(tree)
    }
}

fn is_block(binary: &BinaryBvh, node: u32) -> bool {
    binary.nodes[node as usize].count as usize <= LANES
}

/// At most sixteen nodes below a node, or the node itself if it is a block: the largest are
/// replaced by their children.
fn children(binary: &BinaryBvh, node: u32) -> Vec<u32> {
    let mut found = vec![node];
    while found.len() < LANES {
        let inner = |(_, node): &(usize, &u32)| !is_block(binary, **node);
        let largest = found
            .iter()
            .enumerate()
            .filter(inner)
            .max_by_key(|(_, node)| binary.nodes[**node as usize].count);
        let Some((at, &node)) = largest else { break };
        found[at] = node + 1;
        found.push(binary.nodes[node as usize].right);
    }
    found
}

impl Node {
    /// The children that are blocks or nodes follow.
    fn new(binary: &BinaryBvh, children: &[u32]) -> Self {
        let mut node = Node {
            lower: [[0.0; LANES]; 3],
            upper: [[0.0; LANES]; 3],
            child: [NONE; LANES],
            children: (1 << children.len()) - 1,
        };
        for lane in 0..LANES {
            let of = &binary.nodes[children[lane.min(children.len() - 1)] as usize];
            for k in 0..3 {
                node.lower[k][lane] = of.lower[k];
                node.upper[k][lane] = of.upper[k];
            }
        }
        node
    }
}

impl Block {
    fn new(mesh: &Mesh, binary: &BinaryBvh, node: u32) -> Self {
        let of = &binary.nodes[node as usize];
        let mut block = Block { corner: [[[0.0; LANES]; 3]; 3], first: of.first, count: of.count };
        for lane in 0..LANES {
            let row = of.first + (lane as u32).min(of.count - 1);
            let corners = mesh.corners(binary.order[row as usize]);
            for (corner, p) in corners.into_iter().enumerate() {
                for k in 0..3 {
                    block.corner[corner][k][lane] = p[k];
                }
            }
        }
        block
    }

    /// The corners of a triangle.
    pub(super) fn corners(&self, lane: usize) -> [[f32; 3]; 3] {
        [0, 1, 2].map(|corner| [0, 1, 2].map(|k| self.corner[corner][k][lane]))
    }
}
