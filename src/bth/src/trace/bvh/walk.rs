//! The walk of one ray through the wide BVH. There is nothing to overlap with, so what matters is how long one step waits for
//! the one before: hits are noted as f32 bounds them, and computed in f64 only when the walk has ended.

use super::alone::Alone;
use super::flight::key_limit;
use super::nodes::{Nodes, indexed_leaf, prefetch};
use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::candidate::{Candidate, Settled, settle, settle_one};
use crate::trace::prepare::Aim;
use crate::trace::query::{Count, Query};
use crate::trace::sight::{Block, Certain};
use crate::trace::slabs::{Boxes, Planes};
use bth_format::layout::{Child, NONE, WIDTH};
use bth_format::object::ObjectView;
use std::hint::black_box;

/// What a tet leaf made of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TetOutcome {
    /// The query has what it wants.
    Done,
    /// The walk goes on with the other children.
    GoOn,
}

/// What a ray has come upon. Kept apart from the query, so that it stays in registers.
struct Walk<'a> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    aim: &'a Aim,
    /// Nothing whose depth certainly exceeds this matters any more.
    last: f32,
    /// Lower bound of the depth of the nearest hit so far.
    nearest: f32,
    /// That hit, if it has still to be computed.
    waiting: Candidate,
}

impl Walk<'_> {
    /// Tests the triangles of a leaf with this code; true if the query has what it wants.
    #[inline(always)]
    fn enter_leaf<S: Simd, Q: Query, B: Block>(
        &mut self,
        s: S,
        (block, code): (&B, u32),
        query: &mut Q,
    ) -> bool {
        let aim = self.aim;
        let found = aim.sight.candidates(s, block, aim.slabs.first, self.last);
        if found.maybe == 0 {
            return false;
        }
        if Q::ANY {
            if found.sure != 0 {
                query.accept();
                return true;
            }
            return self.decide(code, found.maybe, query);
        }
        let (maybe, certain) = found.nearest_of_all(s);
        if let Some(Certain { triangle, near, far }) = certain
            && far < self.nearest
        {
            let place = (block.first() as usize).wrapping_add(triangle);
            s.prefetch(self.object.triangle_ids.as_ptr().wrapping_add(place));
            self.nearest = near;
            self.waiting = Candidate { leaf: code, triangle: triangle as u32 };
            self.last = if far < self.last { far } else { self.last };
            return false;
        }
        self.decide(code, maybe, query)
    }

    /// Computes what waits and these triangles of a leaf, a bit each; true if the query has what it wants.
    #[inline(always)]
    fn decide<Q: Query>(&mut self, leaf: u32, mut maybe: u32, query: &mut Q) -> bool {
        let (object, ray) = (self.object, self.ray);
        let mut candidates = [self.waiting, Candidate::NONE];
        self.waiting = Candidate::NONE;
        let mut done = false;
        while !done && (maybe != 0 || candidates[0] != Candidate::NONE) {
            if maybe != 0 {
                candidates[1] = Candidate { leaf, triangle: maybe.trailing_zeros() };
            }
            done = matches!(settle(object, ray, candidates, query), Settled::Enough);
            candidates[0] = Candidate::NONE;
            maybe &= maybe.wrapping_sub(1);
        }
        self.take_over(query);
        done
    }

    /// Computes what waits.
    #[inline(always)]
    fn settle<Q: Query>(&mut self, query: &mut Q) {
        if self.waiting.leaf != NONE {
            settle_one(self.object, self.ray, self.waiting, query);
            self.waiting = Candidate::NONE;
        }
    }

    /// Takes over what the query has found meanwhile.
    #[inline(always)]
    fn take_over<Q: Query>(&mut self, query: &Q) {
        if !Q::ANY {
            self.last = self.aim.slabs.limit(query.limit());
            self.nearest = self.aim.slabs.nearest(query);
        }
    }
}

/// Walks from the root. Tet leaves without a subtree are handed to `tets` with their row; `walked`, from which the query has what
/// it knows, is left out.
#[inline(always)]
#[expect(clippy::too_many_arguments)]
pub(crate) fn walk<S: Simd, N: Nodes, Q: Query, C: Count>(
    s: S,
    nodes: N,
    (object, ray): (&ObjectView<'_>, &Ray),
    aim: &Aim,
    walked: u32,
    query: &mut Q,
    stack: &mut Alone,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) {
    // In memory: compilers would rather make sixteen of each of its numbers before the walk, and store those.
    let aim = black_box(aim);
    let mut walk =
        Walk { object, ray, aim, last: aim.slabs.last, nearest: f32::INFINITY, waiting: Candidate::NONE };
    if walked != NONE {
        walk.take_over(query);
    }
    let ground = object.ground();
    let mut code = object.header.root;
    let mut stack = stack.start(code);
    // Keys of the stack beyond this are of no interest any more.
    let mut limit = key_limit(walk.last);
    loop {
        // In registers for as long as no leaf is entered.
        let planes = Planes::new(s, &aim.slabs);
        while code & Child::LEAF_BIT == 0 {
            count.node();
            let node = N::node(ground, code);
            let (bits, enter) = planes.children(s, node, walk.last);
            if bits & bits.wrapping_sub(1) == 0 {
                if bits != 0 {
                    code = node.child()[bits.trailing_zeros() as usize % WIDTH];
                } else {
                    code = stack.pop::<Q>(limit);
                }
                continue;
            }
            let room = stack.room();
            let children = s.load_u(node.child());
            if Q::ANY {
                code = node.child()[bits.trailing_zeros() as usize % WIDTH];
                let others = s.compress(bits & (bits - 1), children, room.codes);
                room.keep(others + 1);
            } else {
                let (count, nearest) = s.sort_far_to_near(bits, enter, children, room.codes, room.keys);
                code = node.child()[nearest % WIDTH];
                room.keep(count);
            }
            // A ray alone has nothing to do while it waits for that one.
            prefetch(s, nodes, ground, stack.below());
        }
        let mut unpacked = None;
        let done = if let Some(leaf) = indexed_leaf(object, ground, code, &mut unpacked) {
            count.leaf();
            count.triangles(leaf.triangles);
            walk.enter_leaf(s, (leaf, code), query)
        } else {
            let mut unpacked = None;
            match Child::from_code(code) {
                Some(Child::Raw(at)) => {
                    let leaf = object.raw(at, &mut unpacked);
                    count.leaf();
                    count.triangles(leaf.triangles);
                    walk.enter_leaf(s, (leaf, code), query)
                }
                Some(Child::Tets(row)) if row != walked => {
                    let subtree = object.tet_leaves[row as usize].subtree;
                    if subtree != NONE {
                        code = subtree;
                        continue;
                    }
                    count.leaf();
                    walk.decide(NONE, 0, query);
                    let done = tets(row, query, count) == TetOutcome::Done;
                    walk.take_over(query);
                    done
                }
                _ => stack.is_empty(),
            }
        };
        if done {
            break;
        }
        limit = key_limit(walk.last);
        code = stack.pop::<Q>(limit);
    }
    walk.settle(query);
}
