//! The walk of one ray through the wide BVH.

use super::flight::{Flight, Found};
use super::query::{Count, Query};
use super::stack::Stacks;
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::Simd;

/// What a tet leaf made of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TetOutcome {
    /// The query has what it wants.
    Done,
    /// The walk goes on with the other children.
    GoOn,
}

/// Walks from the root. Tet leaves without a subtree are handed to `tets` with their row; `walked` is left out.
#[inline(always)]
#[expect(clippy::too_many_arguments)]
pub(crate) fn walk<S: Simd, Q: Query, C: Count>(
    s: S,
    object: &ObjectView<'_>,
    ray: &Ray,
    walked: u32,
    flight: &mut Flight<Q>,
    stacks: &mut Stacks,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) {
    let mut top = stacks.start(0, object.header.root);
    while top > stacks.bottom(0) {
        let found = match Child::from_code(stacks.code(top)) {
            Some(Child::Node(at)) => {
                count.node();
                let count = flight.enter_node(s, object.node(at), stacks.room(top));
                top = stacks.replaced(top, count);
                continue;
            }
            Some(Child::Indexed(at)) => {
                let leaf = object.indexed_leaf(at);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf(s, object, ray, leaf)
            }
            Some(Child::Raw(at)) => {
                let leaf = object.raw_leaf(at);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf(s, object, ray, leaf)
            }
            Some(Child::Tets(row)) if row != walked => {
                let subtree = object.tet_leaves[row as usize].subtree;
                if subtree != NONE {
                    stacks.set_code(top, subtree);
                    continue;
                }
                count.leaf();
                let outcome = tets(row, flight.query(), count);
                if outcome == TetOutcome::Done { Found::Enough } else { flight.settled(Found::Nothing) }
            }
            Some(Child::Tets(_)) | None => Found::Nothing,
        };
        top = top.below();
        match found {
            Found::Nothing | Found::Again => {}
            // Any-hit queries keep no keys, so nothing can be told of what waits.
            Found::Nearer if Q::ANY => {}
            Found::Nearer => top = stacks.keep_up_to(s, 0, top, flight.key_limit()),
            Found::Enough => return,
        }
    }
}
