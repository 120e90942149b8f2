//! Where the triangles of an object have been seen, in memory proportional to those that were: how many the object says
//! that it has is no reason to allocate.

use std::collections::HashMap;

/// Ids in a page.
const PAGE: u32 = 64;

/// Bits per triangle.
#[derive(Debug, Default)]
pub(super) struct Seen {
    pages: HashMap<u32, [u8; PAGE as usize]>,
}

impl Seen {
    /// The triangle lies in a leaf or is a constrained face.
    pub(super) const HOME: u8 = 1;
    /// The triangle lies in the subtree beside a tet leaf.
    pub(super) const SUBTREE: u8 = 2;

    /// Whether it is marked so.
    pub(super) fn is(&self, id: u32, mark: u8) -> bool {
        self.pages.get(&(id / PAGE)).is_some_and(|page| page[(id % PAGE) as usize] & mark != 0)
    }

    /// Marks it; false if it was marked so.
    pub(super) fn mark(&mut self, id: u32, mark: u8) -> bool {
        let page = self.pages.entry(id / PAGE).or_insert([0; PAGE as usize]);
        let bits = &mut page[(id % PAGE) as usize];
        let new = *bits & mark == 0;
        *bits |= mark;
        new
    }

    /// How many are marked so.
    pub(super) fn count(&self, mark: u8) -> usize {
        self.pages.values().flatten().filter(|bits| **bits & mark != 0).count()
    }
}
