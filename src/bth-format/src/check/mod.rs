//! The index check of an object and of the scene: what makes tracing safe. Specification: "Index
//! check".
//!
//! An object that passes cannot make a traversal read out of bounds, loop, or visit a node twice.
//! So the time of a ray is at most in proportion to the object's bytes (SECURITY.md).
//! The check costs O(bytes of the object) and does not recurse. It covers what indices and counts
//! have to be; what the numbers have to be (boxes that contain their triangles, tetrahedra that
//! have volume) is checked by [`crate::verify`].

mod adjacency;
mod bit_set;
mod deformable;
mod deformers;
mod exact;
mod free;
mod groups;
mod header;
mod leaves;
mod materials;
mod nodes;
mod opacity;
mod places;
mod rows;
mod scene;
mod sequence;
mod sources;
mod tet_faces;
mod tet_leaves;
mod tracks;
mod tree;
mod vertex_motion;

pub(crate) use adjacency::TetAdjacency;
pub(crate) use exact::check as exact;
pub(crate) use materials::{image_names, images, materials};
pub(crate) use scene::check as scene;
pub(crate) use sequence::sequence;
pub(crate) use vertex_motion::check as deformation;

use crate::error::Result;
use crate::object::ObjectView;

/// Checks every index of an object.
///
/// # Errors
/// The first violation of `BTH-F101` to `BTH-F147` and `BTH-F163` to `BTH-F172` and `BTH-F187`,
/// with an offset from the start of its section; [`crate::file::File::check`] gives offsets from
/// the start of the file.
pub(crate) fn object(view: &ObjectView) -> Result<()> {
    header::check(view)?;
    sources::check(view)?;
    groups::check(view)?;
    opacity::check(view)?;
    free::check(view)?;
    tet_leaves::check(view)?;
    tree::check(view)?;
    leaves::check_ids(view)?;
    tet_faces::check(view)?;
    deformable::check(view)
}
