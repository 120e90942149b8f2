//! Stacks of children that wait to be entered, for many rays in one piece of memory.

use crate::layout::{NONE, WIDTH};
use crate::limits::MAX_DEPTH;
use crate::object::ObjectView;
use crate::simd::{LANES, Simd};

/// Memory for stacks, kept from one batch to the next. An entry is a child code, and a lower bound of the t at which
/// the ray enters it. At the bottom of each stack lies `NONE`, which is never dropped.
///
/// Places are counted through all stacks. A file that is deeper than it says, which only unchecked files are, makes
/// a stack run into the next: rays go astray then, or tracing panics, but nothing is read or written outside.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    codes: Vec<u32>,
    keys: Vec<f32>,
    /// Entries of one stack.
    size: usize,
}

impl Stacks {
    /// Makes room for this many stacks for rays through an object.
    pub(crate) fn reserve(&mut self, object: &ObjectView<'_>, count: usize) {
        let depth = (object.header.depth as usize).min(MAX_DEPTH);
        // At every level all children but the one entered wait; whole vectors are written at the top. An odd
        // number of cache lines keeps the tops of the stacks out of each other's cache sets.
        let entries = 2 + depth * (WIDTH - 1) + LANES;
        self.size = (entries.div_ceil(LANES) | 1) * LANES;
        let total = self.size * count;
        if self.codes.len() < total {
            self.codes.resize(total, NONE);
            self.keys.resize(total, 0.0);
        }
    }

    /// The bottom of a stack.
    #[inline(always)]
    pub(crate) fn bottom(&self, stack: usize) -> usize {
        stack * self.size
    }

    /// Empties a stack and puts the root on it; returns the place of the top.
    #[inline(always)]
    pub(crate) fn start(&mut self, stack: usize, root: u32) -> usize {
        let bottom = self.bottom(stack);
        self.codes[bottom] = NONE;
        self.codes[bottom + 1] = root;
        self.keys[bottom + 1] = f32::NEG_INFINITY;
        bottom + 1
    }

    /// The code at a place.
    #[inline(always)]
    pub(crate) fn code(&self, top: usize) -> u32 {
        self.codes[top]
    }

    /// Puts another code in the place of the one there.
    #[inline(always)]
    pub(crate) fn set_code(&mut self, top: usize, code: u32) {
        self.codes[top] = code;
    }

    /// Room for the children of a node from a place on.
    #[inline(always)]
    pub(crate) fn room(&mut self, top: usize) -> (&mut [u32; LANES], &mut [f32; LANES]) {
        let codes = self.codes[top..].first_chunk_mut().expect("as many levels as the header says");
        let keys = self.keys[top..].first_chunk_mut().expect("as many levels as the header says");
        (codes, keys)
    }

    /// Drops all entries of a stack whose key exceeds the limit; returns the place of the top.
    #[inline(always)]
    pub(crate) fn keep_up_to<S: Simd>(&mut self, s: S, stack: usize, top: usize, limit: f32) -> usize {
        let range = self.bottom(stack) + 1..top + 1;
        let kept = s.keep_up_to(&mut self.codes[range.clone()], &mut self.keys[range], limit);
        self.bottom(stack) + kept
    }
}
