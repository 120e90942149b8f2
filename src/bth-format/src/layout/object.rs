//! The header of an object. Specification: "Object".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

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
    Object 64 { lower 0, upper 12, root 24, record 28, triangles 32, dropped 36, depth 40, coordinates 44,
        grid_origin 48, displacement 60 }
}
