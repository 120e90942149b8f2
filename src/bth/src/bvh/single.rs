//! Traversal of the wide BVH by a single ray.
//!
//! There are no other rays whose work could hide latencies, so the length of the dependency chain
//! from step to step decides the speed. The nearest certain hit is therefore kept with f32 bounds
//! of its depth, and its t, u and v are computed in f64 once, at the end ([`super::certain_hit`]).

use super::certain_hit::CertainHit;
use super::guesses::Guesses;
use super::leaf::{CodedLeaf, LeafOutcome, RayProgress, decide, enter_leaf};
use super::nodes::{Leaf, LeafMemory, leaf, prefetch};
use super::ray_state::key_limit;
use super::single_stack::{OpenSingleStack, SingleStack};
use crate::bvh::candidate::Candidate;
use crate::intersect::boxes::RaySlabLanes;
use crate::intersect::exact_ray::ExactRay;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Count, Goal, RayQuery};
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::{Child, NONE, WIDTH};
use bth_format::object::{NodeBase, ObjectBounds, ObjectView};
use std::hint::black_box;

/// What a single ray has found.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SingleResult {
    /// What its query holds; nothing if it was not constructed.
    OfQuery,
    /// The nearest hit, which is certain.
    Certain(CertainHit),
    /// A triangle that is certainly hit, which completes an any-hit query.
    Accepted,
}

/// State of the ray. All fields but the query stay in registers.
struct SingleState<'a, G: Goal> {
    prepared: &'a PreparedRay,
    goal: G,
    /// Constructed by the first decision in f64, which most rays never need.
    query: &'a mut Option<RayQuery<G>>,
    accepted: bool,
    /// Upper limit of the depths of hits that can still change the result.
    last: f32,
    /// Lower bound of the depth of the nearest hit so far.
    nearest: f32,
    /// The nearest hit so far if its t, u and v are not yet computed, else [`Candidate::NONE`].
    pending: Candidate,
}

impl<G: Goal> RayProgress<G> for SingleState<'_, G> {
    #[inline(always)]
    fn goal(&self) -> G {
        self.goal
    }
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
    fn query(&mut self, ray: &Ray) -> &mut RayQuery<G> {
        self.query.get_or_insert_with(|| RayQuery::new(self.goal, ray))
    }
    #[inline(always)]
    fn accept(&mut self) {
        self.accepted = true;
    }
}

/// A ray, the object that it goes through, and where the last rays went.
pub(crate) struct RayInObject<'a> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) ray: ExactRay<'a>,
    pub(crate) guesses: &'a Guesses,
}

/// What a single ray looks for, and its query once that is needed.
pub(crate) struct SingleQuery<'a, G: Goal> {
    pub(crate) goal: G,
    pub(crate) query: &'a mut Option<RayQuery<G>>,
}

/// Traverses the BVH of an object from its root. `bounds` are those for which the ray was prepared.
///
/// This is one kernel, longer than other functions: its variables must stay in registers across all
/// steps, and a function boundary or one struct of all parameters between the steps was measured to
/// be slower. A reference that is a parameter aliases nothing, but one in a larger struct may.
#[inline(always)]
pub(crate) fn trace_single<S: Simd, G: Goal, C: Count>(
    s: S,
    RayInObject { object, ray, guesses }: RayInObject<'_>,
    prepared: &PreparedRay,
    bounds: &ObjectBounds,
    SingleQuery { goal, query }: SingleQuery<'_, G>,
    stack: &mut SingleStack,
    count: &mut C,
) -> SingleResult {
    // Kept in memory: the compiler would otherwise broadcast each number to sixteen lanes before
    // the loop and spill the vectors.
    let prepared = black_box(prepared);
    let mut state = SingleState {
        prepared,
        goal,
        query,
        accepted: false,
        last: prepared.slabs.last,
        nearest: f32::INFINITY,
        pending: Candidate::NONE,
    };
    let node_base = object.node_base();
    let mut code = object.header.root;
    let mut stack = stack.start(code);
    // Stack entries with a greater key are dropped.
    let mut limit = key_limit(state.last);
    loop {
        let nodes = SingleNodes { node_base, guesses, last: state.last, limit };
        code = descend(s, prepared, nodes, code, goal, &mut stack, count);
        let mut memory = LeafMemory::default();
        let done = match leaf(s, object, node_base, code, &mut memory) {
            Leaf::Indexed(block) => {
                count.leaf();
                count.triangles(block.triangles);
                let leaf = CodedLeaf { block, code };
                enter_leaf(s, object, goal, bounds, ray, &mut state, leaf) == LeafOutcome::Done
            }
            _ if stack.is_empty() => break,
            Leaf::Raw(block) => {
                count.leaf();
                count.triangles(block.triangles);
                let leaf = CodedLeaf { block, code };
                enter_leaf(s, object, goal, bounds, ray, &mut state, leaf) == LeafOutcome::Done
            }
            Leaf::Special(leaf) => {
                count.leaf();
                decide(s, object, ray, bounds, &mut state, (NONE, 0));
                let done = leaf.enter(object, ray, state.query(ray.ray), count);
                state.update_from_query(ray.ray, bounds.origin_error);
                done
            }
            // A code of a file that was not checked.
            Leaf::None => false,
        };
        if done || stack.is_last() {
            break;
        }
        limit = key_limit(state.last);
        code = stack.pop(limit, goal);
    }
    if state.accepted {
        SingleResult::Accepted
    } else if state.pending.leaf != NONE {
        SingleResult::Certain(CertainHit { candidate: state.pending, norm: prepared.slabs.scale })
    } else {
        SingleResult::OfQuery
    }
}

/// The nodes of an object, and which of them a single ray need not enter.
struct SingleNodes<'a> {
    node_base: NodeBase<'a>,
    guesses: &'a Guesses,
    /// Deeper hits cannot change the result.
    last: f32,
    /// Stack entries with a greater key cannot, either.
    limit: f32,
}

/// Descends to the next leaf or to the bottom of the stack. Returns that code.
#[inline(always)]
fn descend<S: Simd, G: Goal, C: Count>(
    s: S,
    prepared: &PreparedRay,
    SingleNodes { node_base, guesses, last, limit }: SingleNodes<'_>,
    mut code: u32,
    goal: G,
    stack: &mut OpenSingleStack<'_>,
    count: &mut C,
) -> u32 {
    // These broadcasts stay in registers.
    let planes = RaySlabLanes::new(s, &prepared.slabs);
    while code & Child::LEAF_BIT == 0 {
        let Some(node) = node_base.wide_node(code) else { break };
        count.node();
        let guess = guesses.of(code, goal);
        let (bits, enter) = planes.children_soon(s, node, last);
        if bits == 0 {
            code = stack.pop(limit, goal);
            continue;
        }
        // For an any-hit query stacking is so cheap that one branch less is faster.
        if !goal.is_any() && bits & (bits - 1) == 0 {
            code = guess.corrected(node.child[bits.trailing_zeros() as usize % WIDTH]);
            continue;
        }
        let free = stack.free_entries();
        let children = s.load_u(&node.child);
        if goal.is_any() {
            // The last slot is entered first, as from the stack: compiled files hold the child
            // there in which a hit is most likely.
            let last = u32::BITS - 1 - bits.leading_zeros();
            code = guess.corrected(node.child[last as usize % WIDTH]);
            let others = s.compress(bits ^ 1 << last, children, free.codes);
            free.push(others + 1);
        } else {
            let (count, nearest) = s.sort_far_to_near(bits, enter, children, free.codes, free.keys);
            code = guess.corrected(node.child[nearest % WIDTH]);
            free.push(count);
        }
        // The entry below the new top is most often needed next.
        prefetch(s, node_base, stack.below());
    }
    code
}
