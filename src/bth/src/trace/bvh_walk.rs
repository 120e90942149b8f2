//! The walk of one ray through the wide BVH.

use super::flight::Flight;
use super::query::{Count, Query};
use super::stack::Stack;
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
    mut stack: Stack<'_>,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) {
    stack.start(object.header.root);
    loop {
        let done = match Child::from_code(stack.code()) {
            Some(Child::Node(at)) => {
                count.node();
                flight.enter_node(s, object, at, &mut stack);
                false
            }
            Some(Child::Indexed(at)) => {
                let leaf = object.indexed_leaf(at);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf(s, object, ray, leaf, &mut stack)
            }
            Some(Child::Raw(at)) => {
                let leaf = object.raw_leaf(at);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf(s, object, ray, leaf, &mut stack)
            }
            Some(Child::Tets(row)) if row != walked => {
                let subtree = object.tet_leaves[row as usize].subtree;
                if subtree != NONE {
                    stack.set_code(subtree);
                    false
                } else {
                    stack.pop();
                    count.leaf();
                    let outcome = tets(row, flight.query(), count);
                    flight.take_over();
                    outcome == TetOutcome::Done
                }
            }
            Some(Child::Tets(_)) => {
                stack.pop();
                false
            }
            // An empty slot, or the bottom.
            None => {
                let done = stack.is_empty();
                stack.pop();
                done
            }
        };
        if done {
            return;
        }
    }
}
