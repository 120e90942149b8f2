//! Work that is shared out over machines.

/// One of several machines, or of runs on one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// 1 to `of`.
    pub number: u32,
    /// Number of shards, at least 1.
    pub of: u32,
}

impl Shard {
    /// Returns true if the shard does this work, of a list that is counted from 0.
    #[must_use]
    pub fn has(self, work: u64) -> bool {
        work % u64::from(self.of) + 1 == u64::from(self.number)
    }
}
