//! Triangle leaves whose coordinates are steps of a [`super::Grid`]. Specification: "Grids".

use super::assert_layout::assert_layout;
use super::bvh::WIDTH;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Bytes of half a [`super::CacheLine`]: the unit in which leaves on a grid are addressed.
pub const HALF_LINE: usize = 32;

/// An [`super::IndexedLeaf`] of 16-bit coordinates: 4 half lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct IndexedLeaf16 {
    /// `[axis][vertex]`: steps from the grid's origin; unused slots repeat vertex 0.
    pub vertex: [[u16; WIDTH]; 3],
    /// `[corner][i]`: vertices of triangles i (low four bits) and i + 8 (high four bits); unused
    /// slots are 0.
    pub corner: [[u8; WIDTH / 2]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u8,
    /// Number of vertices, 1 to 16.
    pub vertices: u8,
    /// Zero.
    pub reserved: u16,
}

/// An [`super::IndexedLeaf`] of 21-bit coordinates: 5 half lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct IndexedLeaf21 {
    /// `[axis][vertex]`: the low 16 bits, as in [`IndexedLeaf16`].
    pub vertex: [[u16; WIDTH]; 3],
    /// The high five bits of x in bits 0 to 4, of y in bits 5 to 9, of z in bits 10 to 14; bit 15
    /// is zero.
    pub high: [u16; WIDTH],
    /// Vertices of the triangles, as in [`IndexedLeaf16`].
    pub corner: [[u8; WIDTH / 2]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u8,
    /// Number of vertices, 1 to 16.
    pub vertices: u8,
    /// Zero.
    pub reserved: u16,
}

/// A [`super::RawLeaf`] of 16-bit coordinates: 10 half lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct RawLeaf16 {
    /// `[corner][axis][triangle]`: steps from the grid's origin; unused slots repeat triangle 0.
    pub corner: [[[u16; WIDTH]; 3]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u32,
    /// Zero.
    pub reserved: [u32; 6],
}

/// A [`super::RawLeaf`] of 21-bit coordinates: 13 half lines.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct RawLeaf21 {
    /// `[corner][axis][triangle]`: the low 16 bits, as in [`RawLeaf16`].
    pub corner: [[[u16; WIDTH]; 3]; 3],
    /// `[corner][triangle]`: the high bits, as in [`IndexedLeaf21`].
    pub high: [[u16; WIDTH]; 3],
    /// Row of `TRIANGLE_IDS` of the first triangle; the others follow.
    pub first: u32,
    /// Number of triangles, 1 to 16.
    pub triangles: u32,
    /// Zero.
    pub reserved: [u32; 6],
}

assert_layout! {
    IndexedLeaf16 128 { corner 96, first 120, triangles 124, vertices 125, reserved 126 }
    IndexedLeaf21 160 { high 96, corner 128, first 152, triangles 156, vertices 157, reserved 158 }
    RawLeaf16 320 { first 288, triangles 292, reserved 296 }
    RawLeaf21 416 { high 288, first 384, triangles 388, reserved 392 }
}
