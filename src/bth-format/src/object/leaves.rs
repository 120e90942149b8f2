//! Triangle leaves by child code, as leaves of `f32` whatever their coordinates are stored in, and
//! the blocks of codes.

use super::view::ObjectView;
use crate::layout::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A leaf on a grid unpacked to `f32`, aligned to lines as stored leaves are, for vector loads.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Unpacked<T>(T);

impl<'a> ObjectView<'a> {
    /// The indexed leaf at an index of a child code: the stored one where coordinates are `f32`,
    /// else the leaf unpacked into `scratch`. Panics when the lines end before the leaf does; after
    /// [`crate::File::check`] they never do.
    #[inline(always)]
    pub fn indexed<'s>(&self, index: u32, scratch: &'s mut Option<Unpacked<IndexedLeaf>>) -> &'s IndexedLeaf
    where
        'a: 's,
    {
        let Some(grid) = &self.grid else { return self.indexed_leaf(index) };
        &scratch.insert(Unpacked(self.unpacked_indexed(grid, index))).0
    }

    /// The raw leaf at an index of a child code; as [`Self::indexed`].
    #[inline(always)]
    pub fn raw<'s>(&self, index: u32, scratch: &'s mut Option<Unpacked<RawLeaf>>) -> &'s RawLeaf
    where
        'a: 's,
    {
        let Some(grid) = &self.grid else { return self.raw_leaf(index) };
        &scratch.insert(Unpacked(self.unpacked_raw(grid, index))).0
    }

    /// The corners of the triangle in a slot of a leaf, given as its child code; in a tet leaf
    /// `slot` is a row of TET_FACES. `None` if there is no such leaf.
    #[inline(never)]
    pub fn corners_in(&self, leaf: u32, slot: u32) -> Option<[[f32; 3]; 3]> {
        let (at, mut indexed, mut raw) = (slot as usize, None, None);
        match Child::from_code(leaf)? {
            Child::Indexed(index) => Some(self.indexed(index, &mut indexed).triangle(at)),
            Child::Raw(index) => Some(self.raw(index, &mut raw).triangle(at)),
            Child::Tets(_) => Some(self.face_corners(self.tet_faces.get(at)?)),
            Child::Node(_) => None,
        }
    }

    /// The corners of a constrained face.
    pub fn face_corners(&self, face: &TetFace) -> [[f32; 3]; 3] {
        face.vertex.map(|v| self.tet_vertices[v as usize].position)
    }

    /// The child code of the tet leaf without a subtree that holds a triangle, and its row of
    /// TET_FACES.
    #[cold]
    #[inline(never)]
    pub fn special_place(&self, triangle: u32) -> Option<(u32, u32)> {
        let face = *self.triangle_faces.get(triangle as usize)?;
        let leaf = self.tet_leaves.partition_point(|leaf| leaf.first_face <= face).checked_sub(1)?;
        (face != NONE).then(|| (Child::Tets(leaf as u32).code(), face))
    }

    #[inline(always)]
    fn unpacked_indexed(&self, grid: &Grid, half_line: u32) -> IndexedLeaf {
        match grid.bits {
            GridBits::B16 => self.grid_leaf::<IndexedLeaf16>(half_line).unpacked(grid),
            GridBits::B21 => self.grid_leaf::<IndexedLeaf21>(half_line).unpacked(grid),
        }
    }

    #[inline(always)]
    fn unpacked_raw(&self, grid: &Grid, half_line: u32) -> RawLeaf {
        match grid.bits {
            GridBits::B16 => self.grid_leaf::<RawLeaf16>(half_line).unpacked(grid),
            GridBits::B21 => self.grid_leaf::<RawLeaf21>(half_line).unpacked(grid),
        }
    }

    /// A leaf on the grid as it is stored.
    #[inline(always)]
    fn grid_leaf<T: FromBytes + KnownLayout + Immutable>(&self, half_line: u32) -> &'a T {
        let bytes = &self.lines.as_bytes()[half_line as usize * HALF_LINE..][..size_of::<T>()];
        T::ref_from_bytes(bytes).ok().expect("half lines are aligned for every leaf")
    }

    /// The half lines of the block that a child code leads to: the first one, and how many. `None`
    /// for tet leaves, which are rows of TET_LEAVES. The block need not lie within the lines.
    pub(crate) fn half_lines(&self, child: Child) -> Option<(u64, usize)> {
        let [indexed, raw] = match &self.grid {
            Some(grid) => grid.bits.half_lines(),
            None => [2 * INDEXED_LINES, 2 * RAW_LINES],
        };
        let leaf = |index: u32| if self.grid.is_some() { u64::from(index) } else { 2 * u64::from(index) };
        match child {
            Child::Node(line) => Some((2 * u64::from(line), 2 * NODE_LINES)),
            Child::Indexed(index) => Some((leaf(index), indexed)),
            Child::Raw(index) => Some((leaf(index), raw)),
            Child::Tets(_) => None,
        }
    }

    /// First byte in LINES of the block that a child code leads to; 0 for tet leaves.
    pub(crate) fn block_start(&self, child: Child) -> u64 {
        self.half_lines(child).map_or(0, |(first, _)| first * HALF_LINE as u64)
    }

    /// All bytes of LINES, by half line.
    pub(crate) fn half_line_bytes(&self) -> &'a [[u8; HALF_LINE]] {
        <[[u8; HALF_LINE]]>::ref_from_bytes(self.lines.as_bytes()).ok().expect("a line is two half lines")
    }

    /// Bit 15 of the fields `high` of a leaf of 21 bits, which the specification wants zero and the
    /// unpacked leaf lacks.
    pub(crate) fn unused_bits(&self, child: Child) -> u16 {
        let unused = |rows: &[[u16; WIDTH]]| rows.iter().flatten().fold(0, |all, high| all | high & 1 << 15);
        match (child, self.grid.map(|grid| grid.bits)) {
            (Child::Indexed(at), Some(GridBits::B21)) => unused(&[self.grid_leaf::<IndexedLeaf21>(at).high]),
            (Child::Raw(at), Some(GridBits::B21)) => unused(&self.grid_leaf::<RawLeaf21>(at).high),
            _ => 0,
        }
    }
}
