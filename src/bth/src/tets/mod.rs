//! Walks of rays through the tetrahedra of tet leaves, in either record ([`records`]).
//!
//! A single ray is walked in f64 ([`walk`], [`flood`]). The rays of a batch are walked in f32,
//! sixteen to a vector ([`batch`], [`queue`], [`lanes`], [`rounds`]), and in f64 where f32 does not
//! decide ([`decide`]).

pub(crate) mod batch;
pub(crate) mod decide;
mod exit_lanes;
pub(crate) mod flood;
pub(crate) mod lanes;
pub(crate) mod queue;
mod reached;
pub(crate) mod records;
pub(crate) mod rounds;
mod starts;
pub(crate) mod walk;
pub(crate) mod walks;

use self::walk::{TetWalker, WalkOutcome};
use crate::intersect::line::Line;
use crate::intersect::start::start_on;
use crate::intersect::start_point::ExactRay;
use crate::query::{Count, EitherQuery, Goal, RayQuery};
use bth_format::layout::Child;
use bth_format::object::ObjectView;

/// Result of a tet leaf for a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TetOutcome {
    /// The query is complete.
    Done,
    /// The traversal continues with the stack.
    Continue,
}

/// Walks through a tet leaf that has no subtree, from the face of its hull through which the line
/// enters.
#[inline(never)]
pub(crate) fn enter_tets<G: Goal, C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    ray: ExactRay<'_>,
    query: &mut RayQuery<G>,
    count: &mut C,
) -> TetOutcome {
    let mut either = query.to_either();
    let outcome = enter(object, leaf, ray, &mut either, count);
    *query = either.with_goal(query.goal());
    outcome
}

/// Implements [`enter_tets`].
#[inline(never)]
fn enter<C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    (ray, start): ExactRay<'_>,
    query: &mut EitherQuery,
    count: &mut C,
) -> TetOutcome {
    let Some(mut line) = Line::new(ray) else { return TetOutcome::Done };
    if let Some(start) = start {
        line.start_at(start);
    }
    let mut walker = TetWalker::new(object, leaf, &line);
    walker.start = start.and_then(|start| start_on(object, start));
    let entered = match start {
        Some(start) if start.leaf == Child::Tets(leaf).code() => walker.leave(start.slot),
        _ => None,
    };
    let outcome = match entered.map_or_else(|| walker.enter_hull(), Ok) {
        Ok(position) => walker.walk(position, query, count),
        Err(outcome) => outcome,
    };
    let outcome = match outcome {
        WalkOutcome::Uncertain => walker.flood(query, count),
        outcome => outcome,
    };
    if outcome == WalkOutcome::Done { TetOutcome::Done } else { TetOutcome::Continue }
}
