//! Which nodes an object has: kernels are made for each kind, as even a branch that always goes the same way costs some per cent.

use crate::simd::Simd;
use crate::trace::slabs::Boxes;
use bth_format::Room;
use bth_format::layout::{
    Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, PACKED_NODE_LINES, PackedNode, WIDTH, WideNode,
};
use bth_format::object::{Ground, ObjectView};

/// A kind of nodes.
pub(crate) trait Nodes: Copy {
    /// A node.
    type Node<'a>: Boxes;
    /// Cache lines of one.
    const LINES: usize;
    /// The node that the code of a child leads to.
    fn node(ground: Ground<'_>, code: u32) -> Self::Node<'_>;
}

/// All nodes are [`WideNode`]s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide;

/// All nodes are [`PackedNode`]s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packed;

/// Nodes of either kind, told apart by their codes: for plain code, where a branch a node costs nothing in comparison.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnyKind;

/// A node of [`AnyKind`].
pub(crate) enum WideOrPacked<'a> {
    Wide(&'a WideNode),
    Packed(&'a PackedNode),
}

impl Nodes for Wide {
    type Node<'a> = &'a WideNode;
    const LINES: usize = NODE_LINES;
    #[inline(always)]
    fn node(ground: Ground<'_>, code: u32) -> &WideNode {
        ground.node(code)
    }
}

impl Nodes for Packed {
    type Node<'a> = &'a PackedNode;
    const LINES: usize = PACKED_NODE_LINES;
    #[inline(always)]
    fn node(ground: Ground<'_>, code: u32) -> &PackedNode {
        ground.packed_node(code & !Child::PACKED_BIT)
    }
}

impl Nodes for AnyKind {
    type Node<'a> = WideOrPacked<'a>;
    const LINES: usize = NODE_LINES;
    #[inline(always)]
    fn node(ground: Ground<'_>, code: u32) -> WideOrPacked<'_> {
        if code & Child::PACKED_BIT == 0 {
            WideOrPacked::Wide(Wide::node(ground, code))
        } else {
            WideOrPacked::Packed(Packed::node(ground, code))
        }
    }
}

impl Boxes for WideOrPacked<'_> {
    #[inline(always)]
    fn ends<S: Simd>(&self, s: S, axis: usize, at: u32) -> S::F {
        match self {
            WideOrPacked::Wide(node) => node.ends(s, axis, at),
            WideOrPacked::Packed(node) => node.ends(s, axis, at),
        }
    }
    #[inline(always)]
    fn child(&self) -> &[u32; WIDTH] {
        match self {
            WideOrPacked::Wide(node) => &node.child,
            WideOrPacked::Packed(node) => &node.child,
        }
    }
}

/// The indexed leaf that a code leads to, if it is one: as it is stored or, where coordinates lie on a grid, unpacked.
#[inline(always)]
pub(crate) fn indexed_leaf<'r>(
    object: &'r ObjectView<'_>,
    ground: Ground<'r>,
    code: u32,
    unpacked: &'r mut Option<Room<IndexedLeaf>>,
) -> Option<&'r IndexedLeaf> {
    match (ground.indexed_leaf(code), Child::from_code(code)) {
        (Some(leaf), _) => Some(leaf),
        (None, Some(Child::Indexed(index))) => Some(object.indexed(index, unpacked)),
        _ => None,
    }
}

/// Asks for the lines of a node or of an indexed leaf.
#[inline(always)]
pub(crate) fn prefetch<S: Simd, N: Nodes>(s: S, _nodes: N, ground: Ground<'_>, code: u32) {
    let first = ground.place(code);
    for i in 0..N::LINES.max(INDEXED_LINES) {
        s.prefetch(first.wrapping_add(i));
    }
}
