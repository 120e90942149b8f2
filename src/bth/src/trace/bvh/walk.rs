//! The walk of one ray through the wide BVH.

use super::flight::{Flight, Found};
use super::nodes::{Nodes, prefetch};
use super::stack::Stacks;
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::query::{Count, Query};
use std::slice::from_ref;

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
pub(crate) fn walk<S: Simd, N: Nodes, Q: Query, C: Count>(
    s: S,
    nodes: N,
    object: &ObjectView<'_>,
    ray: &Ray,
    walked: u32,
    flight: &mut Flight<Q>,
    stacks: &mut Stacks,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) {
    // The code of what is entered next stays out of memory: reading back what was just stored is the longest wait of a step.
    // Its place on the stack is `top`.
    let mut code = object.header.root;
    let mut top = stacks.start(0, code);
    loop {
        let found = match Child::from_code(code) {
            Some(child) if N::is(child) => {
                count.node();
                match flight.nearest_child(s, N::node(object.ground(), code), stacks.room(top)) {
                    Some((nearest, others)) => {
                        code = nearest;
                        top = stacks.replaced(top, others + 1);
                        // A ray alone has nothing to do while it waits for that one.
                        if others > 0 {
                            prefetch(s, nodes, object.ground(), stacks.code(top.below()));
                        }
                        continue;
                    }
                    None => Found::Nothing,
                }
            }
            Some(Child::Indexed(at)) => {
                let mut room = None;
                let leaf = object.indexed(at, &mut room);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf::<S, _, false>(s, object, from_ref(ray), (leaf, code))
            }
            Some(Child::Raw(at)) => {
                let mut room = None;
                let leaf = object.raw(at, &mut room);
                count.leaf();
                count.triangles(leaf.triangles);
                flight.enter_leaf::<S, _, false>(s, object, from_ref(ray), (leaf, code))
            }
            Some(Child::Tets(row)) if row != walked => {
                let subtree = object.tet_leaves[row as usize].subtree;
                if subtree != NONE {
                    code = subtree;
                    continue;
                }
                count.leaf();
                let outcome = tets(row, flight.query(), count);
                if outcome == TetOutcome::Done { Found::Enough } else { flight.settled(Found::Nothing) }
            }
            Some(Child::Tets(_) | Child::Node(_) | Child::Packed(_)) | None => Found::Nothing,
        };
        top = top.below();
        match found {
            Found::Nothing | Found::Again => {}
            // Any-hit queries keep no keys, so nothing can be told of what waits.
            Found::Nearer if Q::ANY => {}
            Found::Nearer => top = stacks.keep_up_to(s, stacks.bottom(0), top, flight.key_limit()),
            Found::Enough => return,
        }
        if top <= stacks.bottom(0) {
            return;
        }
        code = stacks.code(top);
    }
}
