//! The two node formats of objects. Kernels are compiled for each, because even a well predicted branch in every step costs some
//! per cent.

use crate::intersect::boxes::ChildBoxes;
use crate::simd::{Part, Simd};
use bth_format::layout::{
    Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, PACKED_NODE_LINES, PackedNode, RawLeaf, WideNode,
};
use bth_format::object::Unpacked;
use bth_format::object::{NodeBase, ObjectView};

/// A node format.
pub(crate) trait Nodes: Copy {
    /// Record of a node.
    type Node: ChildBoxes;
    /// Cache lines of a node.
    const LINES: usize;
    /// The node with this child code.
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

/// Unpacking of the leaf on a grid at an index of a child code, as a part of kernels: it is long, and rarely needed.
struct Unpack<'r, 'o, T>(&'r ObjectView<'o>, u32, &'r mut Option<Unpacked<T>>);

impl<'r, S: Simd> Part<S> for Unpack<'r, '_, IndexedLeaf> {
    type Output = &'r IndexedLeaf;
    #[inline(always)]
    fn run(self, _: S) -> &'r IndexedLeaf {
        self.0.indexed(self.1, self.2)
    }
}

impl<'r, S: Simd> Part<S> for Unpack<'r, '_, RawLeaf> {
    type Output = &'r RawLeaf;
    #[inline(always)]
    fn run(self, _: S) -> &'r RawLeaf {
        self.0.raw(self.1, self.2)
    }
}

/// The indexed leaf at an index of a child code: in place or, for objects with coordinates on a grid, unpacked into `unpacked`.
#[inline(always)]
pub(crate) fn indexed<'r, S: Simd>(
    s: S,
    object: &'r ObjectView<'_>,
    index: u32,
    unpacked: &'r mut Option<Unpacked<IndexedLeaf>>,
) -> &'r IndexedLeaf {
    if object.grid.is_none() { object.indexed_leaf(index) } else { s.call(Unpack(object, index, unpacked)) }
}

/// The raw leaf at an index of a child code, as [`indexed`].
#[inline(always)]
pub(crate) fn raw<'r, S: Simd>(
    s: S,
    object: &'r ObjectView<'_>,
    index: u32,
    unpacked: &'r mut Option<Unpacked<RawLeaf>>,
) -> &'r RawLeaf {
    if object.grid.is_none() { object.raw_leaf(index) } else { s.call(Unpack(object, index, unpacked)) }
}

/// The leaf with this child code if it is an indexed leaf; as [`indexed`].
#[inline(always)]
pub(crate) fn indexed_leaf<'r, S: Simd>(
    s: S,
    object: &'r ObjectView<'_>,
    node_base: NodeBase<'r>,
    code: u32,
    unpacked: &'r mut Option<Unpacked<IndexedLeaf>>,
) -> Option<&'r IndexedLeaf> {
    match (node_base.indexed_leaf(code), Child::from_code(code)) {
        (Some(leaf), _) => Some(leaf),
        (None, Some(Child::Indexed(index))) => Some(indexed(s, object, index, unpacked)),
        _ => None,
    }
}

/// Prefetches the cache lines of a node or of an indexed leaf.
#[inline(always)]
pub(crate) fn prefetch<S: Simd, N: Nodes>(s: S, _nodes: N, node_base: NodeBase<'_>, code: u32) {
    let first = node_base.block_address(code);
    for i in 0..N::LINES.max(INDEXED_LINES) {
        s.prefetch(first.wrapping_add(i));
    }
}
