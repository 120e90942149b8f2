//! Leaves by child code, in each of their formats. Kernels read leaves of f32. Parts that they call
//! unpack the others.

use crate::intersect::filter::TriangleBlock;
use crate::shortcuts::{self, SpecialLeaf};
use crate::simd::{CacheLevel, Part, Scalar, Simd};
use bth_format::layout::{Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, RAW_LINES, RawLeaf};
use bth_format::object::{NodeBase, ObjectView, Unpacked};

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

/// What the child code of a leaf leads to.
#[derive(Clone, Copy)]
pub(crate) enum Leaf<'r> {
    /// A leaf whose triangles refer to vertices by index.
    Indexed(&'r IndexedLeaf),
    /// A leaf with the coordinates of each corner.
    Raw(&'r RawLeaf),
    /// A leaf that holds no block of triangles.
    Special(SpecialLeaf),
    /// No leaf: an empty slot, a node, or a code of a file that was not checked.
    None,
}

/// Memory of an unpacked leaf.
#[derive(Default)]
pub(crate) struct LeafMemory {
    indexed: Option<Unpacked<IndexedLeaf>>,
    raw: Option<Unpacked<RawLeaf>>,
}

/// The leaf with this child code: in place or, for objects with coordinates on a grid, unpacked
/// into `memory`.
#[inline(always)]
pub(crate) fn leaf<'r, S: Simd>(
    s: S,
    object: &'r ObjectView<'_>,
    node_base: NodeBase<'r>,
    code: u32,
    memory: &'r mut LeafMemory,
) -> Leaf<'r> {
    if let Some(leaf) = indexed_leaf(s, object, node_base, code, &mut memory.indexed) {
        return Leaf::Indexed(leaf);
    }
    match Child::from_code(code) {
        Some(Child::Raw(index)) => Leaf::Raw(raw(s, object, index, &mut memory.raw)),
        child => child.and_then(shortcuts::special).map_or(Leaf::None, Leaf::Special),
    }
}

/// The index in the object's leaf order of a triangle of the leaf with this child code, and its
/// corners. `None` for special leaves, and if there is no such leaf.
#[inline(always)]
pub(crate) fn triangle(object: &ObjectView<'_>, code: u32, triangle: u32) -> Option<(u32, [[f32; 3]; 3])> {
    let at = triangle as usize;
    match leaf(Scalar, object, object.node_base(), code, &mut LeafMemory::default()) {
        Leaf::Indexed(leaf) => Some((leaf.first + triangle, leaf.corners(at))),
        Leaf::Raw(leaf) => Some((leaf.first + triangle, leaf.corners(at))),
        Leaf::Special(_) | Leaf::None => None,
    }
}

/// The lines and the rows of LEAF_VERTICES of the leaf with this child code, in a deformable
/// object: one row for an indexed leaf, three for a raw one. `None` for codes of nodes.
#[inline(always)]
pub(crate) fn leaf_size(code: u32) -> Option<(u32, u32)> {
    match Child::from_code(code) {
        Some(Child::Indexed(_)) => Some((INDEXED_LINES as u32, 1)),
        Some(Child::Raw(_)) => Some((RAW_LINES as u32, 3)),
        _ => None,
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
