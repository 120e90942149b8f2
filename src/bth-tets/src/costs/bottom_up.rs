//! The selection of max gain over all suitable nodes, none below another, by dynamic programming
//! from the leaves up.

use bth_bvh::BinaryBvh;

/// Candidate nodes in ascending order, with the gain of each.
pub(super) struct Candidates<'a> {
    pub(super) bvh: &'a BinaryBvh,
    pub(super) nodes: &'a [u32],
    pub(super) gains: &'a [f64],
}

impl Candidates<'_> {
    /// The first candidate after `k` that is not below it; candidates below a node follow it.
    fn end(&self, k: usize) -> usize {
        let after = self.nodes[k] + 2 * self.bvh.nodes[self.nodes[k] as usize].count - 1;
        k + self.nodes[k..].partition_point(|n| *n < after)
    }

    /// The selection of max gain, as rows of `nodes`.
    pub(super) fn best(&self) -> Vec<usize> {
        let count = self.nodes.len();
        // Max gain of the candidates from a row on: either the row is taken and the candidates
        // below it are skipped, or the row is skipped.
        let mut best = vec![0.0; count + 1];
        let mut taken = vec![false; count];
        for k in (0..count).rev() {
            let gain = self.gains[k];
            let with = gain + best[self.end(k)];
            taken[k] = gain > 0.0 && with > best[k + 1];
            best[k] = if taken[k] { with } else { best[k + 1] };
        }
        let (mut rows, mut k) = (Vec::new(), 0);
        while k < count {
            if taken[k] {
                rows.push(k);
            }
            k = if taken[k] { self.end(k) } else { k + 1 };
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::tree;
    use super::*;
    use proptest::prelude::*;

    /// Oracle: max gain over all selections, by trying every one.
    fn by_trying(c: &Candidates<'_>) -> f64 {
        let mut best = 0.0f64;
        'sets: for set in 0u32..1 << c.nodes.len() {
            let rows: Vec<usize> = (0..c.nodes.len()).filter(|k| set >> k & 1 == 1).collect();
            for pair in rows.windows(2) {
                let above = &c.bvh.nodes[c.nodes[pair[0]] as usize];
                if c.nodes[pair[1]] < c.nodes[pair[0]] + 2 * above.count - 1 {
                    continue 'sets;
                }
            }
            best = best.max(rows.iter().map(|&k| c.gains[k]).sum());
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_selection_gains_more(seed in any::<u64>(), saved in prop::collection::vec(-1.0..1.0f64, 11)) {
            let bvh = tree(seed, 40);
            let nodes: Vec<u32> = (0..bvh.nodes.len() as u32).filter(|i| bvh.nodes[*i as usize].count > 3).take(11).collect();
            let gains = &saved[..nodes.len()];
            let c = Candidates { bvh: &bvh, nodes: &nodes, gains };
            let gain: f64 = c.best().iter().map(|&k| gains[k]).sum();
            prop_assert!((gain - by_trying(&c)).abs() < 1e-9);
        }
    }
}
