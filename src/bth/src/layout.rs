//! The bytes of a `.bth` file, version 1: every structure that lies on disk.
//!
//! `format-spec/` is normative; a test holds its tables against these structs.
//! All numbers are little-endian. Structures have no padding and no pointers:
//! what refers to something else is an index, and [`NONE`] is no index.

mod grid;
mod scene;

pub use grid::*;
pub use scene::*;

use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

macro_rules! assert_layout {
    ($($type:ident $size:literal { $($field:ident $at:literal),* })*) => { $(const _: () = {
        assert!(size_of::<$type>() == $size);
        $(assert!(std::mem::offset_of!($type, $field) == $at);)*
    };)* };
}
use assert_layout;

/// No index: an absent child, triangle, tetrahedron or surface.
pub const NONE: u32 = u32::MAX;

/// First bytes of every file. The non-ASCII byte, CR LF, 0x1A and LF catch
/// transfers that change text; the digit is the major version.
pub const IDENTIFIER: [u8; 16] = *b"\x89BTH1\r\n\x1a\n\0\0\0\0\0\0\0";
/// Format version written by this library: major in the high half, minor in the low.
pub const WRITER_VERSION: u32 = 0x0001_0000;
/// Oldest reader version that understands what this library writes.
pub const MINIMUM_READER_VERSION: u32 = 0x0001_0000;
/// Every section starts at a multiple of this, and the file ends at one.
pub const ALIGNMENT: usize = 64;

/// File header, at offset 0.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Header {
    /// [`IDENTIFIER`].
    pub identifier: [u8; 16],
    /// Version of the format that the writer followed.
    pub writer_version: u32,
    /// A reader of a lower version must refuse the file.
    pub minimum_reader_version: u32,
    /// Bytes of the whole file.
    pub file_length: u64,
    /// Offset of the section table, always 128.
    pub section_offset: u64,
    /// Entries of the section table.
    pub section_count: u32,
    /// Zero.
    pub reserved: u32,
    /// Bits that a reader must know to read the file: [`FEATURE_GRID`].
    pub required_features: u64,
    /// Bits that a reader may ignore.
    pub optional_features: u64,
    /// BLAKE3 (256 bits) of the section entries' identity without provenance; see the specification.
    pub content_id: [u8; 32],
    /// BLAKE3 (first 128 bits) of the section table.
    pub table_hash: [u8; 16],
    /// BLAKE3 (first 128 bits) of the 112 bytes before.
    pub header_hash: [u8; 16],
}

/// One entry of the section table. Entries are sorted by (object, kind), both ascending, each pair once.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct SectionEntry {
    /// One of [`kind`].
    pub kind: u32,
    /// Bit 0: a reader that does not know the kind must refuse the file. Others zero.
    pub flags: u32,
    /// The object that the section belongs to.
    pub object: u32,
    /// Alignment of `offset`, always 64.
    pub alignment: u32,
    /// Bytes from the start of the file.
    pub offset: u64,
    /// Bytes of the section; `stride * count`.
    pub length: u64,
    /// Bytes of one element.
    pub stride: u32,
    /// Zero.
    pub reserved: u32,
    /// Elements.
    pub count: u64,
    /// BLAKE3 (first 128 bits) of the section's bytes.
    pub hash: [u8; 16],
}

/// Bit of [`Header::required_features`]: an object stores the coordinates of its triangle leaves on a [`Grid`].
pub const FEATURE_GRID: u64 = 1;

/// Bit of [`Header::required_features`]: an object has nodes with boxes of bytes, [`PackedNode`].
pub const FEATURE_PACKED_NODES: u64 = 2;

/// Flag bit of [`SectionEntry::flags`]: unknown kinds with it are refused.
pub const SECTION_REQUIRED: u32 = 1;

/// Section kinds.
pub mod kind {
    /// One [`super::Object`].
    pub const OBJECT: u32 = 1;
    /// [`super::Line`]s that hold the wide nodes and triangle leaves.
    pub const LINES: u32 = 2;
    /// `u32` per triangle in leaf order: its id in the source.
    pub const TRIANGLE_IDS: u32 = 3;
    /// [`super::TetLeaf`]s.
    pub const TET_LEAVES: u32 = 4;
    /// [`super::Link32`], [`super::Tet32`], [`super::Tet20`] or [`super::Tet16`] records.
    pub const TETS: u32 = 5;
    /// [`super::TetVertex`] positions.
    pub const TET_VERTICES: u32 = 6;
    /// [`super::TetFace`]s, one per constrained face.
    pub const TET_FACES: u32 = 7;
    /// [`super::HullFace`]s.
    pub const HULL_FACES: u32 = 8;
    /// `u32` per source triangle: its row in `TET_FACES`, or `NONE`.
    pub const TRIANGLE_HOMES: u32 = 9;
    /// `[f32; 3]` welded positions of the source.
    pub const POSITIONS: u32 = 16;
    /// `[u32; 3]` per source triangle: rows of `POSITIONS`.
    pub const TRIANGLES: u32 = 17;
    /// `[u32; 3]` per source triangle: rows of `NORMALS` and `UVS`.
    pub const CORNERS: u32 = 18;
    /// `[f32; 3]` shading normals, as in the source (not normalized by us).
    pub const NORMALS: u32 = 19;
    /// `[f32; 2]` texture coordinates.
    pub const UVS: u32 = 20;
    /// UTF-8 JSON: how the file came about. Not part of the content id.
    pub const PROVENANCE: u32 = 32;
    /// One [`super::Scene`]; of the whole file, as the following.
    pub const SCENE: u32 = 48;
    /// [`super::Node`]s, parents before children.
    pub const NODES: u32 = 49;
    /// [`super::Instance`]s.
    pub const INSTANCES: u32 = 50;
    /// [`super::Track`]s, by node and property.
    pub const TRACKS: u32 = 51;
    /// `f64` seconds of the keys of all tracks.
    pub const TIMES: u32 = 52;
    /// `f64` values of the keys of all tracks.
    pub const VALUES: u32 = 53;
    /// [`super::Camera`]s.
    pub const CAMERAS: u32 = 54;
    /// [`super::Light`]s.
    pub const LIGHTS: u32 = 55;
    /// UTF-8 names of nodes, cameras and lights.
    pub const NAMES: u32 = 56;

    /// Whether sections of this kind describe the scene.
    pub const fn is_scene(kind: u32) -> bool {
        SCENE <= kind && kind <= NAMES
    }
    /// Whether a reader that does not know the kind must refuse the file.
    pub const fn is_required(kind: u32) -> bool {
        (OBJECT <= kind && kind <= TRIANGLE_HOMES) || is_scene(kind)
    }
}

/// 64 bytes: the unit in which nodes and leaves are addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C, align(64))]
pub struct Line(pub [u32; 16]);

/// An object: one geometry in its own space.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Object {
    /// Bounds of the triangles that can be hit, object space; zero when there are none.
    pub lower: [f32; 3],
    /// Upper end of the bounds.
    pub upper: [f32; 3],
    /// [`Child`] code of the root; `NONE` when nothing can be hit.
    pub root: u32,
    /// Tetrahedron record: 0 none, else a [`RecordKind`].
    pub record: u32,
    /// Triangles of the source; ids are below this.
    pub triangles: u32,
    /// Zero-area triangles, which no ray can hit and no leaf holds.
    pub dropped: u32,
    /// Wide nodes on the longest path from the root.
    pub depth: u32,
    /// Bits of a coordinate of a triangle leaf in the lowest byte: 16, 21, or 0 for `f32`; and [`PACKED_NODES`]. Then per
    /// axis the exponent field, as of an `f32`, of the power of two between neighbouring points of the [`Grid`]: zero for
    /// `f32`, as the following.
    pub coordinates: u32,
    /// The grid's least point.
    pub grid_origin: [f32; 3],
    /// Greatest distance of a stored vertex from that of the source, object space.
    pub displacement: f32,
}

/// Bit of [`Object::coordinates`]: all nodes are [`PackedNode`]s; else none is.
pub const PACKED_NODES: u32 = 1 << 7;

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

/// Where a child code leads. Codes are `u32`: bit 31 set for leaves, bits 30..29
/// the kind of leaf, the rest an index; `NONE` is an empty slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Line of a [`WideNode`].
    Node(u32),
    /// Line of a [`PackedNode`].
    Packed(u32),
    /// Line of an [`IndexedLeaf`]; on a grid the half line of an [`IndexedLeaf16`] or [`IndexedLeaf21`].
    Indexed(u32),
    /// Line of a [`RawLeaf`]; on a grid the half line of a [`RawLeaf16`] or [`RawLeaf21`].
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
    Header 128 { writer_version 16, file_length 24, section_offset 32, section_count 40,
        required_features 48, optional_features 56, content_id 64, table_hash 96, header_hash 112 }
    SectionEntry 64 { kind 0, flags 4, object 8, alignment 12, offset 16, length 24, stride 32, count 40, hash 48 }
    Line 64 {}
    Object 64 { lower 0, upper 12, root 24, record 28, triangles 32, dropped 36, depth 40, coordinates 44,
        grid_origin 48, displacement 60 }
    WideNode 448 { child 384 }
    PackedNode 192 { child 96, origin 160, step 172, reserved 184 }
    IndexedLeaf 256 { corner 192, first 240, triangles 244, vertices 248 }
    RawLeaf 640 { first 576, triangles 580 }
    TetLeaf 64 { upper 12, first_tet 24, first_vertex 32, first_face 40, first_hull 48, subtree 56, flags 60 }
    TetVertex 16 { reserved 12 }
    TetFace 32 { triangle 12, tet 16, opposite 24 }
    HullFace 20 { tet 12, opposite 16 }
    Link32 32 {}
    Tet32 32 { xor 12, next 16 }
    Tet20 20 { next 4 }
    Tet16 16 { next 4 }
}

/// Lines that a [`WideNode`] takes.
pub const NODE_LINES: usize = size_of::<WideNode>() / 64;
/// Lines that a [`PackedNode`] takes.
pub const PACKED_NODE_LINES: usize = size_of::<PackedNode>() / 64;
/// Lines that an [`IndexedLeaf`] takes.
pub const INDEXED_LINES: usize = size_of::<IndexedLeaf>() / 64;
/// Lines that a [`RawLeaf`] takes.
pub const RAW_LINES: usize = size_of::<RawLeaf>() / 64;
