//! Which nodes an object has: kernels are made for each kind, as even a branch that always goes the same way costs some per cent.

use crate::intersect::boxes::ChildBoxes;
use crate::simd::Simd;
use bth_format::layout::{
    Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, PACKED_NODE_LINES, PackedNode, WideNode,
};
use bth_format::object::Unpacked;
use bth_format::object::{NodeBase, ObjectView};

/// A kind of nodes.
pub(crate) trait Nodes: Copy {
    /// A node.
    type Node: ChildBoxes;
    /// Cache lines of one.
    const LINES: usize;
    /// The node that the code of a child leads to.
    fn node(node_base: NodeBase<'_>, code: u32) -> &Self::Node;
}

/// All nodes are [`WideNode`]s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide;

/// All nodes are [`PackedNode`]s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packed;

impl Nodes for Wide {
    type Node = WideNode;
    const LINES: usize = NODE_LINES;
    #[inline(always)]
    fn node(node_base: NodeBase<'_>, code: u32) -> &WideNode {
        node_base.node(code)
    }
}

impl Nodes for Packed {
    type Node = PackedNode;
    const LINES: usize = PACKED_NODE_LINES;
    #[inline(always)]
    fn node(node_base: NodeBase<'_>, code: u32) -> &PackedNode {
        node_base.packed_node(code & !Child::PACKED_BIT)
    }
}

/// The indexed leaf that a code leads to, if it is one: as it is stored or, where coordinates lie on a grid, unpacked.
#[inline(always)]
pub(crate) fn indexed_leaf<'r>(
    object: &'r ObjectView<'_>,
    node_base: NodeBase<'r>,
    code: u32,
    unpacked: &'r mut Option<Unpacked<IndexedLeaf>>,
) -> Option<&'r IndexedLeaf> {
    match (node_base.indexed_leaf(code), Child::from_code(code)) {
        (Some(leaf), _) => Some(leaf),
        (None, Some(Child::Indexed(index))) => Some(object.indexed(index, unpacked)),
        _ => None,
    }
}

/// Asks for the lines of a node or of an indexed leaf.
#[inline(always)]
pub(crate) fn prefetch<S: Simd, N: Nodes>(s: S, _nodes: N, node_base: NodeBase<'_>, code: u32) {
    let first = node_base.block_address(code);
    for i in 0..N::LINES.max(INDEXED_LINES) {
        s.prefetch(first.wrapping_add(i));
    }
}
