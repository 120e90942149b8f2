//! The nodes of the top-level BVH: boxes, child codes, and what rays through them are expected to
//! cost.

use bth_format::file::File;
use bth_format::layout::{CacheLine, Child, NODE_LINES, NONE, WIDTH, WideNode};
use glam::Vec4;
use std::ops::Range;
use zerocopy::{FromBytes, IntoBytes};

/// Bit of the child codes of instances; the other bits are the index of the instance.
pub(crate) const INSTANCE: u32 = Child::LEAF_BIT;

/// A box: the three lower ends, negated so that a union is a maximum of all values, and the three
/// upper ends. The fourth numbers have no meaning; they fill vector registers.
#[derive(Clone, Copy, Debug)]
pub(super) struct InstanceBounds {
    pub(super) lower: Vec4,
    pub(super) upper: Vec4,
}

impl InstanceBounds {
    pub(super) const EMPTY: InstanceBounds =
        InstanceBounds { lower: Vec4::NEG_INFINITY, upper: Vec4::NEG_INFINITY };

    /// Half the surface area, in f64 because f32 could overflow.
    pub(super) fn area(&self) -> f64 {
        let (lower, upper) = (self.lower.to_array(), self.upper.to_array());
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(upper[k]) + f64::from(lower[k]));
        x * y + y * z + z * x
    }
}

/// The lines of the nodes of a top level.
#[derive(Debug)]
pub(super) enum TreeLines {
    Own(Vec<CacheLine>),
    /// The bytes of a file from and to these.
    Stored(File, Range<usize>),
}

impl TreeLines {
    pub(super) fn nodes(&self) -> TopNodes<'_> {
        TopNodes(match self {
            TreeLines::Own(lines) => lines,
            TreeLines::Stored(file, bytes) => {
                let bytes = file.bytes().get(bytes.clone()).unwrap_or_default();
                <[CacheLine]>::ref_from_bytes(bytes).ok().unwrap_or_default()
            }
        })
    }

    /// Returns true if there are no nodes.
    pub(super) fn is_empty(&self) -> bool {
        match self {
            TreeLines::Own(lines) => lines.is_empty(),
            TreeLines::Stored(_, bytes) => bytes.is_empty(),
        }
    }
}

impl Default for TreeLines {
    fn default() -> TreeLines {
        TreeLines::Own(Vec::new())
    }
}

/// The nodes of a top level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TopNodes<'a>(pub(super) &'a [CacheLine]);

impl<'a> TopNodes<'a> {
    /// The node with a child code.
    #[inline(always)]
    pub(crate) fn node(&self, code: u32) -> &'a WideNode {
        node(&self.0[code as usize..][..NODE_LINES])
    }
}

/// The node in the lines of one.
#[inline(always)]
pub(super) fn node(lines: &[CacheLine]) -> &WideNode {
    WideNode::ref_from_bytes(lines.as_bytes()).ok().expect("a node is as long as its lines")
}

/// Like [`node`].
pub(super) fn node_mut(lines: &mut [CacheLine]) -> &mut WideNode {
    WideNode::mut_from_bytes(lines.as_mut_bytes()).ok().expect("a node is as long as its lines")
}

/// Stores the box of a child in a slot of a node.
pub(super) fn put_bounds(node: &mut WideNode, slot: usize, bounds: &InstanceBounds) {
    let (lower, upper) = (bounds.lower.to_array(), bounds.upper.to_array());
    for k in 0..3 {
        node.bounds[k][0][slot] = -lower[k];
        node.bounds[k][1][slot] = upper[k];
    }
}

/// Number of children of a node, which come first.
pub(super) fn used(node: &WideNode) -> usize {
    node.child.iter().position(|code| *code == NONE).unwrap_or(WIDTH)
}

fn slot_bounds(node: &WideNode, slot: usize) -> InstanceBounds {
    let end = |end: usize| [0, 1, 2].map(|k| node.bounds[k][end][slot]);
    let ([a, b, c], [d, e, f]) = (end(0), end(1));
    InstanceBounds { lower: Vec4::new(-a, -b, -c, 0.0), upper: Vec4::new(d, e, f, 0.0) }
}

/// The expected cost of rays through the top level, now and when it was built.
///
/// If a random line hits a box, the probability that it also hits a second box inside is the ratio
/// of their surface areas. So the area of all nodes relative to the area of all instances is the
/// expected number of nodes that a random line visits for each instance that it visits. Unlike a
/// cost relative to the area of the root, it does not decrease when an instance moves far away.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CostRatio {
    built: f64,
    now: f64,
}

impl CostRatio {
    /// For the nodes of a top level that has just been built.
    pub(super) fn of_new(lines: &[CacheLine]) -> CostRatio {
        let cost = cost(lines);
        CostRatio { built: cost, now: cost }
    }

    /// After the boxes of the nodes have been computed again.
    pub(super) fn update(&mut self, lines: &[CacheLine]) {
        self.now = cost(lines);
    }

    /// The cost now relative to that when the BVH was built. It is 1 where there is only one node,
    /// or none.
    pub(super) fn ratio(&self) -> f64 {
        let ratio = self.now / self.built;
        if ratio.is_nan() { 1.0 } else { ratio }
    }
}

/// The area of all nodes except the root, relative to the area of all instances.
fn cost(lines: &[CacheLine]) -> f64 {
    let (mut nodes, mut instances) = (0.0, 0.0);
    for lines in lines.chunks_exact(NODE_LINES) {
        let node = node(lines);
        for slot in 0..used(node) {
            let area = slot_bounds(node, slot).area();
            *(if node.child[slot] & INSTANCE == 0 { &mut nodes } else { &mut instances }) += area;
        }
    }
    nodes / instances
}
