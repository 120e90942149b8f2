//! The header of an object. Specification: "Object".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// An object: one geometry in its own space, which has no unit. Specification: "Object".
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Object {
    /// Lower end of the bounds of the triangles that can be hit, object space; zeros when there are
    /// none.
    pub lower: [f32; 3],
    /// Upper end of the bounds; zeros without bounds.
    pub upper: [f32; 3],
    /// Code of the root, a [`super::Child`]; `NONE` when nothing can be hit.
    pub root: u32,
    /// [`super::LINK32`], or 0 without tet leaves.
    pub record: u32,
    /// Number of triangles of the source; triangle ids are below it.
    pub triangles: u32,
    /// Number of triangles of zero area, which no ray can hit and no leaf holds.
    pub dropped: u32,
    /// Upper bound on the nodes of a path from the root.
    pub depth: u32,
    /// Lowest byte: bits of a coordinate of a triangle leaf (16, 21, or 0 for `f32`), and
    /// [`WIDENED_BOXES`]. Above it a byte per axis: the biased `f32` exponent of the grid's step,
    /// or 0 for `f32`. See [`super::Grid`].
    pub coordinates: u32,
    /// The grid's min point, object space; zeros for `f32`.
    pub grid_origin: [f32; 3],
    /// Upper bound on the distance from a stored vertex to its source vertex, object space; 0 for
    /// `f32`.
    pub displacement: f32,
}

/// Bit of [`Object::coordinates`]: each child box contains the triangles below with room to spare,
/// for each corner [`BOX_MARGIN`] of its max |coordinate| on all sides. A reader need not
/// allow for roundings of the boxes' planes then, only for roundings of the ray, so that small
/// things in a large object are told apart.
pub const WIDENED_BOXES: u32 = 1 << 6;

/// The room around a corner in a widened box, relative to the corner's max |coordinate|.
pub const BOX_MARGIN: f64 = 1.0 / (1 << 20) as f64;

assert_layout! {
    Object 64 { lower 0, upper 12, root 24, record 28, triangles 32, dropped 36, depth 40, coordinates 44,
        grid_origin 48, displacement 60 }
}
