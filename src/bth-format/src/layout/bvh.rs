//! The wide BVH: nodes and triangle leaves, in lines of 64 bytes. Specification: "Child codes" to
//! "RawLeaf".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// 64 bytes: the unit in which nodes and leaves are addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C, align(64))]
pub struct CacheLine(pub [u32; 16]);

/// What a child code leads to. Codes are `u32`: bits 31 to 29 are the kind of child, with bit 31
/// set for leaves; bits 28 to 0 are an index. [`super::NONE`] is an empty slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Line of a [`WideNode`].
    Node(u32),
    /// Line of an [`IndexedLeaf`]; on a grid the half line of an [`super::IndexedLeaf16`] or
    /// [`super::IndexedLeaf21`].
    Indexed(u32),
    /// Line of a [`RawLeaf`]; on a grid the half line of a [`super::RawLeaf16`] or
    /// [`super::RawLeaf21`].
    Raw(u32),
    /// Row of `TET_LEAVES`.
    Tets(u32),
}

impl Child {
    /// Set in the codes of leaves.
    pub const LEAF_BIT: u32 = 1 << 31;
    /// Indices are below this.
    pub const INDEX_LIMIT: u32 = 1 << 29;

    /// The code of this child.
    pub const fn code(self) -> u32 {
        match self {
            Child::Node(i) => i,
            Child::Indexed(i) => Self::LEAF_BIT | i,
            Child::Raw(i) => Self::LEAF_BIT | (1 << 29) | i,
            Child::Tets(i) => Self::LEAF_BIT | (2 << 29) | i,
        }
    }
    /// The child that a code leads to; `None` for [`super::NONE`] and codes of no assigned kind.
    #[inline(always)]
    pub const fn from_code(code: u32) -> Option<Self> {
        let index = code & (Self::INDEX_LIMIT - 1);
        match code >> 29 {
            0 => Some(Child::Node(index)),
            4 => Some(Child::Indexed(index)),
            5 => Some(Child::Raw(index)),
            6 => Some(Child::Tets(index)),
            _ => None,
        }
    }
}

/// Slots of a node for children, and of a leaf for triangles and for vertices.
pub const WIDTH: usize = 16;

/// Inner node of the wide BVH: 7 lines. Used slots come first; an empty slot has lower ends of
/// `f32::MAX`, upper ends of `-f32::MAX` and child [`super::NONE`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct WideNode {
    /// `[axis][lower, upper][slot]`: the children's boxes, object space.
    pub bounds: [[[f32; WIDTH]; 2]; 3],
    /// Child codes. Nodes and triangle leaves lie behind the node that refers to them.
    pub child: [u32; WIDTH],
}

/// Triangle leaf whose triangles share vertices: 4 lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct IndexedLeaf {
    /// `[axis][vertex]`, object space; unused slots repeat vertex 0.
    pub vertex: [[f32; WIDTH]; 3],
    /// `[corner][triangle]`: vertices of each triangle, in the order of the source; unused slots
    /// are 0.
    pub corner: [[u8; WIDTH]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u32,
    /// Number of vertices, 1 to 16.
    pub vertices: u32,
    /// Zero.
    pub reserved: u32,
}

/// Triangle leaf with three separate corners for each triangle: 10 lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct RawLeaf {
    /// `[corner][axis][triangle]`, object space; unused slots repeat triangle 0.
    pub corner: [[[f32; WIDTH]; 3]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u32,
    /// Zero.
    pub reserved: [u32; 14],
}

impl IndexedLeaf {
    /// Corners of the triangle in a slot. Slots and vertices are taken modulo [`WIDTH`]: an
    /// unchecked file may hold larger ones.
    pub(crate) fn triangle(&self, slot: usize) -> [[f32; 3]; 3] {
        let vertex = self.corner.map(|vertices| vertices[slot % WIDTH] as usize % WIDTH);
        vertex.map(|vertex| self.vertex.map(|row| row[vertex]))
    }
}

impl RawLeaf {
    /// Corners of the triangle in a slot, which is taken modulo [`WIDTH`].
    pub(crate) fn triangle(&self, slot: usize) -> [[f32; 3]; 3] {
        self.corner.map(|rows| rows.map(|row| row[slot % WIDTH]))
    }
}

/// Lines that a [`WideNode`] takes.
pub const NODE_LINES: usize = size_of::<WideNode>() / 64;
/// Lines that an [`IndexedLeaf`] takes.
pub const INDEXED_LINES: usize = size_of::<IndexedLeaf>() / 64;
/// Lines that a [`RawLeaf`] takes.
pub const RAW_LINES: usize = size_of::<RawLeaf>() / 64;

assert_layout! {
    CacheLine 64 {}
    WideNode 448 { child 384 }
    IndexedLeaf 256 { corner 192, first 240, triangles 244, vertices 248 }
    RawLeaf 640 { first 576, triangles 580 }
}
