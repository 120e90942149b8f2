//! The bytes of a `.bth` file, version 1: every structure that lies on disk.
//!
//! `format-spec/` is normative; a test holds its tables against these structs.
//! All numbers are little-endian. Structures have no padding and no pointers:
//! what refers to something else is an index, and [`NONE`] is no index.

mod bvh;
mod grid;
mod scene;
mod tets;

pub use bvh::*;
pub use grid::*;
pub use scene::*;
pub use tets::*;

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

/// An object: one geometry in its own space.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Object {
    /// ObjectBounds of the triangles that can be hit, object space; zero when there are none.
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

assert_layout! {
    Header 128 { writer_version 16, file_length 24, section_offset 32, section_count 40,
        required_features 48, optional_features 56, content_id 64, table_hash 96, header_hash 112 }
    SectionEntry 64 { kind 0, flags 4, object 8, alignment 12, offset 16, length 24, stride 32, count 40, hash 48 }
    Object 64 { lower 0, upper 12, root 24, record 28, triangles 32, dropped 36, depth 40, coordinates 44,
        grid_origin 48, displacement 60 }
}
