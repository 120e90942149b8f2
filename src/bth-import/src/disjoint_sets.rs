//! Sets of rows that are joined step by step (union-find with path halving).

/// Rows, each in one set.
pub(crate) struct DisjointSets {
    /// For each row another one of its set, for one of each set itself.
    parents: Vec<u32>,
}

impl DisjointSets {
    /// Makes one set for each of `count` rows.
    pub(crate) fn new(count: usize) -> DisjointSets {
        DisjointSets { parents: (0..count as u32).collect() }
    }

    /// Returns the row that represents the set of a row.
    pub(crate) fn root(&mut self, mut row: u32) -> u32 {
        let parents = &mut self.parents;
        while parents[row as usize] != row {
            parents[row as usize] = parents[parents[row as usize] as usize];
            row = parents[row as usize];
        }
        row
    }

    /// Joins the sets of the corners of a triangle. Returns how many sets are gone. The smaller row
    /// becomes the root, which keeps the forest shallow on meshes whose rows are in order of first
    /// use.
    pub(crate) fn join(&mut self, [a, b, c]: [u32; 3]) -> u64 {
        let mut gone = 0;
        let mut first = self.root(a);
        for corner in [b, c] {
            let other = self.root(corner);
            if first != other {
                let (low, high) = (first.min(other), first.max(other));
                self.parents[high as usize] = low;
                first = low;
                gone += 1;
            }
        }
        gone
    }
}
