//! The wide BVH: nodes and triangle leaves, in lines of 64 bytes.

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// 64 bytes: the unit in which nodes and leaves are addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C, align(64))]
pub struct Line(pub [u32; 16]);

/// Where a child code leads. Codes are `u32`: bit 31 set for leaves, bits 30..29
/// the kind of leaf, the rest an index; `NONE` is an empty slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Line of a [`WideNode`].
    Node(u32),
    /// Line of a [`PackedNode`].
    Packed(u32),
    /// Line of an [`IndexedLeaf`]; on a grid the half line of an [`super::IndexedLeaf16`] or [`super::IndexedLeaf21`].
    Indexed(u32),
    /// Line of a [`RawLeaf`]; on a grid the half line of a [`super::RawLeaf16`] or [`super::RawLeaf21`].
    Raw(u32),
    /// Row of `TET_LEAVES`.
    Tets(u32),
}

impl Child {
    /// Set in the codes of leaves.
    pub const LEAF_BIT: u32 = 1 << 31;
    /// Of nodes, set in the codes of packed ones.
    pub const PACKED_BIT: u32 = 1 << 29;
    /// Indices are below this.
    pub const INDEX_LIMIT: u32 = 1 << 29;

    /// The code of this child.
    pub const fn code(self) -> u32 {
        match self {
            Child::Node(i) => i,
            Child::Packed(i) => Self::PACKED_BIT | i,
            Child::Indexed(i) => Self::LEAF_BIT | i,
            Child::Raw(i) => Self::LEAF_BIT | (1 << 29) | i,
            Child::Tets(i) => Self::LEAF_BIT | (2 << 29) | i,
        }
    }
    /// The child that a code stands for; `None` for `NONE` and unassigned codes.
    #[inline(always)]
    pub const fn from_code(code: u32) -> Option<Self> {
        let index = code & (Self::INDEX_LIMIT - 1);
        match code >> 29 {
            0 => Some(Child::Node(index)),
            1 => Some(Child::Packed(index)),
            4 => Some(Child::Indexed(index)),
            5 => Some(Child::Raw(index)),
            6 => Some(Child::Tets(index)),
            _ => None,
        }
    }
}

/// Children of a wide node, triangles and vertices of a leaf: at most 16.
pub const WIDTH: usize = 16;

/// Inner node of the wide BVH: 7 lines. Slots are filled from 0; an empty slot has
/// lower = `f32::MAX`, upper = `-f32::MAX` and child `NONE`.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct WideNode {
    /// Per axis: lower ends, then upper ends of the children's boxes, object space.
    pub bounds: [[[f32; WIDTH]; 2]; 3],
    /// Child codes; those of nodes and triangle leaves exceed the own line.
    pub child: [u32; WIDTH],
}

/// A [`WideNode`] with boxes of bytes: 3 lines. An end is `origin + step * byte`, which takes no rounding: steps are powers
/// of two, the origin is a multiple of the step, and no multiple exceeds 2^24. An empty slot has lower = 255, upper = 0.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct PackedNode {
    /// As in [`WideNode`], in steps.
    pub bounds: [[[u8; WIDTH]; 2]; 3],
    /// As in [`WideNode`].
    pub child: [u32; WIDTH],
    /// Least point, object space.
    pub origin: [f32; 3],
    /// Between neighbouring points, per axis.
    pub step: [f32; 3],
    /// Zero.
    pub reserved: [u32; 2],
}

/// Triangle leaf with shared vertices: 4 lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct IndexedLeaf {
    /// x, y and z rows; unused slots repeat vertex 0.
    pub vertex: [[f32; WIDTH]; 3],
    /// First, second and third vertex of each triangle, in source orientation; unused slots 0.
    pub corner: [[u8; WIDTH]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle.
    pub first: u32,
    /// Triangles, 1 to 16.
    pub triangles: u32,
    /// Vertices in use, 1 to 16.
    pub vertices: u32,
    /// Zero.
    pub reserved: u32,
}

/// Triangle leaf without sharing: 10 lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct RawLeaf {
    /// `[corner][axis][triangle]`; unused slots repeat triangle 0.
    pub corner: [[[f32; WIDTH]; 3]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle.
    pub first: u32,
    /// Triangles, 1 to 16.
    pub triangles: u32,
    /// Zero.
    pub reserved: [u32; 14],
}

impl IndexedLeaf {
    /// Corners of the triangle in a slot. Panics where a corner is no vertex; after [`crate::check::object`] all are.
    pub(crate) fn triangle(&self, slot: usize) -> [[f32; 3]; 3] {
        self.corner.map(|vertices| self.vertex.map(|row| row[vertices[slot] as usize]))
    }
}

impl RawLeaf {
    /// Corners of the triangle in a slot.
    pub(crate) fn triangle(&self, slot: usize) -> [[f32; 3]; 3] {
        self.corner.map(|rows| rows.map(|row| row[slot]))
    }
}

/// Lines that a [`WideNode`] takes.
pub const NODE_LINES: usize = size_of::<WideNode>() / 64;
/// Lines that a [`PackedNode`] takes.
pub const PACKED_NODE_LINES: usize = size_of::<PackedNode>() / 64;
/// Lines that an [`IndexedLeaf`] takes.
pub const INDEXED_LINES: usize = size_of::<IndexedLeaf>() / 64;
/// Lines that a [`RawLeaf`] takes.
pub const RAW_LINES: usize = size_of::<RawLeaf>() / 64;

assert_layout! {
    Line 64 {}
    WideNode 448 { child 384 }
    PackedNode 192 { child 96, origin 160, step 172, reserved 184 }
    IndexedLeaf 256 { corner 192, first 240, triangles 244, vertices 248 }
    RawLeaf 640 { first 576, triangles 580 }
}
