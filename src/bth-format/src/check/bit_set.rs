//! A set of small integers.

/// One bit per row, line or half line.
pub(super) struct BitSet(Vec<u64>);

impl BitSet {
    /// The empty set of integers below `count`.
    pub(super) fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }
    /// Adds an integer; returns whether the set held it already.
    pub(super) fn insert(&mut self, i: usize) -> bool {
        let (word, bit) = (&mut self.0[i / 64], 1 << (i % 64));
        let held = *word & bit != 0;
        *word |= bit;
        held
    }
    /// Returns true if the set holds an integer.
    pub(super) fn contains(&self, i: usize) -> bool {
        self.0[i / 64] & (1 << (i % 64)) != 0
    }
}
