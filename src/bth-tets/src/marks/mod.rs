//! Which nodes may be tetrahedralized: the paper's MARKSUITABLENODES (§3.1) with exact predicates.
//!
//! Two triangles are in **bad contact** when they touch anywhere beyond the vertices that they
//! share by index after exact welding: proper crossings, coplanar overlap, T-junctions, a vertex in
//! a face, edges that overlap in part, duplicates. Triangles that share an edge or a vertex and
//! nothing else, however flat or thin, are fine, and so is any gap that f32 can express. A set of
//! triangles without bad contacts is a piecewise linear complex, the input that a constrained
//! tetrahedralization needs.

mod bad_pairs;
mod collide;
mod coplanar;
mod mark;
mod segment_triangle;
mod separation;
mod triangle_contact;

#[cfg(test)]
mod oracle;
#[cfg(test)]
pub(crate) mod testing;

pub use bad_pairs::{BadPairs, bad_pairs};
pub use mark::{MarkReport, mark};
pub use triangle_contact::{Triangle, in_bad_contact};

/// Coordinates of a vertex, object space.
type Point = [f32; 3];

/// Result of the marking stage.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Per node of the binary BVH: true if no two of its triangles are in bad contact.
    pub suitable: Vec<bool>,
}
