//! Walks of rays through the tetrahedra of tet leaves, in any of the four record formats ([`records`]).
//!
//! A single ray is walked in f64 ([`walk`], [`flood`], [`locate`]). The rays of a batch are walked in f32, sixteen to a vector
//! ([`batch`], [`queue`], [`lanes`], [`rounds`]), and in f64 where f32 does not decide ([`decide`]).

pub(crate) mod batch;
pub(crate) mod decide;
mod exit_lanes;
pub(crate) mod flood;
pub(crate) mod lanes;
pub(crate) mod locate;
pub(crate) mod queue;
mod reached;
pub(crate) mod records;
pub(crate) mod rounds;
mod starts;
pub(crate) mod walk;
pub(crate) mod walks;

use self::walk::{TetWalker, WalkOutcome};
use crate::intersect::line::Line;
use crate::query::{Count, EitherQuery, Query};
use crate::rays::Ray;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Result of a tet leaf for a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TetOutcome {
    /// The query is complete.
    Done,
    /// The traversal continues with the stack.
    Continue,
}

/// Result of the walk of a ray from the face on which it starts.
pub(crate) enum TetStart {
    /// The query is complete.
    Done,
    /// The ray continues through the BVH. The value is the index of the tet leaf whose hits the query already holds, or `NONE` if
    /// the ray was not walked.
    Walked(u32),
}

/// Walks through the tet leaf of the triangle on which a ray starts, from the constrained face of that triangle. The traversal of
/// the BVH then skips the leaf, so the hint affects where the search begins, never the result.
#[inline(never)]
pub(crate) fn start_in_tets<C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    triangle: u32,
    query: &mut EitherQuery,
    count: &mut C,
) -> TetStart {
    let face = object.triangle_faces.get(triangle as usize).copied().unwrap_or(NONE);
    // The walk starts at the origin, so it would miss hits with t < 0.
    if face == NONE || ray.tmin < 0.0 {
        return TetStart::Walked(NONE);
    }
    let leaf = leaf_of_face(object, face);
    // For a single ray the BVH over the leaf's triangles is faster, if there is one.
    if object.tet_leaves[leaf as usize].subtree != NONE {
        return TetStart::Walked(NONE);
    }
    let Some(line) = Line::new(ray) else { return TetStart::Done };
    let outcome = walk_from_face(object, leaf, face, &line, query, count);
    match outcome {
        Some(WalkOutcome::Done) => TetStart::Done,
        Some(_) => TetStart::Walked(leaf),
        None => TetStart::Walked(NONE),
    }
}

/// Walks from the constrained face with index `face`. `None` if the tetrahedron that holds the origin was not found.
fn walk_from_face<C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    face: u32,
    line: &Line,
    query: &mut EitherQuery,
    count: &mut C,
) -> Option<WalkOutcome> {
    let walker = TetWalker::new(object, leaf, line);
    let position = walker.locate(face)?;
    count.leaf();
    Some(match walker.walk(position, query, count) {
        WalkOutcome::Uncertain => walker.flood(query, count),
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
    let mut either = query.to_either();
    let outcome = enter(object, leaf, ray, &mut either, count);
    *query = Q::from_either(query.goal(), &either);
    outcome
}

/// Implements [`enter_tets`].
#[inline(never)]
fn enter<C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    ray: &Ray,
    query: &mut EitherQuery,
    count: &mut C,
) -> TetOutcome {
    let Some(line) = Line::new(ray) else { return TetOutcome::Done };
    let walker = TetWalker::new(object, leaf, &line);
    let outcome = match walker.enter_hull() {
        Ok(position) => walker.walk(position, query, count),
        Err(outcome) => outcome,
    };
    let outcome = match outcome {
        WalkOutcome::Uncertain => walker.flood(query, count),
        outcome => outcome,
    };
    if outcome == WalkOutcome::Done { TetOutcome::Done } else { TetOutcome::Continue }
}

/// Index of the tet leaf to which the constrained face with index `face` belongs.
pub(crate) fn leaf_of_face(object: &ObjectView<'_>, face: u32) -> u32 {
    object.tet_leaves.partition_point(|leaf| leaf.first_face <= face) as u32 - 1
}
