//! The traversal stack of a single ray.
#![allow(unsafe_code)] // Initializing the whole stack would take longer than the traversal of most rays.

use super::stack::BOTTOM;
use crate::query::Goal;
use crate::simd::LANES;
use bth_format::layout::WIDTH;
use bth_format::limits::MAX_DEPTH;
use std::mem::MaybeUninit;

/// Largest number of entries: at every level all children but the entered one are stacked, and
/// whole vectors are stored at the top.
const SIZE: usize = 2 + MAX_DEPTH * (WIDTH - 1) + LANES;

/// Memory for the stack of one ray, for the deepest BVH that a file may hold.
pub(crate) struct SingleStack {
    codes: [MaybeUninit<u32>; SIZE],
    keys: [MaybeUninit<f32>; SIZE],
}

impl SingleStack {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        SingleStack {
            codes: [const { MaybeUninit::uninit() }; SIZE],
            keys: [const { MaybeUninit::uninit() }; SIZE],
        }
    }

    /// Empties the stack and pushes [`BOTTOM`] and the root.
    #[inline(always)]
    pub(crate) fn start(&mut self, root: u32) -> OpenSingleStack<'_> {
        for (i, code) in [BOTTOM, root].into_iter().enumerate() {
            self.codes[i].write(code);
            self.keys[i].write(f32::NEG_INFINITY);
        }
        OpenSingleStack { codes: &mut self.codes, keys: &mut self.keys, top: 1 }
    }
}

/// Stack of child codes with keys, as in [`Stacks`](super::stack::Stacks). All entries up to `top`
/// are initialized.
pub(crate) struct OpenSingleStack<'a> {
    codes: &'a mut [MaybeUninit<u32>; SIZE],
    keys: &'a mut [MaybeUninit<f32>; SIZE],
    top: usize,
}

impl OpenSingleStack<'_> {
    /// Returns true if [`BOTTOM`] is the top.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.top == 0
    }

    /// Returns true if only [`BOTTOM`] lies below the top, so that nothing is left once the top is
    /// done.
    #[inline(always)]
    pub(crate) fn is_last(&self) -> bool {
        self.top <= 1
    }

    #[inline(always)]
    fn code(&self, at: usize) -> u32 {
        debug_assert!(at <= self.top);
        // SAFETY: `at` is at most `top`, as all callers pass `top` or less. `SingleStack::start`
        // initializes the entries 0 and 1 and sets `top` to 1. `top` grows only in
        // `FreeEntries::push`, by less than LANES, into entries that `free_entries` has initialized
        // before. So `at` lies within the arrays, and its entry is initialized.
        unsafe { self.codes.get_unchecked(at).assume_init() }
    }

    #[inline(always)]
    fn key(&self, at: usize) -> f32 {
        debug_assert!(at <= self.top);
        // SAFETY: as in `code`; both arrays are initialized together.
        unsafe { self.keys.get_unchecked(at).assume_init() }
    }

    /// The entries from the top on, which the children of the entered node replace.
    #[inline(always)]
    pub(crate) fn free_entries(&mut self) -> FreeEntries<'_> {
        assert!(self.top <= SIZE - LANES, "the BVH is deeper than its header says");
        // SAFETY: by the assertion, LANES entries begin at `top` in both arrays, which are borrowed
        // mutably for as long as the result lives. They are initialized before references to them
        // are made.
        unsafe {
            let codes = self.codes.as_mut_ptr().add(self.top).cast::<[u32; LANES]>();
            let keys = self.keys.as_mut_ptr().add(self.top).cast::<[f32; LANES]>();
            codes.write([0; LANES]);
            keys.write([0.0; LANES]);
            FreeEntries { codes: &mut *codes, keys: &mut *keys, top: &mut self.top }
        }
    }

    /// The code below the top.
    #[inline(always)]
    pub(crate) fn below(&self) -> u32 {
        self.code(self.top.saturating_sub(1))
    }

    /// Pops the top, and the entries below it whose key exceeds `limit` up to the first that does
    /// not; returns the new top's code.
    #[inline(always)]
    pub(crate) fn pop(&mut self, limit: f32, goal: impl Goal) -> u32 {
        self.top = self.top.saturating_sub(1);
        // Any-hit queries store no keys. The key of BOTTOM, negative infinity, exceeds no limit.
        while !goal.is_any() && limit < self.key(self.top) {
            self.top = self.top.saturating_sub(1);
        }
        self.code(self.top)
    }
}

/// Entries of an [`OpenSingleStack`] from the top on, to be overwritten.
pub(crate) struct FreeEntries<'a> {
    pub(crate) codes: &'a mut [u32; LANES],
    pub(crate) keys: &'a mut [f32; LANES],
    top: &'a mut usize,
}

impl FreeEntries<'_> {
    /// Completes the push of the first `count` entries, 1 to [`LANES`]: the last of them is the new
    /// top.
    #[inline(always)]
    pub(crate) fn push(self, count: usize) {
        *self.top += count.wrapping_sub(1) % LANES;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{AnyHit, EitherGoal, NearestHit};
    use bth_random::Rng;

    /// Random pushes and pops, compared with a vector of codes and keys.
    fn steps(rng: &mut Rng, goal: impl Goal) {
        let mut stack = SingleStack::new();
        let mut stack = stack.start(7);
        let mut expected = vec![(BOTTOM, f32::NEG_INFINITY), (7, f32::NEG_INFINITY)];
        for step in 0.. {
            if stack.is_empty() {
                break;
            }
            if step < 100 && rng.below(5) < 3 && expected.len() + LANES <= SIZE {
                let count = 1 + rng.below(LANES as u64) as usize;
                let free = stack.free_entries();
                expected.pop();
                for i in 0..count {
                    let entry = (rng.below(1 << 20) as u32, rng.below(100) as f32);
                    (free.codes[i], free.keys[i]) = entry;
                    expected.push(entry);
                }
                free.push(count);
                assert_eq!(stack.below(), expected[expected.len() - 2].0);
            } else {
                let limit = rng.below(100) as f32;
                expected.pop();
                while !goal.is_any() && expected.last().is_some_and(|&(_, key)| key > limit) {
                    expected.pop();
                }
                assert_eq!(stack.pop(limit, goal), expected.last().expect("the bottom stays").0);
            }
            assert_eq!(stack.is_empty(), expected.len() == 1);
            assert_eq!(stack.is_last(), expected.len() <= 2);
        }
        assert_eq!(stack.pop(0.0, goal), BOTTOM);
    }

    #[test]
    fn pops_return_entries_in_order_and_skip_those_beyond_the_limit() {
        let mut rng = Rng::new(3);
        for _ in 0..if cfg!(miri) { 3 } else { 200 } {
            steps(&mut rng, AnyHit);
            steps(&mut rng, NearestHit);
            steps(&mut rng, EitherGoal { is_any: true });
            steps(&mut rng, EitherGoal { is_any: false });
        }
    }

    #[test]
    #[should_panic = "deeper than its header says"]
    fn a_tree_deeper_than_the_limit_panics_before_a_write_outside() {
        let mut stack = SingleStack::new();
        let mut stack = stack.start(1);
        for _ in 0..SIZE {
            stack.free_entries().push(LANES);
        }
    }
}
