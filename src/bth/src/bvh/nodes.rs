//! Nodes and leaves by child code, in each of their formats. Kernels read [`WideNode`]s and leaves of f32; parts that are called unpack
//! the others. The steps through inner nodes that decide the speed of rays are compiled for each format of nodes ([`Nodes`]), because
//! even a well predicted branch in every step costs some per cent.

use crate::intersect::boxes::{ChildBoxes, FAR};
use crate::simd::{CacheLevel, Part, Simd};
use bth_format::layout::{
    Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, PackedNode, RawLeaf, WIDTH, WideNode,
};
use bth_format::object::Unpacked;
use bth_format::object::{NodeBase, ObjectView};

/// A node format.
pub(crate) trait Nodes {
    /// Record of a node.
    type Node: ChildBoxes;
    /// The node with this child code, which must be of the format.
    fn node(node_base: NodeBase<'_>, code: u32) -> &Self::Node;
    /// As [`Self::node`]; for [`Wide`] `None` for nodes of the other format.
    fn node_if(node_base: NodeBase<'_>, code: u32) -> Option<&Self::Node>;
}

/// [`WideNode`]s.
pub(crate) struct Wide;

/// [`PackedNode`]s.
pub(crate) struct Packed;

impl Nodes for Wide {
    type Node = WideNode;
    #[inline(always)]
    fn node(node_base: NodeBase<'_>, code: u32) -> &WideNode {
        node_base.node(code)
    }
    #[inline(always)]
    fn node_if(node_base: NodeBase<'_>, code: u32) -> Option<&WideNode> {
        node_base.wide_node(code)
    }
}

impl Nodes for Packed {
    type Node = PackedNode;
    #[inline(always)]
    fn node(node_base: NodeBase<'_>, code: u32) -> &PackedNode {
        node_base.packed_node(code & !Child::PACKED_BIT)
    }
    #[inline(always)]
    fn node_if(node_base: NodeBase<'_>, code: u32) -> Option<&PackedNode> {
        Some(Self::node(node_base, code))
    }
}

/// Memory for a node that is unpacked, on cache lines.
#[repr(C, align(64))]
pub(crate) struct UnpackedNode(Option<WideNode>);

impl UnpackedNode {
    pub(crate) const NONE: UnpackedNode = UnpackedNode(None);
}

/// Unpacking of the node with a child code, as a part of kernels: one function serves all kernels of an instruction set.
struct UnpackNode<'r, 'o>(NodeBase<'o>, u32, &'r mut UnpackedNode);

impl<'r, S: Simd> Part<S> for UnpackNode<'r, '_> {
    type Output = &'r WideNode;
    #[inline(always)]
    fn run(self, s: S) -> &'r WideNode {
        const ZERO: WideNode = WideNode { bounds: [[[0.0; WIDTH]; 2]; 3], child: [0; WIDTH] };
        let UnpackNode(node_base, code, unpacked) = self;
        assert!(code & Child::PACKED_BIT != 0, "a node lies outside of the object's lines");
        let packed = Packed::node(node_base, code);
        let node = unpacked.0.get_or_insert(ZERO);
        for axis in 0..3 {
            for side in 0..2 {
                s.store(packed.planes(s, axis, side as u32 * FAR), &mut node.bounds[axis][side]);
            }
        }
        node.child = packed.child;
        node
    }
}

/// The inner node with this child code: in place or, if it is packed, unpacked into `unpacked`.
#[inline(always)]
pub(crate) fn node<'r, S: Simd>(
    s: S,
    node_base: NodeBase<'r>,
    code: u32,
    unpacked: &'r mut UnpackedNode,
) -> &'r WideNode {
    match node_base.wide_node(code) {
        Some(node) => node,
        None => s.call(UnpackNode(node_base, code, unpacked)),
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
    if let Some(leaf) = node_base.indexed_leaf(code) {
        return Some(leaf);
    }
    match Child::from_code(code) {
        Some(Child::Indexed(index)) => Some(indexed(s, object, index, unpacked)),
        _ => None,
    }
}

/// Whether nodes and leaves of an object take at least 64 MiB, more than most caches. A model of 23 MiB, of which rays visit a small part, would be slower.
#[inline(always)]
pub(crate) fn is_large(object: &ObjectView<'_>) -> bool {
    const LINES: usize = 1 << 20;
    object.lines.len() >= LINES
}

/// Cache lines of the larger of a node and an indexed leaf.
const LINES: usize = if NODE_LINES > INDEXED_LINES { NODE_LINES } else { INDEXED_LINES };

/// Prefetches the cache lines of a node or of an indexed leaf that is needed soon.
#[inline(always)]
pub(crate) fn prefetch<S: Simd>(s: S, node_base: NodeBase<'_>, code: u32) {
    let first = node_base.block_address(code);
    for i in 0..LINES {
        s.prefetch(first.wrapping_add(i));
    }
}

/// As [`prefetch`], for a node or leaf that is needed only after many other steps.
#[inline(always)]
pub(crate) fn prefetch_into<S: Simd>(s: S, level: CacheLevel, node_base: NodeBase<'_>, code: u32) {
    s.prefetch_into::<LINES, _>(level, node_base.block_address(code));
}
