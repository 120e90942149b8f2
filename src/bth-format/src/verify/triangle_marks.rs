//! Marks of triangles by their ids in the source.

use std::collections::HashMap;

/// Ids in a page.
const PAGE: u32 = 64;

/// Bits per triangle. Memory is proportional to the triangles that are marked: the number of
/// triangles in the header of an untrusted file is no reason to allocate.
#[derive(Debug, Default)]
pub(super) struct TriangleMarks {
    pages: HashMap<u32, [u8; PAGE as usize]>,
}

impl TriangleMarks {
    /// The triangle lies in a triangle leaf of the tree or is a constrained face.
    pub(super) const PLACED: u8 = 1;
    /// The triangle lies in the subtree of a tet leaf.
    pub(super) const IN_SUBTREE: u8 = 2;

    /// Returns true if a triangle has a mark.
    pub(super) fn has(&self, id: u32, mark: u8) -> bool {
        self.pages.get(&(id / PAGE)).is_some_and(|page| page[(id % PAGE) as usize] & mark != 0)
    }

    /// Marks a triangle; returns false if it had the mark already.
    pub(super) fn mark(&mut self, id: u32, mark: u8) -> bool {
        let page = self.pages.entry(id / PAGE).or_insert([0; PAGE as usize]);
        let bits = &mut page[(id % PAGE) as usize];
        let new = *bits & mark == 0;
        *bits |= mark;
        new
    }

    /// Number of triangles that have a mark.
    pub(super) fn count(&self, mark: u8) -> usize {
        self.pages.values().flatten().filter(|bits| **bits & mark != 0).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_independent_and_counted_once() {
        let mut marks = TriangleMarks::default();
        assert!(marks.mark(u32::MAX, TriangleMarks::PLACED));
        assert!(!marks.mark(u32::MAX, TriangleMarks::PLACED));
        assert!(marks.mark(u32::MAX, TriangleMarks::IN_SUBTREE));
        assert!(marks.mark(0, TriangleMarks::PLACED));
        assert!(marks.has(0, TriangleMarks::PLACED) && !marks.has(0, TriangleMarks::IN_SUBTREE));
        assert!(!marks.has(1, TriangleMarks::PLACED));
        assert_eq!([1, 2].map(|mark| marks.count(mark)), [2, 1]);
    }
}
