//! Stacks of children that wait to be entered, for many rays in one piece of memory.
#![allow(unsafe_code)] // Places are checked when they are made, once a step, and not again when they are used.

use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;
use bth_format::limits::MAX_DEPTH;
use bth_format::object::ObjectView;

/// The code at the bottom of a stack: of no child, like `NONE`, but its line can be prefetched (an address that is not
/// mapped costs a walk through the page tables).
pub(crate) const BOTTOM: u32 = 7 << 29;

/// Memory for stacks, kept from one batch to the next. An entry is a child code, and a lower bound of the t at which
/// the ray enters it. At the bottom of each stack lies [`BOTTOM`], which is never dropped.
///
/// Places are counted through all stacks. A file that is deeper than it says, which only unchecked files are, makes
/// a stack run into the next: rays go astray then, or tracing panics, but nothing is read or written outside.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    codes: Vec<u32>,
    keys: Vec<f32>,
    /// Entries of one stack.
    size: usize,
    /// What there is room for: levels of nodes, and stacks (none at first).
    depth: usize,
    count: usize,
}

/// A place in the stacks: at least [`LANES`] entries before the end of both vectors of the [`Stacks`] that made it. They
/// never become shorter, and a place is used with its own stacks only, within one batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StackPosition(usize);

impl StackPosition {
    /// A place that is not in use yet: the first of all.
    pub(crate) const FIRST: StackPosition = StackPosition(0);

    /// The place below, or the first of all.
    #[inline(always)]
    pub(crate) fn below(self) -> StackPosition {
        StackPosition(self.0.saturating_sub(1))
    }
}

impl Stacks {
    /// Makes room for this many stacks, at least one, for rays through an object.
    #[inline]
    pub(crate) fn reserve(&mut self, object: &ObjectView<'_>, count: usize) {
        self.reserve_for((object.header.depth as usize).min(MAX_DEPTH), count);
    }

    /// As [`Self::reserve`], for a BVH of so many levels of nodes.
    #[inline]
    pub(crate) fn reserve_for(&mut self, depth: usize, count: usize) {
        let count = count.max(1);
        if depth != self.depth || count > self.count {
            self.grow(depth, count);
        }
    }

    #[inline(never)]
    fn grow(&mut self, depth: usize, count: usize) {
        (self.depth, self.count) = (depth, count);
        // At every level all children but the one entered wait; whole vectors are written at the top. An odd
        // number of cache lines keeps the tops of the stacks out of each other's cache sets.
        let entries = 2 + depth * (WIDTH - 1) + LANES;
        self.size = (entries.div_ceil(LANES) | 1) * LANES;
        let total = self.size * count;
        if self.codes.len() < total {
            self.codes.resize(total, BOTTOM);
            self.keys.resize(total, 0.0);
        }
    }

    /// Checks a place.
    #[inline(always)]
    fn place(&self, at: usize) -> StackPosition {
        place(&self.codes, at)
    }

    /// The bottom of a stack.
    #[inline(always)]
    pub(crate) fn bottom(&self, stack: usize) -> StackPosition {
        self.place(stack * self.size)
    }

    /// Empties a stack and puts the root on it; returns the top.
    #[inline(always)]
    pub(crate) fn start(&mut self, stack: usize, root: u32) -> StackPosition {
        let bottom = stack * self.size;
        self.codes[bottom] = BOTTOM;
        self.codes[bottom + 1] = root;
        self.keys[bottom + 1] = f32::NEG_INFINITY;
        self.place(bottom + 1)
    }

    /// Empties the stack with this bottom; returns the place above it, for a root that is entered at once and need not be
    /// written.
    #[inline(always)]
    pub(crate) fn start_at(&mut self, bottom: StackPosition) -> StackPosition {
        self.codes[bottom.0] = BOTTOM;
        self.place(bottom.0 + 1)
    }

    /// The code at a place.
    #[inline(always)]
    pub(crate) fn code(&self, at: StackPosition) -> u32 {
        code(&self.codes, at)
    }

    /// Puts another code in the place of the one there.
    #[inline(always)]
    pub(crate) fn set_code(&mut self, at: StackPosition, code: u32) {
        self.codes[at.0] = code;
    }

    /// As [`OpenStacks::room`].
    #[inline(always)]
    pub(crate) fn room(&mut self, top: StackPosition) -> (&mut [u32; LANES], &mut [f32; LANES]) {
        let OpenStacks { codes, keys } = self.open();
        room(codes, keys, top)
    }

    /// The top after `count` entries were written in place of it.
    #[inline(always)]
    pub(crate) fn replaced(&self, top: StackPosition, count: usize) -> StackPosition {
        self.place((top.0 + count).wrapping_sub(1))
    }

    /// The stacks for a loop, which keeps at hand where they lie.
    #[inline(always)]
    pub(crate) fn open(&mut self) -> OpenStacks<'_> {
        OpenStacks { codes: &mut self.codes, keys: &mut self.keys }
    }

    /// Drops all entries above a bottom, up to the top, whose key exceeds the limit; returns the top.
    #[inline(always)]
    pub(crate) fn keep_up_to<S: Simd>(
        &mut self,
        s: S,
        bottom: StackPosition,
        top: StackPosition,
        limit: f32,
    ) -> StackPosition {
        let bottom = bottom.0;
        let range = bottom + 1..top.0.max(bottom) + 1;
        let kept = s.keep_up_to(&mut self.codes[range.clone()], &mut self.keys[range], limit);
        self.place(bottom + kept)
    }
}

/// [`Stacks`] whose vectors are at hand.
pub(crate) struct OpenStacks<'a> {
    codes: &'a mut [u32],
    keys: &'a mut [f32],
}

impl OpenStacks<'_> {
    /// The code at a place.
    #[inline(always)]
    pub(crate) fn code(&self, at: StackPosition) -> u32 {
        code(self.codes, at)
    }

    /// Room for the children of a node from the top on, which they replace.
    #[inline(always)]
    pub(crate) fn room(&mut self, top: StackPosition) -> (&mut [u32; LANES], &mut [f32; LANES]) {
        room(self.codes, self.keys, top)
    }

    /// The top after `count` entries were written in place of it.
    #[inline(always)]
    pub(crate) fn replaced(&self, top: StackPosition, count: usize) -> StackPosition {
        place(self.codes, (top.0 + count).wrapping_sub(1))
    }
}

/// Checks a place among the codes of stacks.
#[inline(always)]
fn place(codes: &[u32], at: usize) -> StackPosition {
    // Both vectors have this length, and `reserve` made it at least LANES.
    assert!(at <= codes.len() - LANES, "the BVH is deeper than its header says");
    StackPosition(at)
}

/// The code at a place of the stacks that these are all codes of.
#[inline(always)]
fn code(codes: &[u32], at: StackPosition) -> u32 {
    debug_assert!(at.0 < codes.len());
    // SAFETY: a place lies before the end of `codes`.
    unsafe { *codes.get_unchecked(at.0) }
}

/// The entries from a place on, of the stacks that these are all codes and keys of.
#[inline(always)]
fn room<'a>(
    codes: &'a mut [u32],
    keys: &'a mut [f32],
    top: StackPosition,
) -> (&'a mut [u32; LANES], &'a mut [f32; LANES]) {
    debug_assert!(top.0 + LANES <= codes.len() && top.0 + LANES <= keys.len());
    // SAFETY: a place has LANES entries from it on in both vectors, which are borrowed mutably together.
    unsafe {
        (
            &mut *codes.as_mut_ptr().add(top.0).cast::<[u32; LANES]>(),
            &mut *keys.as_mut_ptr().add(top.0).cast::<[f32; LANES]>(),
        )
    }
}
