//! The walk of one ray through the wide BVH. There is nothing to overlap with, so what matters is how long one step waits for
//! the one before: hits are noted as f32 bounds them, and computed in f64 only when the walk has ended.

use super::leaf::{LeafOutcome, Progress, decide, enter_leaf};
use super::nodes::{Nodes, indexed_leaf, prefetch};
use super::ray_state::key_limit;
use super::single_stack::SingleStack;
use crate::bvh::candidate::{Candidate, settle_one};
use crate::intersect::boxes::{ChildBoxes, RaySlabLanes};
use crate::intersect::prepare::PreparedRay;
use crate::query::{Count, Query};
use crate::rays::Ray;
use crate::simd::Simd;
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

/// What a ray has come upon, in registers but for its query.
struct SingleState<'a, Q> {
    prepared: &'a PreparedRay,
    query: &'a mut Q,
    /// Nothing whose depth certainly exceeds this matters any more.
    last: f32,
    /// Lower bound of the depth of the nearest hit so far.
    nearest: f32,
    /// That hit, if it has still to be computed.
    pending: Candidate,
}

impl<Q: Query> Progress<Q> for SingleState<'_, Q> {
    #[inline(always)]
    fn prepared(&self) -> &PreparedRay {
        self.prepared
    }
    #[inline(always)]
    fn last(&self) -> f32 {
        self.last
    }
    #[inline(always)]
    fn set_last(&mut self, last: f32) {
        self.last = last;
    }
    #[inline(always)]
    fn nearest(&self) -> f32 {
        self.nearest
    }
    #[inline(always)]
    fn set_nearest(&mut self, nearest: f32) {
        self.nearest = nearest;
    }
    #[inline(always)]
    fn pending(&self) -> Candidate {
        self.pending
    }
    #[inline(always)]
    fn set_pending(&mut self, pending: Candidate) {
        self.pending = pending;
    }
    #[inline(always)]
    fn query(&mut self, _ray: &Ray) -> &mut Q {
        self.query
    }
    #[inline(always)]
    fn accept(&mut self) {
        self.query.accept();
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
    prepared: &PreparedRay,
    walked: u32,
    query: &mut Q,
    stack: &mut SingleStack,
    count: &mut C,
    mut tets: impl FnMut(u32, &mut Q, &mut C) -> TetOutcome,
) {
    // In memory: compilers would rather make sixteen of each of its numbers before the walk, and store those.
    let prepared = black_box(prepared);
    let mut walk = SingleState {
        prepared,
        query,
        last: prepared.slabs.last,
        nearest: f32::INFINITY,
        pending: Candidate::NONE,
    };
    if walked != NONE {
        walk.take_over(ray);
    }
    let node_base = object.node_base();
    let mut code = object.header.root;
    let mut stack = stack.start(code);
    // Keys of the stack beyond this are of no interest any more.
    let mut limit = key_limit(walk.last);
    loop {
        // In registers for as long as no leaf is entered.
        let planes = RaySlabLanes::new(s, &prepared.slabs);
        while code & Child::LEAF_BIT == 0 {
            count.node();
            let node = N::node(node_base, code);
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
            prefetch(s, nodes, node_base, stack.below());
        }
        let mut unpacked = None;
        let done = if let Some(leaf) = indexed_leaf(object, node_base, code, &mut unpacked) {
            count.leaf();
            count.triangles(leaf.triangles);
            enter_leaf(s, object, || ray, &mut walk, (leaf, code)) == LeafOutcome::Done
        } else {
            let mut unpacked = None;
            match Child::from_code(code) {
                Some(Child::Raw(at)) => {
                    let leaf = object.raw(at, &mut unpacked);
                    count.leaf();
                    count.triangles(leaf.triangles);
                    enter_leaf(s, object, || ray, &mut walk, (leaf, code)) == LeafOutcome::Done
                }
                Some(Child::Tets(row)) if row != walked => {
                    let subtree = object.tet_leaves[row as usize].subtree;
                    if subtree != NONE {
                        code = subtree;
                        continue;
                    }
                    count.leaf();
                    decide(object, ray, &mut walk, NONE, 0);
                    let done = tets(row, walk.query, count) == TetOutcome::Done;
                    walk.take_over(ray);
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
    if walk.pending.leaf != NONE {
        settle_one(object, ray, walk.pending, walk.query);
    }
}
