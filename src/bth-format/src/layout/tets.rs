//! Tet leaves and the records of their tetrahedra. Specification: "Tetrahedralizations".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The code of [`Link32`] in [`super::Object::record`], which is 0 without tetrahedra.
pub const LINK32: u32 = 1;

/// Codes of the records of older files, of 32, 20 and 16 bytes. Such files are refused.
pub(crate) const OLD_RECORDS: [u32; 3] = [2, 3, 4];

/// A leaf of the BVH that is a constrained tetrahedralization: tetrahedra that fill a box and have
/// its triangles as faces.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct TetLeaf {
    /// The box that the tetrahedra fill, object space.
    pub lower: [f32; 3],
    /// Upper end of the box.
    pub upper: [f32; 3],
    /// First row of `TETS`. In this section and in those below, the ranges of successive leaves
    /// follow each other.
    pub first_tet: u32,
    /// Number of tetrahedra.
    pub tets: u32,
    /// First row of `TET_VERTICES`.
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// First row of `TET_FACES`.
    pub first_face: u32,
    /// Number of constrained faces.
    pub faces: u32,
    /// First row of `HULL_FACES`.
    pub first_hull: u32,
    /// Number of hull faces.
    pub hulls: u32,
    /// [`super::NONE`]. Older files, which are refused, have the child code of a BVH over the same
    /// triangles here.
    pub subtree: u32,
    /// Zero.
    pub flags: u32,
}

/// Position of a vertex of a tetrahedron, object space.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct TetVertex {
    /// x, y, z.
    pub position: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

/// A constrained face: a triangle of the source, whole, between two tetrahedra.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct TetFace {
    /// Vertices (rows of `TET_VERTICES`) in source order.
    pub vertex: [u32; 3],
    /// Triangle id in the source.
    pub triangle: u32,
    /// The tetrahedron on the side that (v1-v0)x(v2-v0) points to, then the one behind.
    pub tet: [u32; 2],
    /// The vertex of each of them that is not of this face.
    pub opposite: [u32; 2],
}

/// A face of a tetrahedron with nothing beyond: rays enter a tet leaf through it.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct HullFace {
    /// Vertices; (v1-v0)x(v2-v0) points inwards, to `opposite`.
    pub vertex: [u32; 3],
    /// The tetrahedron inside.
    pub tet: u32,
    /// Its vertex that is not of this face.
    pub opposite: u32,
}

/// Set in links to constrained faces. A link is a `u32` for what lies behind a face of a
/// tetrahedron: below 2^31 the row of the neighbour in `TETS`, with this bit a row of `TET_FACES`,
/// and [`super::NONE`] outside the hull.
pub const FACE_BIT: u32 = 1 << 31;

/// A tetrahedron: four links with the vertex beyond each, in ascending order of the vertex
/// opposite to the link's face.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Link32 {
    /// Links and the vertices beyond.
    pub link: [Link; 4],
}

/// A link of [`Link32`] and the vertex beyond it.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Link {
    /// The link: see [`FACE_BIT`].
    pub next: u32,
    /// The vertex of the tetrahedron beyond, behind a constrained face too, that is not of the
    /// face; [`super::NONE`] outside the hull.
    pub opposite: u32,
}

assert_layout! {
    TetLeaf 64 { upper 12, first_tet 24, first_vertex 32, first_face 40, first_hull 48, subtree 56, flags 60 }
    TetVertex 16 { reserved 12 }
    TetFace 32 { triangle 12, tet 16, opposite 24 }
    HullFace 20 { tet 12, opposite 16 }
    Link32 32 {}
}
