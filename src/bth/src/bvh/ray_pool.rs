//! Rays on their way through a wide BVH, a step of each in turn, so that cache misses and mispredictions of one overlap
//! with the work of the others. Where they come from and where they go is not known here.

use super::leaf::{LeafOutcome, enter_leaf};
use super::nodes::{Nodes, indexed_leaf, prefetch};
use super::ray_state::{RayState, write_children};
use super::stack::{BOTTOM, StackPosition, Stacks};
use crate::intersect::boxes::ChildBoxes;
use crate::query::Query;
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::Child;
use bth_format::object::ObjectView;

/// Rays on their way at once.
const POOL_SIZE: usize = 32;
/// While at least this many rays stand before inner nodes, those before leaves wait.
const ENOUGH: u8 = (POOL_SIZE / 4) as u8;

/// Slots of rays that wait for the same kind of step: as long as any `u8` reaches, and never fuller than there are rays in
/// way, and one.
type List = [u8; 256];

/// The rays on their way, by what they do next.
struct StepLists {
    inner: List,
    leaf: List,
    /// At the bottom of the stack, or before an empty slot of a node.
    bottom: List,
}

/// How many rays are in each of the [`StepLists`], a byte each. Loops count in a copy, which stays in a register.
#[derive(Clone, Copy, Debug)]
struct StepCounts(u32);

impl StepCounts {
    /// Where the counts lie: the lowest bit.
    const INNER: u32 = 0;
    const LEAF: u32 = 8;
    const BOTTOM: u32 = 16;
    /// What a code with these upper three bits adds: nodes are below 4, leaves below 7.
    const ADDED: [u32; 8] = {
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
    /// Empties the list whose count lies at these bits, and returns how many were in it. They can still be read if at most as
    /// many are added as were read.
    #[inline(always)]
    fn take(&mut self, at: u32) -> usize {
        let count = self.0 >> at & 0xff;
        self.0 -= count << at;
        count as usize
    }
}

const _: () = assert!(Child::LEAF_BIT == 4 << 29 && BOTTOM == 7 << 29);

impl StepLists {
    /// Adds a slot to the list that the code on top of its stack belongs in, without a branch.
    #[inline(always)]
    fn sort(&mut self, counts: &mut StepCounts, slot: usize, code: u32) {
        self.inner[usize::from(counts.inner())] = slot as u8;
        self.leaf[usize::from(counts.leaf())] = slot as u8;
        self.bottom[usize::from(counts.bottom())] = slot as u8;
        counts.0 += StepCounts::ADDED[(code >> 29) as usize];
    }
}

/// A ray in the pool, on cache lines of its own.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Slot<Q>(RayState<Q>);

/// What a step of a ray begins with, apart from the rest of the slots: few cache lines, always at hand.
struct StackTops {
    place: [StackPosition; POOL_SIZE],
    code: [u32; POOL_SIZE],
}

/// Rays on their way, a slot each.
pub(super) struct RayPool<'a, Q> {
    slots: [Slot<Q>; POOL_SIZE],
    tops: StackTops,
    lists: StepLists,
    counts: StepCounts,
    stacks: &'a mut Stacks,
    /// Of each slot's stack.
    bottoms: [StackPosition; POOL_SIZE],
}

impl<'a, Q: Query> RayPool<'a, Q> {
    /// Vacant slots, for the BVH of an object.
    #[inline(always)]
    pub(super) fn new(object: &ObjectView<'_>, stacks: &'a mut Stacks) -> Self {
        let vacant = Q::new(&Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 });
        stacks.reserve(object, POOL_SIZE);
        let mut bottoms = [StackPosition::FIRST; POOL_SIZE];
        for (stack, bottom) in bottoms.iter_mut().enumerate() {
            *bottom = stacks.bottom(stack);
        }
        // All slots are at the bottom of their stacks, as those of rays that have ended: so the first rays come in as all others do.
        let mut bottom = [0; 256];
        for at in 0..POOL_SIZE {
            bottom[at] = at as u8;
        }
        RayPool {
            slots: [Slot(RayState::vacant(vacant)); POOL_SIZE],
            tops: StackTops { place: bottoms, code: [BOTTOM; POOL_SIZE] },
            lists: StepLists { inner: [0; 256], leaf: [0; 256], bottom },
            counts: StepCounts((POOL_SIZE as u32) << StepCounts::BOTTOM),
            stacks,
            bottoms,
        }
    }

    /// Whether no ray is on its way.
    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.counts.0 == 0
    }

    /// The ray of a slot.
    #[inline(always)]
    pub(super) fn state(&mut self, at: usize) -> &mut RayState<Q> {
        &mut self.slots[at % POOL_SIZE].0
    }

    /// Sends the ray of a slot on its way from a root.
    #[inline(always)]
    pub(super) fn start(&mut self, at: usize, root: u32) {
        let at = at % POOL_SIZE;
        let top = self.stacks.start_at(self.bottoms[at]);
        (self.tops.place[at], self.tops.code[at]) = (top, root);
        self.lists.sort(&mut self.counts, at, root);
    }

    /// As [`Self::start`], where the ray may meet these children of the root, and enters them at these depths.
    #[inline(always)]
    pub(super) fn start_among<S: Simd, B: ChildBoxes>(
        &mut self,
        s: S,
        at: usize,
        root: &B,
        hit_cache: (u32, S::F),
    ) {
        let at = at % POOL_SIZE;
        let top = self.stacks.start_at(self.bottoms[at]);
        let count = write_children::<S, Q, B>(s, root, hit_cache, self.stacks.room(top));
        let top = self.stacks.replaced(top, count);
        let code = self.stacks.code(top);
        (self.tops.place[at], self.tops.code[at]) = (top, code);
        self.lists.sort(&mut self.counts, at, code);
    }

    /// How many rays have come to the bottom of their stacks, or before an empty slot of a node. They are to be asked for one
    /// after the other, and at most one ray started for each.
    #[inline(always)]
    pub(super) fn take_ended(&mut self) -> usize {
        self.counts.take(StepCounts::BOTTOM)
    }

    /// The slot of one of those, if it has come to the bottom; else it goes on.
    #[inline(always)]
    pub(super) fn ended(&mut self, i: usize) -> Option<usize> {
        let at = usize::from(self.lists.bottom[i]) % POOL_SIZE;
        let top = self.tops.place[at];
        if top <= self.bottoms[at] {
            return Some(at);
        }
        let below = top.below();
        let code = self.stacks.code(below);
        (self.tops.place[at], self.tops.code[at]) = (below, code);
        self.lists.sort(&mut self.counts, at, code);
        None
    }

    /// Steps through inner nodes until few rays stand before one.
    #[inline(always)]
    pub(super) fn inner_steps<S: Simd, N: Nodes>(&mut self, s: S, nodes: N, object: &ObjectView<'_>) {
        let RayPool { slots, tops, lists, stacks, .. } = self;
        let (mut counts, mut stacks, node_base) = (self.counts, stacks.open(), object.node_base());
        while counts.inner() > 0 {
            for i in 0..counts.take(StepCounts::INNER) {
                let at = usize::from(lists.inner[i]) % POOL_SIZE;
                let (top, node) = (tops.place[at], N::node(node_base, tops.code[at]));
                let count = slots[at].0.enter_node(s, node, stacks.room(top));
                let top = stacks.replaced(top, count);
                let code = stacks.code(top);
                (tops.place[at], tops.code[at]) = (top, code);
                prefetch(s, nodes, node_base, code);
                lists.sort(&mut counts, at, code);
            }
            if counts.inner() < ENOUGH && counts.leaf() | counts.bottom() > 0 {
                break;
            }
        }
        self.counts = counts;
    }

    /// Takes each ray that stands before a leaf through it. Tet leaves are handed to `tets`, with the ray and its place on the
    /// stack.
    #[inline(always)]
    pub(super) fn leaf_steps<S: Simd, N: Nodes>(
        &mut self,
        s: S,
        nodes: N,
        (object, rays): (&ObjectView<'_>, &[Ray]),
        mut tets: impl FnMut(u32, &mut RayState<Q>, StackPosition, &mut Stacks) -> LeafOutcome,
    ) {
        let RayPool { slots, tops, lists, stacks, bottoms, .. } = self;
        let (mut counts, node_base) = (self.counts, object.node_base());
        for i in 0..counts.take(StepCounts::LEAF) {
            let at = usize::from(lists.leaf[i]) % POOL_SIZE;
            let state = &mut slots[at].0;
            let (code, top) = (tops.code[at], tops.place[at]);
            let (place, mut unpacked) = (state.ray(), None);
            let found = if let Some(leaf) = indexed_leaf(object, node_base, code, &mut unpacked) {
                enter_leaf(s, object, || &rays[place], state, (leaf, code))
            } else {
                let mut unpacked = None;
                match Child::from_code(code) {
                    Some(Child::Raw(index)) => {
                        let leaf = object.raw(index, &mut unpacked);
                        enter_leaf(s, object, || &rays[place], state, (leaf, code))
                    }
                    Some(Child::Tets(row)) => tets(row, state, top, stacks),
                    _ => LeafOutcome::Nothing,
                }
            };
            let below = top.below();
            let top = match found {
                // Any-hit queries keep no keys, so nothing can be told of what waits.
                LeafOutcome::Nearer if Q::ANY => below,
                LeafOutcome::Nothing => below,
                LeafOutcome::Replaced => top,
                LeafOutcome::Nearer => stacks.keep_up_to(s, bottoms[at], below, state.key_limit()),
                LeafOutcome::Done => bottoms[at],
            };
            let code = stacks.code(top);
            (tops.place[at], tops.code[at]) = (top, code);
            prefetch(s, nodes, node_base, code);
            lists.sort(&mut counts, at, code);
        }
        self.counts = counts;
    }
}
