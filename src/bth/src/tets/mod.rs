//! Walks through the tetrahedra of tet leaves, in any of the four record formats: one ray at a time ([`walk`], [`flood`], [`locate`])
//! or a batch in lanes ([`batch`], [`queue`], [`lanes`], [`rounds`], [`decide`]).

pub(crate) mod batch;
pub(crate) mod decide;
pub(crate) mod flood;
pub(crate) mod lanes;
pub(crate) mod locate;
pub(crate) mod queue;
pub(crate) mod records;
pub(crate) mod rounds;
pub(crate) mod walk;

use self::walk::{TetSpace, WalkOutcome};
use crate::bvh::single::TetOutcome;
use crate::intersect::line::Line;
use crate::query::{Count, Query};
use crate::rays::Ray;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Result of the walk of a ray from the face on which it starts.
pub(crate) enum TetStart {
    /// The query is complete.
    Done,
    /// The query holds the hits in this tet leaf, or the value is `NONE` and nothing was walked. The ray continues through the BVH.
    Walked(u32),
}

/// Walks through the tet leaf of the face on which a ray starts, from that face. The BVH then skips the leaf, so the hint affects
/// where the search begins, never the result.
pub(crate) fn start_in_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    query: &mut Q,
    count: &mut C,
) -> TetStart {
    let row = object.triangle_faces.get(from as usize).copied().unwrap_or(NONE);
    // The walk finds hits with t >= 0 only.
    if row == NONE || ray.tmin < 0.0 {
        return TetStart::Walked(NONE);
    }
    let leaf = leaf_of_face(object, row);
    // A single ray is faster through the BVH over the leaf's triangles, if there is one.
    if object.tet_leaves[leaf as usize].subtree != NONE {
        return TetStart::Walked(NONE);
    }
    let Some(line) = Line::new(ray) else { return TetStart::Done };
    let outcome = start(object, leaf, row, &line, query, count);
    match outcome {
        Some(WalkOutcome::Done) => TetStart::Done,
        Some(_) => TetStart::Walked(leaf),
        None => TetStart::Walked(NONE),
    }
}

/// Walks from a constrained face; None if the tetrahedron that holds the origin was not found.
fn start<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    row: u32,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> Option<WalkOutcome> {
    let space = space(object, leaf, line);
    let position = space.locate(row)?;
    count.leaf();
    Some(match space.walk(position, query, count) {
        WalkOutcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    })
}

/// Walks through a tet leaf that has no subtree, from the face of its hull through which the line enters.
#[inline(never)]
pub(crate) fn enter_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    ray: &Ray,
    query: &mut Q,
    count: &mut C,
) -> TetOutcome {
    let Some(line) = Line::new(ray) else { return TetOutcome::Done };
    let space = space(object, leaf, &line);
    let outcome = match space.enter_hull() {
        Ok(position) => space.walk(position, query, count),
        Err(outcome) => outcome,
    };
    let outcome = match outcome {
        WalkOutcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    };
    if outcome == WalkOutcome::Done { TetOutcome::Done } else { TetOutcome::Continue }
}

/// The tet leaf that a constrained face belongs to.
pub(crate) fn leaf_of_face(object: &ObjectView<'_>, row: u32) -> u32 {
    object.tet_leaves.partition_point(|leaf| leaf.first_face <= row) as u32 - 1
}

/// The parts of a tet leaf, prepared for a line.
pub(crate) fn space<'a>(object: &ObjectView<'a>, leaf: u32, line: &'a Line) -> TetSpace<'a> {
    TetSpace::new(object, leaf, line)
}
