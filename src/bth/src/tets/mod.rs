//! One ray through the tetrahedra of a leaf, whichever record they have.

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

/// What became of a ray where it starts.
pub(crate) enum TetStart {
    Done,
    /// Goes on without this tet leaf, if any.
    Walked(u32),
}

/// A hint changes where the search begins, never what is found: the tet leaf of the surface is walked first, from
/// the surface, and left out later.
pub(crate) fn start_in_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    query: &mut Q,
    count: &mut C,
) -> TetStart {
    let row = object.triangle_faces.get(from as usize).copied().unwrap_or(NONE);
    // Such a walk sees only what lies ahead of the origin. One ray alone is faster through the BVH, if there is one.
    if row == NONE || ray.tmin < 0.0 {
        return TetStart::Walked(NONE);
    }
    let leaf = leaf_of_face(object, row);
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

fn start<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    row: u32,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> Option<WalkOutcome> {
    let space = space(object, leaf, line);
    let place = space.locate(row)?;
    count.leaf();
    Some(match space.walk(place, query, count) {
        WalkOutcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    })
}

/// Walks through a tet leaf that has no subtree, from its hull.
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
        Ok(place) => space.walk(place, query, count),
        Err(outcome) => outcome,
    };
    let outcome = match outcome {
        WalkOutcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    };
    if outcome == WalkOutcome::Done { TetOutcome::Done } else { TetOutcome::GoOn }
}

/// The tet leaf that a constrained face belongs to.
pub(crate) fn leaf_of_face(object: &ObjectView<'_>, row: u32) -> u32 {
    object.tet_leaves.partition_point(|leaf| leaf.first_face <= row) as u32 - 1
}

pub(crate) fn space<'a>(object: &ObjectView<'a>, leaf: u32, line: &'a Line) -> TetSpace<'a> {
    TetSpace::new(object, leaf, line)
}
