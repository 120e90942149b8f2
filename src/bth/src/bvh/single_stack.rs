//! The stack of a ray that is traced alone.
#![allow(unsafe_code)] // Clearing it would cost more than most rays.

use super::stack::BOTTOM;
use crate::query::Query;
use crate::simd::LANES;
use bth_format::layout::WIDTH;
use bth_format::limits::MAX_DEPTH;
use std::mem::MaybeUninit;

/// Entries: at every level all children but the one entered wait, and whole vectors are written at the top.
const SIZE: usize = 2 + MAX_DEPTH * (WIDTH - 1) + LANES;

/// Memory for the stack of one ray, in the deepest BVH that there may be.
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

    /// A stack with a root on top that is entered at once. Below it lies [`BOTTOM`].
    #[inline(always)]
    pub(crate) fn start(&mut self, root: u32) -> OpenSingleStack<'_> {
        for (i, code) in [BOTTOM, root].into_iter().enumerate() {
            self.codes[i].write(code);
            self.keys[i].write(f32::NEG_INFINITY);
        }
        OpenSingleStack { codes: &mut self.codes, keys: &mut self.keys, top: 1 }
    }
}

/// Children that wait to be entered, as in [`Stacks`](super::stack::Stacks). The entries up to the top have been written.
pub(crate) struct OpenSingleStack<'a> {
    codes: &'a mut [MaybeUninit<u32>; SIZE],
    keys: &'a mut [MaybeUninit<f32>; SIZE],
    top: usize,
}

impl OpenSingleStack<'_> {
    /// Whether nothing is left above [`BOTTOM`].
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.top == 0
    }

    #[inline(always)]
    fn code(&self, at: usize) -> u32 {
        debug_assert!(at <= self.top);
        // SAFETY: called for places up to the top only. Those have been written: the first two by `SingleStack::start`, the others by
        // `Self::room`, which clears all it lends, and a top is the first two's or lies among what was lent; so it is within.
        unsafe { self.codes.get_unchecked(at).assume_init() }
    }

    #[inline(always)]
    fn key(&self, at: usize) -> f32 {
        debug_assert!(at <= self.top);
        // SAFETY: as above.
        unsafe { self.keys.get_unchecked(at).assume_init() }
    }

    /// Room for the children of a node in place of the top.
    #[inline(always)]
    pub(crate) fn room(&mut self) -> Room<'_> {
        assert!(self.top <= SIZE - LANES, "the BVH is deeper than its header says");
        // SAFETY: as many entries as are LANES begin at the top of both arrays, which are borrowed mutably together. They are
        // cleared, so that all are initialized.
        unsafe {
            let codes = self.codes.as_mut_ptr().add(self.top).cast::<[u32; LANES]>();
            let keys = self.keys.as_mut_ptr().add(self.top).cast::<[f32; LANES]>();
            codes.write([0; LANES]);
            keys.write([0.0; LANES]);
            Room { codes: &mut *codes, keys: &mut *keys, top: &mut self.top }
        }
    }

    /// The code below the top.
    #[inline(always)]
    pub(crate) fn below(&self) -> u32 {
        self.code(self.top.saturating_sub(1))
    }

    /// Drops the top, and what lies below it as far as the keys exceed the limit; returns the code on top then.
    #[inline(always)]
    pub(crate) fn pop<Q: Query>(&mut self, limit: f32) -> u32 {
        self.top = self.top.saturating_sub(1);
        // Any-hit queries keep no keys. The key of BOTTOM exceeds no limit.
        while !Q::ANY && limit < self.key(self.top) {
            self.top = self.top.saturating_sub(1);
        }
        self.code(self.top)
    }
}

/// Entries of [`OpenSingleStack`] to be written, from the top on.
pub(crate) struct Room<'a> {
    pub(crate) codes: &'a mut [u32; LANES],
    pub(crate) keys: &'a mut [f32; LANES],
    top: &'a mut usize,
}

impl Room<'_> {
    /// Says how many were written, at least one: the last is the new top.
    #[inline(always)]
    pub(crate) fn keep(self, count: usize) {
        *self.top += count.wrapping_sub(1) % LANES;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::query::{Any, Nearest};
    use bth_random::Rng;

    /// Random steps, against a vector of codes and keys.
    fn steps<Q: Query>(rng: &mut Rng) {
        let mut stack = SingleStack::new();
        let mut stack = stack.start(7);
        let mut expected = vec![(BOTTOM, f32::NEG_INFINITY), (7, f32::NEG_INFINITY)];
        for step in 0.. {
            if stack.is_empty() {
                break;
            }
            if step < 100 && rng.below(5) < 3 && expected.len() + LANES <= SIZE {
                let count = 1 + rng.below(LANES as u64) as usize;
                let room = stack.room();
                expected.pop();
                for i in 0..count {
                    let entry = (rng.below(1 << 20) as u32, rng.below(100) as f32);
                    (room.codes[i], room.keys[i]) = entry;
                    expected.push(entry);
                }
                room.keep(count);
                assert_eq!(stack.below(), expected[expected.len() - 2].0);
            } else {
                let limit = rng.below(100) as f32;
                expected.pop();
                while !Q::ANY && expected.last().is_some_and(|&(_, key)| key > limit) {
                    expected.pop();
                }
                assert_eq!(stack.pop::<Q>(limit), expected.last().expect("the bottom stays").0);
            }
            assert_eq!(stack.is_empty(), expected.len() == 1);
        }
        assert_eq!(stack.pop::<Q>(0.0), BOTTOM);
    }

    #[test]
    fn what_waits_comes_back_in_order_but_for_what_lies_beyond_the_limit() {
        let mut rng = Rng::new(3);
        for _ in 0..if cfg!(miri) { 3 } else { 200 } {
            steps::<Any>(&mut rng);
            steps::<Nearest>(&mut rng);
        }
    }

    #[test]
    #[should_panic = "deeper than its header says"]
    fn a_deeper_tree_panics_and_writes_nothing_outside() {
        let mut stack = SingleStack::new();
        let mut stack = stack.start(1);
        for _ in 0..SIZE {
            stack.room().keep(LANES);
        }
    }
}
