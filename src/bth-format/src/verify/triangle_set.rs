//! A set of triangles by their ids in the source.

use std::collections::HashMap;

/// A set of triangles, one bit each. Memory is proportional to the triangles that it holds: the
/// number of triangles in the header of an untrusted file is no reason to allocate.
#[derive(Debug, Default)]
pub(super) struct TriangleSet {
    pages: HashMap<u32, u64>,
}

impl TriangleSet {
    /// Returns true if the set holds a triangle.
    pub(super) fn has(&self, id: u32) -> bool {
        self.pages.get(&(id / 64)).is_some_and(|page| page & 1 << (id % 64) != 0)
    }

    /// Adds a triangle; returns false if the set held it already.
    pub(super) fn insert(&mut self, id: u32) -> bool {
        let page = self.pages.entry(id / 64).or_default();
        let before = *page;
        *page |= 1 << (id % 64);
        *page != before
    }

    /// Number of triangles in the set.
    pub(super) fn len(&self) -> usize {
        self.pages.values().map(|page| page.count_ones() as usize).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_counted_once() {
        let mut set = TriangleSet::default();
        assert!(set.insert(u32::MAX) && !set.insert(u32::MAX) && set.insert(0));
        assert!(set.has(0) && set.has(u32::MAX) && !set.has(1));
        assert_eq!(set.len(), 2);
    }
}
