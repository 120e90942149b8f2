//! Leaves on a grid as their counterparts of `f32`, without rounding. Tracing, checking and
//! verifying read leaves in this form only.
// Counted loops over arrays: closures would be compiled without the vector instructions of the
// kernels that inline them.
#![allow(clippy::needless_range_loop)]

use crate::layout::*;

/// Vertex numbers of the corners of 16 triangles. Each byte holds two: triangle i the low half of
/// byte i, triangle i + 8 the high half.
#[inline(always)]
fn corners(packed: &[[u8; WIDTH / 2]; 3]) -> [[u8; WIDTH]; 3] {
    let mut out = [[0; WIDTH]; 3];
    for c in 0..3 {
        for i in 0..WIDTH / 2 {
            out[c][i] = packed[c][i] & 15;
            out[c][i + WIDTH / 2] = packed[c][i] >> 4;
        }
    }
    out
}

impl IndexedLeaf16 {
    /// The same leaf with coordinates of `f32`.
    #[inline(always)]
    pub(crate) fn unpacked(&self, grid: &Grid) -> IndexedLeaf {
        let [x, y, z] = &self.vertex;
        IndexedLeaf {
            vertex: [grid.row_16(0, x), grid.row_16(1, y), grid.row_16(2, z)],
            corner: corners(&self.corner),
            first: self.first,
            triangles: self.triangles.into(),
            vertices: self.vertices.into(),
            reserved: self.reserved.into(),
        }
    }
}

impl IndexedLeaf21 {
    /// The same leaf with coordinates of `f32`.
    #[inline(always)]
    pub(crate) fn unpacked(&self, grid: &Grid) -> IndexedLeaf {
        let ([x, y, z], high) = (&self.vertex, &self.high);
        IndexedLeaf {
            vertex: [grid.row_21(0, x, high), grid.row_21(1, y, high), grid.row_21(2, z, high)],
            corner: corners(&self.corner),
            first: self.first,
            triangles: self.triangles.into(),
            vertices: self.vertices.into(),
            reserved: self.reserved.into(),
        }
    }
}

impl RawLeaf16 {
    /// The same leaf with coordinates of `f32`.
    #[inline(always)]
    pub(crate) fn unpacked(&self, grid: &Grid) -> RawLeaf {
        let mut corner = [[[0.0; WIDTH]; 3]; 3];
        for c in 0..3 {
            for axis in 0..3 {
                corner[c][axis] = grid.row_16(axis, &self.corner[c][axis]);
            }
        }
        RawLeaf { corner, first: self.first, triangles: self.triangles, reserved: widened(self.reserved) }
    }
}

impl RawLeaf21 {
    /// The same leaf with coordinates of `f32`.
    #[inline(always)]
    pub(crate) fn unpacked(&self, grid: &Grid) -> RawLeaf {
        let mut corner = [[[0.0; WIDTH]; 3]; 3];
        for c in 0..3 {
            for axis in 0..3 {
                corner[c][axis] = grid.row_21(axis, &self.corner[c][axis], &self.high[c]);
            }
        }
        RawLeaf { corner, first: self.first, triangles: self.triangles, reserved: widened(self.reserved) }
    }
}

/// The reserved fields in the width of a leaf of `f32`: what is not zero stays, so that the check
/// finds it.
#[inline(always)]
fn widened(reserved: [u32; 6]) -> [u32; 14] {
    let mut out = [0; 14];
    out[..6].copy_from_slice(&reserved);
    out
}
