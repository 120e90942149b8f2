//! Traversal stacks of interleaved rays and of packets, in one allocation.
#![allow(unsafe_code)] // A position is checked when it is made, once a step, and not again when it is used.

use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;
use bth_format::limits::MAX_DEPTH;
use bth_format::object::ObjectView;

/// The code at the bottom of a stack. It is the code of no child. Unlike `NONE` its address lies
/// near the file, so that a prefetch does not cause a walk through the page tables.
pub(crate) const BOTTOM: u32 = 7 << 29;

/// Memory of the stacks, kept from one batch to the next. An entry is a child code, and as its key
/// a lower bound of the depth at which the ray enters the child. At the bottom of each stack lies
/// [`BOTTOM`], which is never dropped.
///
/// Positions are indices into the memory of all stacks. In an unchecked file a BVH may be deeper
/// than its header states, and a stack may then grow into the next one: answers are wrong or
/// tracing panics, but nothing outside of the memory is read or written.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    codes: Vec<u32>,
    keys: Vec<f32>,
    /// Entries of one stack.
    size: usize,
    /// Levels of nodes that a stack has entries for.
    depth: usize,
    /// Number of stacks; 0 at first.
    count: usize,
}

/// Index of an entry, at least [`LANES`] entries before the end of both vectors of the [`Stacks`]
/// that made it. The vectors never become shorter, and a position is used only with the stacks that
/// made it, within one batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StackPosition(usize);

impl StackPosition {
    /// The first entry of all, for variables whose position is not yet set.
    pub(crate) const FIRST: StackPosition = StackPosition(0);

    /// The entry below, or the first of all.
    #[inline(always)]
    pub(crate) fn below(self) -> StackPosition {
        StackPosition(self.0.saturating_sub(1))
    }
}

impl Stacks {
    /// Allocates `count` stacks, at least one, for the BVH of an object.
    #[inline]
    pub(crate) fn reserve(&mut self, object: &ObjectView<'_>, count: usize) {
        self.reserve_for((object.header.depth as usize).min(MAX_DEPTH), count);
    }

    /// Like [`Self::reserve`], for a BVH with `depth` levels of nodes.
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
        // At every level all children but the entered one are stacked, and whole vectors are stored
        // at the top. An odd number of cache lines places the tops of the stacks in different sets
        // of the cache.
        let entries = 2 + depth * (WIDTH - 1) + LANES;
        self.size = (entries.div_ceil(LANES) | 1) * LANES;
        let total = self.size * count;
        if self.codes.len() < total {
            self.codes.resize(total, BOTTOM);
            self.keys.resize(total, 0.0);
        }
    }

    /// The position with this index.
    #[inline(always)]
    fn position(&self, at: usize) -> StackPosition {
        position(&self.codes, at)
    }

    /// The position of a stack's bottom.
    #[inline(always)]
    pub(crate) fn bottom(&self, stack: usize) -> StackPosition {
        self.position(stack * self.size)
    }

    /// Empties the stack with this bottom; returns the position above the bottom, where the
    /// children of the root are written. The root itself is not stored, because it is entered at
    /// once.
    #[inline(always)]
    pub(crate) fn start_at(&mut self, bottom: StackPosition) -> StackPosition {
        self.codes[bottom.0] = BOTTOM;
        self.position(bottom.0 + 1)
    }

    /// The code at a position.
    #[inline(always)]
    pub(crate) fn code(&self, at: StackPosition) -> u32 {
        code(&self.codes, at)
    }

    /// Like [`OpenStacks::free_entries`].
    #[inline(always)]
    pub(crate) fn free_entries(&mut self, top: StackPosition) -> (&mut [u32; LANES], &mut [f32; LANES]) {
        let OpenStacks { codes, keys } = self.open();
        free_entries(codes, keys, top)
    }

    /// The top after `count` entries were written from the old top on.
    #[inline(always)]
    pub(crate) fn replaced(&self, top: StackPosition, count: usize) -> StackPosition {
        self.position((top.0 + count).wrapping_sub(1))
    }

    /// The stacks for a loop: slices, whose addresses the loop keeps in registers.
    #[inline(always)]
    pub(crate) fn open(&mut self) -> OpenStacks<'_> {
        OpenStacks { codes: &mut self.codes, keys: &mut self.keys }
    }

    /// Removes the entries between `bottom` and `top` whose key exceeds `limit`, keeping the order
    /// of the others; returns the new top.
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
        self.position(bottom + kept)
    }
}

/// The vectors of [`Stacks`] as slices.
pub(crate) struct OpenStacks<'a> {
    codes: &'a mut [u32],
    keys: &'a mut [f32],
}

impl OpenStacks<'_> {
    /// The code at a position.
    #[inline(always)]
    pub(crate) fn code(&self, at: StackPosition) -> u32 {
        code(self.codes, at)
    }

    /// The entries from the top on, which the children of the entered node replace.
    #[inline(always)]
    pub(crate) fn free_entries(&mut self, top: StackPosition) -> (&mut [u32; LANES], &mut [f32; LANES]) {
        free_entries(self.codes, self.keys, top)
    }

    /// The top after `count` entries were written from the old top on.
    #[inline(always)]
    pub(crate) fn replaced(&self, top: StackPosition, count: usize) -> StackPosition {
        position(self.codes, (top.0 + count).wrapping_sub(1))
    }
}

/// The position with this index in the given codes. Panics where fewer than LANES entries follow.
#[inline(always)]
fn position(codes: &[u32], at: usize) -> StackPosition {
    // Both vectors have the length of `codes`, and `reserve` has made it at least LANES.
    assert!(at <= codes.len() - LANES, "the BVH is deeper than its header says");
    StackPosition(at)
}

/// The code at a position that was made for these codes.
#[inline(always)]
fn code(codes: &[u32], at: StackPosition) -> u32 {
    debug_assert!(at.0 < codes.len());
    // SAFETY: a position lies before the end of the vector for which it was made, which is `codes`.
    unsafe { *codes.get_unchecked(at.0) }
}

/// The LANES entries from a position on that was made for these codes and keys.
#[inline(always)]
fn free_entries<'a>(
    codes: &'a mut [u32],
    keys: &'a mut [f32],
    top: StackPosition,
) -> (&'a mut [u32; LANES], &'a mut [f32; LANES]) {
    debug_assert!(top.0 + LANES <= codes.len() && top.0 + LANES <= keys.len());
    // SAFETY: at least LANES entries follow from the position on in both vectors, which are
    // borrowed mutably together.
    unsafe {
        (
            &mut *codes.as_mut_ptr().add(top.0).cast::<[u32; LANES]>(),
            &mut *keys.as_mut_ptr().add(top.0).cast::<[f32; LANES]>(),
        )
    }
}
