//! A view of one object: the sections of a file as typed slices, zero-copy.

use crate::layout::*;
use zerocopy::{FromBytes, IntoBytes};

/// The tetrahedron records, whichever kind the file holds.
#[derive(Clone, Copy, Debug)]
pub enum Records<'a> {
    /// No tet leaves.
    None,
    /// Links with the opposite vertex.
    Link32(&'a [Link32]),
    /// The paper's 32 bytes.
    Tet32(&'a [Tet32]),
    /// The paper's 20 bytes.
    Tet20(&'a [Tet20]),
    /// The paper's 16 bytes.
    Tet16(&'a [Tet16]),
}

impl Records<'_> {
    /// Number of tetrahedra.
    pub fn len(&self) -> usize {
        match self {
            Records::None => 0,
            Records::Link32(r) => r.len(),
            Records::Tet32(r) => r.len(),
            Records::Tet20(r) => r.len(),
            Records::Tet16(r) => r.len(),
        }
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The sections of one object. Sections that the file lacks are empty.
#[derive(Clone, Copy, Debug)]
pub struct ObjectView<'a> {
    /// Bounds, root and counts.
    pub header: &'a Object,
    /// The box of the header, as tracing reads it.
    pub bounds: ObjectBounds,
    /// Where coordinates of triangle leaves lie, unless they are `f32`.
    pub grid: Option<Grid>,
    /// Nodes and triangle leaves.
    pub lines: &'a [Line],
    /// Source id of each triangle in leaf order.
    pub triangle_ids: &'a [u32],
    /// Tet leaves.
    pub tet_leaves: &'a [TetLeaf],
    /// Their tetrahedra.
    pub records: Records<'a>,
    /// Their vertices.
    pub tet_vertices: &'a [TetVertex],
    /// Their constrained faces.
    pub tet_faces: &'a [TetFace],
    /// Their hulls.
    pub hull_faces: &'a [HullFace],
    /// Row of `tet_faces` of each source triangle; empty when there are no tet leaves.
    pub triangle_homes: &'a [u32],
    /// Welded positions of the source, if kept.
    pub positions: &'a [[f32; 3]],
    /// Rows of `positions` of each source triangle, if kept.
    pub triangles: &'a [[u32; 3]],
    /// Rows of `normals` and `uvs` of each source triangle, if kept.
    pub corners: &'a [[u32; 3]],
    /// Shading normals, if kept.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates, if kept.
    pub uvs: &'a [[f32; 2]],
}

/// An axis-aligned box in an object's space, padded so that each corner is one load of four lanes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub struct ObjectBounds {
    /// Least coordinates; the fourth is 0.
    pub lower: [f32; 4],
    /// Greatest coordinates; the fourth is 0.
    pub upper: [f32; 4],
    /// The greatest absolute value of a coordinate.
    pub greatest: f32,
}

impl ObjectBounds {
    /// The box of an object.
    pub fn new(object: &Object) -> ObjectBounds {
        let ([x, y, z], [to_x, to_y, to_z]) = (object.lower, object.upper);
        let corners = object.lower.iter().chain(&object.upper);
        let greatest = corners.fold(0.0, |m: f32, x| if x.abs() > m { x.abs() } else { m });
        ObjectBounds { lower: [x, y, z, 0.0], upper: [to_x, to_y, to_z, 0.0], greatest }
    }

    /// A cube around the origin that holds all points whose coordinates do not exceed `greatest`.
    pub fn around(greatest: f32) -> ObjectBounds {
        let [lower, upper] = [-greatest, greatest].map(|x| [x, x, x, 0.0]);
        ObjectBounds { lower, upper, greatest }
    }

    /// The longest side.
    #[inline(always)]
    pub fn size(&self) -> f32 {
        (0..3).fold(0.0, |m: f32, k| m.max(self.upper[k] - self.lower[k]))
    }
}

/// The nodes and leaves of an object, for loops that keep at hand what they need.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    lines: &'a [Line],
    /// The bit of leaves, where those are on a grid: they are counted in half lines then.
    halved: u32,
}

impl<'a> Ground<'a> {
    #[inline(always)]
    fn block<T: FromBytes + zerocopy::KnownLayout + zerocopy::Immutable>(
        self,
        line: u32,
        lines: usize,
    ) -> &'a T {
        let at = line as usize;
        let bytes = self.lines[at..at + lines].as_bytes();
        T::ref_from_bytes(bytes).expect("a block is a whole number of aligned lines")
    }
    /// As [`ObjectView::node`].
    #[inline(always)]
    pub fn node(self, line: u32) -> &'a WideNode {
        self.block(line, NODE_LINES)
    }
    /// As [`ObjectView::packed_node`].
    #[inline(always)]
    pub fn packed_node(self, line: u32) -> &'a PackedNode {
        self.block(line, PACKED_NODE_LINES)
    }
    /// The indexed leaf of `f32` that a code leads to, if it is one.
    #[inline(always)]
    pub fn indexed_leaf(self, code: u32) -> Option<&'a IndexedLeaf> {
        let line = code ^ Child::LEAF_BIT;
        // Only codes of indexed leaves are below the limit then.
        (line | self.halved < Child::INDEX_LIMIT).then(|| self.block(line, INDEXED_LINES))
    }
    /// Where the block of a child code begins, to ask for it before it is needed: maybe nowhere.
    #[inline(always)]
    pub fn place(self, code: u32) -> *const Line {
        let index = code & (Child::INDEX_LIMIT - 1);
        self.lines.as_ptr().wrapping_add((index >> ((code & self.halved) >> 31)) as usize)
    }
}

impl<'a> ObjectView<'a> {
    /// Its nodes and leaves.
    #[inline(always)]
    pub fn ground(&self) -> Ground<'a> {
        Ground { lines: self.lines, halved: if self.grid.is_some() { Child::LEAF_BIT } else { 0 } }
    }
    /// The node at a line. Panics when the lines end before the node does; checked files never do.
    #[inline(always)]
    pub fn node(&self, line: u32) -> &'a WideNode {
        self.ground().node(line)
    }
    /// The root, if it is a node and not a leaf, and is there: files that are not checked may lack it.
    pub fn root(&self) -> Option<WideNode> {
        let mut root = Child::from_code(self.header.root)?;
        if let Child::Tets(row) = root {
            root = Child::from_code(self.tet_leaves.get(row as usize)?.subtree)?;
        }
        let (Child::Node(line) | Child::Packed(line)) = root else { return None };
        let lines = if matches!(root, Child::Node(_)) { NODE_LINES } else { PACKED_NODE_LINES };
        self.lines.get(line as usize..)?.get(..lines)?;
        self.unpacked_node(root)
    }
    /// Whether all nodes are packed; else none is.
    #[inline(always)]
    pub fn has_packed_nodes(&self) -> bool {
        self.header.coordinates & PACKED_NODES != 0
    }
    /// The packed node at a line; panics as [`Self::node`] does.
    #[inline(always)]
    pub fn packed_node(&self, line: u32) -> &'a PackedNode {
        self.ground().packed_node(line)
    }
    /// The indexed leaf of `f32` at a line; panics as [`Self::node`] does.
    #[inline(always)]
    pub fn indexed_leaf(&self, line: u32) -> &'a IndexedLeaf {
        self.ground().block(line, INDEXED_LINES)
    }
    /// The raw leaf of `f32` at a line; panics as [`Self::node`] does.
    #[inline(always)]
    pub fn raw_leaf(&self, line: u32) -> &'a RawLeaf {
        self.ground().block(line, RAW_LINES)
    }
}
