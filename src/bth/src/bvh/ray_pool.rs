//! A pool of rays in the wide BVH that make one step each in turn, so that cache misses and branch
//! mispredictions of one ray overlap with the work of the others. [`super::interleaved`] starts the
//! rays and stores their answers.

use super::leaf::{CodedLeaf, LeafOutcome, enter_leaf};
use super::nodes::{Leaf, LeafMemory, is_large, leaf, prefetch, prefetch_into};
use super::ray_state::{RayState, write_children};
use super::stack::{BOTTOM, StackPosition, Stacks};
use crate::intersect::exact_ray::{ExactRay, Lines};
use crate::query::{Goal, RayQuery};
use crate::rays::Ray;
use crate::shortcuts::SpecialLeaf;
use crate::simd::{CacheLevel, Part, Simd};
use bth_format::layout::{Child, WIDTH};
use bth_format::object::ObjectView;

/// Number of rays in the pool.
pub(super) const POOL_SIZE: usize = 32;
/// Steps through inner nodes continue while at least this many rays have one as their next step.
const MIN_INNER: u8 = (POOL_SIZE / 4) as u8;

/// Returns true if the steps through the inner nodes of an object are [`RareSteps`]. Most nodes of
/// smaller objects are in the second level already, so they are fetched to the first: with a fetch
/// to the second, diffuse rays are slower.
#[inline(always)]
pub(super) fn has_rare_steps(object: &ObjectView<'_>) -> bool {
    is_large(object) && CacheLevel::waiting() == CacheLevel::Second
}

/// Slots of rays with the same kind of next step. Indices are `u8`, so the length 256 makes bounds
/// checks unnecessary; at most POOL_SIZE + 1 entries are used.
type StepList = [u8; 256];

/// The slots of the pool by the kind of their ray's next step.
struct StepLists {
    /// The next step enters an inner node.
    inner: StepList,
    /// The next step enters a leaf.
    leaf: StepList,
    /// The top of the stack is [`BOTTOM`], or the code of an empty child of a node.
    bottom: StepList,
}

/// Lengths of the three [`StepLists`], a byte each. Loops work on a copy, which stays in a
/// register.
#[derive(Clone, Copy, Debug)]
struct StepCounts(u32);

impl StepCounts {
    /// The lowest bit of each list's count.
    const INNER: u32 = 0;
    const LEAF: u32 = 8;
    const BOTTOM: u32 = 16;
    /// The increment for a code with the given upper three bits: codes of nodes are below 4, codes
    /// of leaves below 7.
    const INCREMENT: [u32; 8] = {
        let (inner, leaf, bottom) = (1 << Self::INNER, 1 << Self::LEAF, 1 << Self::BOTTOM);
        [inner, inner, inner, inner, leaf, leaf, leaf, bottom]
    };

    #[inline(always)]
    fn inner(self) -> u8 {
        (self.0 >> Self::INNER) as u8
    }
    #[inline(always)]
    fn leaf(self) -> u8 {
        (self.0 >> Self::LEAF) as u8
    }
    #[inline(always)]
    fn bottom(self) -> u8 {
        (self.0 >> Self::BOTTOM) as u8
    }
    /// Empties the list whose count begins at bit `at`, and returns its length. Its entries remain
    /// readable as long as not more entries are added than have been read.
    #[inline(always)]
    fn take(&mut self, at: u32) -> usize {
        let count = self.0 >> at & 0xff;
        self.0 -= count << at;
        count as usize
    }
}

const _: () = assert!(Child::LEAF_BIT == 4 << 29 && BOTTOM == 7 << 29);

impl StepLists {
    /// Adds a slot to the list of its next step, given the code on top of its stack. There is no
    /// branch: the slot is written to all lists, and one count grows.
    #[inline(always)]
    fn push(&mut self, counts: &mut StepCounts, slot: usize, code: u32) {
        self.inner[usize::from(counts.inner())] = slot as u8;
        self.leaf[usize::from(counts.leaf())] = slot as u8;
        self.bottom[usize::from(counts.bottom())] = slot as u8;
        counts.0 += StepCounts::INCREMENT[(code >> 29) as usize];
    }
}

/// The rays of a batch through an object, and where they start.
pub(super) struct PoolRays<'a> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) rays: &'a [Ray],
    pub(super) lines: Lines<'a>,
}

/// State of a ray, aligned to cache lines.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct PoolSlot<G>(RayState<G>);

impl<G: Goal> PoolSlot<G> {
    /// A slot without a ray.
    #[inline(always)]
    pub(super) fn vacant(goal: G) -> Self {
        let ray = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 };
        PoolSlot(RayState::vacant(RayQuery::new(goal, &ray)))
    }
}

/// Position and code of the top of each slot's stack. They are separate from the slots, because
/// every step begins with them and they fill few cache lines.
struct StackTops {
    position: [StackPosition; POOL_SIZE],
    code: [u32; POOL_SIZE],
}

/// The pool: a slot for each ray. The caller makes the slots in their final place; as a part of
/// this value they would be copied to it.
pub(super) struct RayPool<'a, G: Goal> {
    slots: &'a mut [PoolSlot<G>; POOL_SIZE],
    tops: StackTops,
    lists: StepLists,
    counts: StepCounts,
    stacks: &'a mut Stacks,
    goal: G,
    /// Position of the bottom of each slot's stack.
    bottoms: [StackPosition; POOL_SIZE],
}

impl<'a, G: Goal> RayPool<'a, G> {
    /// A pool of vacant slots, for the BVH of an object.
    #[inline(always)]
    pub(super) fn new(
        object: &ObjectView<'_>,
        slots: &'a mut [PoolSlot<G>; POOL_SIZE],
        stacks: &'a mut Stacks,
        goal: G,
    ) -> Self {
        stacks.reserve(object, POOL_SIZE);
        let mut bottoms = [StackPosition::FIRST; POOL_SIZE];
        for (stack, bottom) in bottoms.iter_mut().enumerate() {
            *bottom = stacks.bottom(stack);
        }
        // All slots are at the bottom of their stacks, as after a ray has finished, so the first
        // rays start like all others.
        let mut bottom = [0; 256];
        for slot in 0..POOL_SIZE {
            bottom[slot] = slot as u8;
        }
        RayPool {
            slots,
            tops: StackTops { position: bottoms, code: [BOTTOM; POOL_SIZE] },
            lists: StepLists { inner: [0; 256], leaf: [0; 256], bottom },
            counts: StepCounts((POOL_SIZE as u32) << StepCounts::BOTTOM),
            stacks,
            goal,
            bottoms,
        }
    }

    /// Returns true if no slot has a ray.
    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.counts.0 == 0
    }

    /// The ray of a slot.
    #[inline(always)]
    pub(super) fn state(&mut self, slot: usize) -> &mut RayState<G> {
        &mut self.slots[slot % POOL_SIZE].0
    }

    /// Starts the ray of a slot at a root.
    #[inline(always)]
    pub(super) fn start(&mut self, slot: usize, root: u32) {
        let slot = slot % POOL_SIZE;
        let top = self.stacks.start_at(self.bottoms[slot]);
        (self.tops.position[slot], self.tops.code[slot]) = (top, root);
        self.lists.push(&mut self.counts, slot, root);
    }

    /// Like [`Self::start`] for a root whose children were already tested, given their codes:
    /// `children` holds a bit for each child that the ray may hit, and the depths at which it
    /// enters them.
    #[inline(always)]
    pub(super) fn start_among<S: Simd>(
        &mut self,
        s: S,
        slot: usize,
        root: &[u32; WIDTH],
        children: (u32, S::F),
    ) {
        let slot = slot % POOL_SIZE;
        let top = self.stacks.start_at(self.bottoms[slot]);
        let count = write_children(s, self.goal, root, children, self.stacks.free_entries(top));
        let top = self.stacks.replaced(top, count);
        let code = self.stacks.code(top);
        (self.tops.position[slot], self.tops.code[slot]) = (top, code);
        self.lists.push(&mut self.counts, slot, code);
    }

    /// Empties the list of slots whose top is [`BOTTOM`] or an empty child, and returns its length.
    /// The caller passes each index below it to [`Self::finished`] in order, and starts at most one
    /// ray after each.
    #[inline(always)]
    pub(super) fn take_bottom(&mut self) -> usize {
        self.counts.take(StepCounts::BOTTOM)
    }

    /// The slot with index i in that list, if its ray is finished. Otherwise the empty child is
    /// popped, and the ray continues.
    #[inline(always)]
    pub(super) fn finished(&mut self, i: usize) -> Option<usize> {
        let slot = usize::from(self.lists.bottom[i]) % POOL_SIZE;
        let top = self.tops.position[slot];
        if top <= self.bottoms[slot] {
            return Some(slot);
        }
        let below = top.below();
        let code = self.stacks.code(below);
        (self.tops.position[slot], self.tops.code[slot]) = (below, code);
        self.lists.push(&mut self.counts, slot, code);
        None
    }

    /// Steps through inner nodes until few rays have one as their next step.
    #[inline(always)]
    pub(super) fn inner_steps<S: Simd>(&mut self, s: S, object: &ObjectView<'_>, level: CacheLevel) {
        let RayPool { slots, tops, lists, stacks, goal, .. } = self;
        let (mut counts, mut stacks, node_base) = (self.counts, stacks.open(), object.node_base());
        while counts.inner() > 0 {
            for i in 0..counts.take(StepCounts::INNER) {
                let slot = usize::from(lists.inner[i]) % POOL_SIZE;
                let (top, node) = (tops.position[slot], node_base.node(tops.code[slot]));
                let count = slots[slot].0.enter_node(s, *goal, node, stacks.free_entries(top));
                let top = stacks.replaced(top, count);
                let code = stacks.code(top);
                (tops.position[slot], tops.code[slot]) = (top, code);
                prefetch_into(s, level, node_base, code);
                lists.push(&mut counts, slot, code);
            }
            if counts.inner() < MIN_INNER && counts.leaf() | counts.bottom() > 0 {
                break;
            }
        }
        self.counts = counts;
    }

    /// Makes the step of each ray whose next step enters a leaf. `special` enters a
    /// [`SpecialLeaf`].
    #[inline(always)]
    pub(super) fn leaf_steps<S: Simd>(
        &mut self,
        s: S,
        PoolRays { object, rays, lines }: PoolRays<'_>,
        mut special: impl FnMut(SpecialLeaf, &mut RayState<G>) -> LeafOutcome,
    ) {
        let RayPool { slots, tops, lists, stacks, bottoms, goal, .. } = self;
        let (mut counts, node_base, goal) = (self.counts, object.node_base(), *goal);
        for i in 0..counts.take(StepCounts::LEAF) {
            let slot = usize::from(lists.leaf[i]) % POOL_SIZE;
            let state = &mut slots[slot].0;
            let (code, top) = (tops.code[slot], tops.position[slot]);
            let ray = state.ray();
            let exact_ray = ExactRay::new(&rays[ray], lines.of(ray));
            let mut memory = LeafMemory::default();
            let found = match leaf(s, object, node_base, code, &mut memory) {
                Leaf::Indexed(block) => {
                    let leaf = CodedLeaf { block, code };
                    enter_leaf(s, object, goal, &object.bounds, exact_ray, state, leaf)
                }
                Leaf::Raw(block) => {
                    let leaf = CodedLeaf { block, code };
                    enter_leaf(s, object, goal, &object.bounds, exact_ray, state, leaf)
                }
                Leaf::Special(leaf) => special(leaf, state),
                Leaf::None => LeafOutcome::Nothing,
            };
            let below = top.below();
            let top = match found {
                // Any-hit queries store no keys by which entries could be dropped.
                LeafOutcome::Nearer if goal.is_any() => below,
                LeafOutcome::Nothing => below,
                LeafOutcome::Nearer => stacks.keep_up_to(s, bottoms[slot], below, state.key_limit()),
                LeafOutcome::Done => bottoms[slot],
            };
            let code = stacks.code(top);
            (tops.position[slot], tops.code[slot]) = (top, code);
            prefetch(s, node_base, code);
            lists.push(&mut counts, slot, code);
        }
        self.counts = counts;
    }
}

/// [`RayPool::inner_steps`] through an object whose nodes wait in the second level of caches, as a
/// part of kernels: apart from the loop for all other objects, whose constants then stay in
/// registers.
pub(super) struct RareSteps<'p, 'a, 'o, G: Goal>(
    pub(super) &'p mut RayPool<'a, G>,
    pub(super) &'p ObjectView<'o>,
);

impl<S: Simd, G: Goal> Part<S> for RareSteps<'_, '_, '_, G> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let RareSteps(pool, object) = self;
        pool.inner_steps(s, object, CacheLevel::Second);
    }
}
