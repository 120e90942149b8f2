//! Leaves by child code, in each of their formats. Kernels read leaves of f32. Parts that they call
//! unpack the others.

use crate::intersect::filter::TriangleBlock;
use crate::intersect::point_lanes::CornerLanes;
use crate::simd::{CacheLevel, Part, Simd};
use bth_format::layout::{Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, RawLeaf};
use bth_format::object::Unpacked;
use bth_format::object::{NodeBase, ObjectView};

/// Unpacking of the leaf on a grid at an index of a child code, as a part of kernels: it is long,
/// and rarely needed.
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

/// The indexed leaf at an index of a child code: in place or, for objects with coordinates on a
/// grid, unpacked into `unpacked`.
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

/// A visitor of what a child code leads to if that is not a node.
pub(crate) trait LeafVisitor<S: Simd>: Sized {
    type Output;
    /// Visits a leaf of triangles, in either record format.
    fn triangles<B: TriangleBlock + CornerLanes>(self, s: S, block: &B) -> Self::Output;
    /// Visits the tet leaf with this row.
    fn tets(self, s: S, row: u32) -> Self::Output;
    /// Visits nothing: the code belongs to an empty slot, a node or an unchecked file.
    fn nothing(self) -> Self::Output;
}

/// Passes the leaf with a child code to a visitor. Leaves on a grid are unpacked.
#[inline(always)]
pub(crate) fn visit_leaf<S: Simd, V: LeafVisitor<S>>(
    s: S,
    object: &ObjectView<'_>,
    node_base: NodeBase<'_>,
    code: u32,
    visitor: V,
) -> V::Output {
    let (mut unpacked, mut unpacked_raw) = (None, None);
    if let Some(leaf) = indexed_leaf(s, object, node_base, code, &mut unpacked) {
        return visitor.triangles(s, leaf);
    }
    match Child::from_code(code) {
        Some(Child::Raw(at)) => visitor.triangles(s, raw(s, object, at, &mut unpacked_raw)),
        Some(Child::Tets(row)) => visitor.tets(s, row),
        _ => visitor.nothing(),
    }
}

/// Returns true if nodes and leaves of an object take at least 64 MiB, more than most caches. Rays
/// that visit a small part of a model of 23 MiB would be slower.
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

/// Prefetches a node or leaf that is needed only after many other steps.
#[inline(always)]
pub(crate) fn prefetch_into<S: Simd>(s: S, level: CacheLevel, node_base: NodeBase<'_>, code: u32) {
    s.prefetch_into::<LINES, _>(level, node_base.block_address(code));
}
