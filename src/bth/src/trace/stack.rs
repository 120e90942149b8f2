//! Stacks of children that wait to be entered, for many rays in one piece of memory.

use crate::layout::{NONE, WIDTH};
use crate::limits::MAX_DEPTH;
use crate::object::ObjectView;
use crate::simd::{LANES, Simd};

/// Memory for stacks, kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    codes: Vec<u32>,
    keys: Vec<f32>,
    /// Entries of one stack.
    size: usize,
}

/// The stack of one ray: child codes, and lower bounds of the t at which the ray enters them. At the bottom lies
/// `NONE`, which is never dropped.
pub(crate) struct Stack<'a> {
    codes: &'a mut [u32],
    keys: &'a mut [f32],
    /// Place of the top.
    top: usize,
}

impl Stacks {
    /// Makes room for this many stacks for rays through an object.
    pub(crate) fn reserve(&mut self, object: &ObjectView<'_>, count: usize) {
        let depth = (object.header.depth as usize).min(MAX_DEPTH);
        // At every level all children but the one entered wait; whole vectors are written at the top. An odd
        // number of cache lines keeps the tops of the stacks out of each other's cache sets.
        let entries = 1 + depth * (WIDTH - 1) + 1 + LANES;
        self.size = (entries.div_ceil(16) | 1) * 16;
        let total = self.size * count;
        if self.codes.len() < total {
            self.codes.resize(total, NONE);
            self.keys.resize(total, 0.0);
        }
    }

    /// Stack number `index`, whose top is at `top`.
    #[inline(always)]
    pub(crate) fn stack(&mut self, index: usize, top: usize) -> Stack<'_> {
        let range = index * self.size..(index + 1) * self.size;
        Stack { codes: &mut self.codes[range.clone()], keys: &mut self.keys[range], top }
    }
}

impl Stack<'_> {
    /// Empties the stack and puts the root on it.
    #[inline(always)]
    pub(crate) fn start(&mut self, root: u32) {
        (self.codes[0], self.keys[0]) = (NONE, f32::NEG_INFINITY);
        (self.codes[1], self.keys[1]) = (root, f32::NEG_INFINITY);
        self.top = 1;
    }

    /// Place of the top, to come back to.
    #[inline(always)]
    pub(crate) fn place(&self) -> usize {
        self.top
    }

    /// The code on top.
    #[inline(always)]
    pub(crate) fn code(&self) -> u32 {
        self.codes[self.top]
    }

    /// Whether nothing is left but the bottom.
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.top == 0
    }

    /// Leaves nothing but the bottom.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.top = 0;
    }

    /// Puts another code in the place of the one on top.
    #[inline(always)]
    pub(crate) fn set_code(&mut self, code: u32) {
        self.codes[self.top] = code;
    }

    /// Drops the top and returns it.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> u32 {
        let code = self.code();
        self.top -= usize::from(self.top > 0);
        code
    }

    /// Room for `N` entries from the top on, which they replace. Panics when the file says that it is less deep than it is.
    #[inline(always)]
    pub(crate) fn top<const N: usize>(&mut self) -> (&mut [u32; N], &mut [f32; N]) {
        let (Some(codes), Some(keys)) =
            (self.codes[self.top..].first_chunk_mut(), self.keys[self.top..].first_chunk_mut())
        else {
            panic!("the BVH is deeper than its header says");
        };
        (codes, keys)
    }

    /// After `count` entries have been written in place of the top.
    #[inline(always)]
    pub(crate) fn replace_top(&mut self, count: usize) {
        self.top = self.top + count - 1;
    }

    /// Drops all entries whose key exceeds the limit.
    #[inline(always)]
    pub(crate) fn keep_up_to<S: Simd>(&mut self, s: S, limit: f32) {
        let end = self.top + 1;
        self.top = s.keep_up_to(&mut self.codes[1..end], &mut self.keys[1..end], limit);
    }
}
