//! Tet leaves and their records.

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Which record the `TETS` section holds (`Object::record`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum RecordKind {
    /// [`Link32`].
    Link32 = 1,
    /// [`Tet32`].
    Tet32 = 2,
    /// [`Tet20`].
    Tet20 = 3,
    /// [`Tet16`].
    Tet16 = 4,
}

impl RecordKind {
    /// All of them, in order of their codes.
    pub const ALL: [RecordKind; 4] = [Self::Link32, Self::Tet32, Self::Tet20, Self::Tet16];

    /// The kind with this code.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|k| *k as u32 == code)
    }
    /// Bytes of a record.
    pub const fn stride(self) -> usize {
        match self {
            Self::Link32 | Self::Tet32 => 32,
            Self::Tet20 => 20,
            Self::Tet16 => 16,
        }
    }
    /// Lower-case name, as on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Link32 => "link32",
            Self::Tet32 => "tet32",
            Self::Tet20 => "tet20",
            Self::Tet16 => "tet16",
        }
    }
}

/// A node of the BVH that is a constrained tetrahedralization of its triangles within a box.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct TetLeaf {
    /// The box that the tetrahedra fill, object space.
    pub lower: [f32; 3],
    /// Upper end of the box.
    pub upper: [f32; 3],
    /// First row of `TETS`. The ranges of successive leaves follow each other, here and below.
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
    /// Child code of a BVH over the same triangles, for rays without a hint and where it proves faster; `NONE` when pruned.
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
    /// Id in the source.
    pub triangle: u32,
    /// The tetrahedron on the side that (v1-v0)x(v2-v0) points to, then the one behind.
    pub tet: [u32; 2],
    /// The vertex of each of them that is not of this face.
    pub opposite: [u32; 2],
}

/// A face of the hull: where rays enter a tet leaf from outside.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct HullFace {
    /// Vertices; (v1-v0)x(v2-v0) points inwards, to `opposite`.
    pub vertex: [u32; 3],
    /// The tetrahedron inside.
    pub tet: u32,
    /// Its fourth vertex.
    pub opposite: u32,
}

/// What lies behind a face of a tetrahedron, as a `u32`: below 2^31 the row of the
/// neighbour in `TETS`, else `FACE_BIT` and a row of `TET_FACES`; `NONE` outside the hull.
pub const FACE_BIT: u32 = 1 << 31;

/// Four links in ascending order of the vertex that the link's face is opposite to.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Link32 {
    /// The links.
    pub link: [Link; 4],
}

/// A link of [`Link32`]. Behind a constrained face `opposite` is the vertex beyond it too; behind the hull it is `NONE`.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Link {
    /// What lies behind the face.
    pub next: u32,
    /// The vertex of the next tetrahedron that is not of the face.
    pub opposite: u32,
}

/// The paper's record of 32 bytes (Aman et al. 2021, arXiv 2103.02309).
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Tet32 {
    /// The three lowest vertices, ascending.
    pub vertex: [u32; 3],
    /// Exclusive or of all four vertices.
    pub xor: u32,
    /// Links, in ascending order of the opposite vertex.
    pub next: [u32; 4],
}

/// The paper's record of 20 bytes.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Tet20 {
    /// Exclusive or of all four vertices.
    pub xor: u32,
    /// Links, in ascending order of the opposite vertex.
    pub next: [u32; 4],
}

/// The paper's record of 16 bytes.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Tet16 {
    /// Exclusive or of all four vertices.
    pub xor: u32,
    /// The first three links, each exclusive-or'ed with the fourth.
    pub next: [u32; 3],
}

assert_layout! {
    TetLeaf 64 { upper 12, first_tet 24, first_vertex 32, first_face 40, first_hull 48, subtree 56, flags 60 }
    TetVertex 16 { reserved 12 }
    TetFace 32 { triangle 12, tet 16, opposite 24 }
    HullFace 20 { tet 12, opposite 16 }
    Link32 32 {}
    Tet32 32 { xor 12, next 16 }
    Tet20 20 { next 4 }
    Tet16 16 { next 4 }
}
