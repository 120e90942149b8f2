//! Triangle leaves on a grid as leaves of `f32`, exactly: what traces, checks and verifies leaves sees these only.
// Iterators and closures would be compiled without the vectors that tracing has.
#![allow(clippy::needless_range_loop)]

use crate::layout::*;
use crate::object::ObjectView;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Room for a leaf, where vectors are read best.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Room<T>(T);

/// Vertices of triangles from two in a byte.
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
    /// The same leaf of `f32`.
    #[inline(always)]
    pub fn unpacked(&self, grid: &Grid) -> IndexedLeaf {
        let [x, y, z] = &self.vertex;
        IndexedLeaf {
            vertex: [grid.row(0, x), grid.row(1, y), grid.row(2, z)],
            corner: corners(&self.corner),
            first: self.first,
            triangles: self.triangles.into(),
            vertices: self.vertices.into(),
            reserved: self.reserved.into(),
        }
    }
}

impl IndexedLeaf21 {
    /// The same leaf of `f32`.
    #[inline(always)]
    pub fn unpacked(&self, grid: &Grid) -> IndexedLeaf {
        let ([x, y, z], high) = (&self.vertex, &self.high);
        IndexedLeaf {
            vertex: [grid.row_of_21(0, x, high), grid.row_of_21(1, y, high), grid.row_of_21(2, z, high)],
            corner: corners(&self.corner),
            first: self.first,
            triangles: self.triangles.into(),
            vertices: self.vertices.into(),
            reserved: self.reserved.into(),
        }
    }
}

impl RawLeaf16 {
    /// The same leaf of `f32`.
    #[inline(always)]
    pub fn unpacked(&self, grid: &Grid) -> RawLeaf {
        let mut corner = [[[0.0; WIDTH]; 3]; 3];
        for c in 0..3 {
            for axis in 0..3 {
                corner[c][axis] = grid.row(axis, &self.corner[c][axis]);
            }
        }
        RawLeaf { corner, first: self.first, triangles: self.triangles, reserved: widened(self.reserved) }
    }
}

impl RawLeaf21 {
    /// The same leaf of `f32`.
    #[inline(always)]
    pub fn unpacked(&self, grid: &Grid) -> RawLeaf {
        let mut corner = [[[0.0; WIDTH]; 3]; 3];
        for c in 0..3 {
            for axis in 0..3 {
                corner[c][axis] = grid.row_of_21(axis, &self.corner[c][axis], &self.high[c]);
            }
        }
        RawLeaf { corner, first: self.first, triangles: self.triangles, reserved: widened(self.reserved) }
    }
}

/// Reserved fields keep what is not zero, for the check.
#[inline(always)]
fn widened(reserved: [u32; 6]) -> [u32; 14] {
    let mut out = [0; 14];
    out[..6].copy_from_slice(&reserved);
    out
}

impl PackedNode {
    /// An end of a box.
    #[inline(always)]
    pub fn end(&self, axis: usize, upper: usize, slot: usize) -> f32 {
        self.origin[axis] + self.step[axis] * f32::from(self.bounds[axis][upper][slot])
    }

    /// The same node of `f32`.
    pub fn unpacked(&self) -> WideNode {
        let mut bounds = [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3];
        for slot in 0..WIDTH {
            let ends = self.bounds.map(|ends| ends.map(|row| row[slot]));
            if self.child[slot] == NONE && ends == [[255, 0]; 3] {
                continue;
            }
            for axis in 0..3 {
                bounds[axis][0][slot] = self.end(axis, 0, slot);
                bounds[axis][1][slot] = self.end(axis, 1, slot);
            }
        }
        WideNode { bounds, child: self.child }
    }

    /// Whether every end that a byte can stand for is an `f32`.
    pub fn is_exact(&self) -> bool {
        (0..3).all(|axis| is_exact(self.origin[axis], self.step[axis], 255))
    }
}

impl<'a> ObjectView<'a> {
    /// The node that a child leads to, unpacked if it is packed.
    pub fn unpacked_node(&self, child: Child) -> Option<WideNode> {
        match child {
            Child::Node(line) => Some(*self.node(line)),
            Child::Packed(line) => Some(self.packed_node(line).unpacked()),
            Child::Indexed(_) | Child::Raw(_) | Child::Tets(_) => None,
        }
    }

    /// A leaf on the grid, at a half line.
    #[inline(always)]
    fn packed<T: FromBytes + KnownLayout + Immutable>(&self, half_line: u32) -> &'a T {
        let bytes = &self.lines.as_bytes()[half_line as usize * HALF_LINE..][..size_of::<T>()];
        T::ref_from_bytes(bytes).expect("half lines are aligned for every leaf")
    }

    /// The indexed leaf at an index of a child code: as it is stored, or unpacked into `room`. Panics when the lines
    /// end before the leaf does; checked files never do.
    #[inline(always)]
    pub fn indexed<'r>(&self, index: u32, room: &'r mut Option<Room<IndexedLeaf>>) -> &'r IndexedLeaf
    where
        'a: 'r,
    {
        let Some(grid) = &self.grid else { return self.indexed_leaf(index) };
        &room.insert(Room(self.unpacked_indexed(grid, index))).0
    }

    /// The raw leaf at an index of a child code; as [`Self::indexed`].
    #[inline(always)]
    pub fn raw<'r>(&self, index: u32, room: &'r mut Option<Room<RawLeaf>>) -> &'r RawLeaf
    where
        'a: 'r,
    {
        let Some(grid) = &self.grid else { return self.raw_leaf(index) };
        &room.insert(Room(self.unpacked_raw(grid, index))).0
    }

    #[inline(always)]
    fn unpacked_indexed(&self, grid: &Grid, at: u32) -> IndexedLeaf {
        match grid.bits {
            GridBits::B16 => self.packed::<IndexedLeaf16>(at).unpacked(grid),
            GridBits::B21 => self.packed::<IndexedLeaf21>(at).unpacked(grid),
        }
    }

    #[inline(always)]
    fn unpacked_raw(&self, grid: &Grid, at: u32) -> RawLeaf {
        match grid.bits {
            GridBits::B16 => self.packed::<RawLeaf16>(at).unpacked(grid),
            GridBits::B21 => self.packed::<RawLeaf21>(at).unpacked(grid),
        }
    }

    /// Half lines of the block that a child leads to: the first, and how many; none of a tet leaf.
    pub fn half_lines(&self, child: Child) -> Option<(u64, usize)> {
        let [indexed, raw] = match &self.grid {
            Some(grid) => grid.bits.half_lines(),
            None => [2 * INDEXED_LINES, 2 * RAW_LINES],
        };
        let leaf = |index: u32| if self.grid.is_some() { u64::from(index) } else { 2 * u64::from(index) };
        match child {
            Child::Node(line) => Some((2 * u64::from(line), 2 * NODE_LINES)),
            Child::Packed(line) => Some((2 * u64::from(line), 2 * PACKED_NODE_LINES)),
            Child::Indexed(index) => Some((leaf(index), indexed)),
            Child::Raw(index) => Some((leaf(index), raw)),
            Child::Tets(_) => None,
        }
    }

    /// Bits of a leaf that mean nothing and that an unpacked leaf does not show.
    pub(crate) fn unused_bits(&self, child: Child) -> u16 {
        let unused = |rows: &[[u16; WIDTH]]| rows.iter().flatten().fold(0, |all, high| all | high & 1 << 15);
        match (child, self.grid.map(|grid| grid.bits)) {
            (Child::Indexed(at), Some(GridBits::B21)) => unused(&[self.packed::<IndexedLeaf21>(at).high]),
            (Child::Raw(at), Some(GridBits::B21)) => unused(&self.packed::<RawLeaf21>(at).high),
            _ => 0,
        }
    }
}
