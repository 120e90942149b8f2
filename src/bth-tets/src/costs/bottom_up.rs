//! The selection of max gain over all suitable nodes, none below another, by dynamic programming
//! from the leaves up.
//!
//! Under limits two selections are made and the better one is taken. The first solves the knapsack
//! problem with the limits divided into steps: exact except for rounding up to steps, and therefore
//! good for few large nodes. The second uses prices for bytes and seconds (Lagrange multipliers),
//! which take nodes in the order of gain per unit, and therefore is good for many small nodes.

use super::gains::Gain;
use bth_bvh::BinaryBvh;

/// Bisections of the interval in which a price lies.
const HALVINGS: usize = 48;
/// Steps of a limit: where there is one limit, and of each where there are two.
const ONE_STEPS: usize = 256;
const BOTH_STEPS: usize = 31;

/// Candidate nodes in ascending order, with the gain and the cost of each.
pub(super) struct Candidates<'a> {
    pub(super) bvh: &'a BinaryBvh,
    pub(super) nodes: &'a [u32],
    pub(super) gains: &'a [Gain],
    /// Bytes and seconds of the tetrahedra of each node.
    pub(super) takes: &'a [[f64; 2]],
}

impl Candidates<'_> {
    /// The best selection within the limits on bytes and seconds, as rows of `nodes`.
    pub(super) fn best(&self, limits: [Option<f64>; 2]) -> Vec<usize> {
        let free = self.selection([0.0; 2]);
        let over = |rows: &[usize], kind: usize| {
            limits[kind].is_some_and(|limit| rows.iter().map(|&k| self.takes[k][kind]).sum::<f64>() > limit)
        };
        if !over(&free, 0) && !over(&free, 1) {
            return free;
        }
        let priced = self.priced(over);
        let packed = self.packed(limits);
        let gain = |rows: &[usize]| rows.iter().map(|&k| self.gains[k].saved).sum::<f64>();
        if gain(&packed) > gain(&priced) { packed } else { priced }
    }

    /// Finds by bisection the smallest prices whose selection is within all limits.
    fn priced(&self, over: impl Fn(&[usize], usize) -> bool) -> Vec<usize> {
        let mut prices = [0.0; 2];
        let mut best = self.selection(prices);
        for kind in 0..2 {
            if !over(&best, kind) {
                continue;
            }
            // At a price above the max gain per unit no node is selected.
            let worth = (0..self.nodes.len()).map(|k| self.gains[k].saved / self.takes[k][kind]);
            let (mut low, mut high) = (0.0, worth.fold(0.0, f64::max));
            best = Vec::new();
            for _ in 0..HALVINGS {
                prices[kind] = 0.5 * (low + high);
                let rows = self.selection(prices);
                if over(&rows, kind) {
                    low = prices[kind];
                } else {
                    (high, best) = (prices[kind], rows);
                }
            }
            prices[kind] = high;
        }
        best
    }

    /// The selection by dynamic programming over the limits in steps; the steps of each node are
    /// rounded up.
    fn packed(&self, limits: [Option<f64>; 2]) -> Vec<usize> {
        let count = self.nodes.len();
        let steps = match limits {
            [Some(_), Some(_)] => [BOTH_STEPS; 2],
            _ => limits.map(|limit| if limit.is_some() { ONE_STEPS } else { 0 }),
        };
        let width = (steps[0] + 1) * (steps[1] + 1);
        let cell = |room: [usize; 2]| room[0] * (steps[1] + 1) + room[1];
        let rooms = || (0..=steps[0]).flat_map(|a| (0..=steps[1]).map(move |b| [a, b]));
        // Steps that a node takes; more than there are if it does not fit.
        let taken = |k: usize| {
            [0, 1].map(|kind| match limits[kind] {
                None => 0,
                Some(limit) if self.takes[k][kind] > limit => steps[kind] + 1,
                Some(limit) => (self.takes[k][kind] / limit * steps[kind] as f64).ceil() as usize,
            })
        };
        // Max gain of the candidates from a row on, by the steps that are left.
        let mut best = vec![0.0f64; (count + 1) * width];
        let with = |best: &[f64], k: usize, room: [usize; 2]| {
            let [a, b] = taken(k);
            let left = [room[0].checked_sub(a)?, room[1].checked_sub(b)?];
            Some((self.gains[k].saved + best[self.end(k) * width + cell(left)], left))
        };
        for k in (0..count).rev() {
            for room in rooms() {
                let without = best[(k + 1) * width + cell(room)];
                let with = with(&best, k, room).map_or(0.0, |(gain, _)| gain);
                best[k * width + cell(room)] = without.max(with);
            }
        }
        let (mut rows, mut k, mut room) = (Vec::new(), 0, steps);
        while k < count {
            let without = best[(k + 1) * width + cell(room)];
            match with(&best, k, room) {
                Some((gain, left)) if gain > without => {
                    rows.push(k);
                    (k, room) = (self.end(k), left);
                }
                _ => k += 1,
            }
        }
        rows
    }

    /// The first candidate after `k` that is not below it; candidates below a node follow it.
    fn end(&self, k: usize) -> usize {
        let after = self.nodes[k] + 2 * self.bvh.nodes[self.nodes[k] as usize].count - 1;
        k + self.nodes[k..].partition_point(|n| *n < after)
    }

    /// The selection of max gain after subtracting the prices of its bytes and seconds.
    fn selection(&self, prices: [f64; 2]) -> Vec<usize> {
        let count = self.nodes.len();
        let net =
            |k: usize| self.gains[k].saved - prices[0] * self.takes[k][0] - prices[1] * self.takes[k][1];
        // Max gain of the candidates from a row on: either the row is taken and the candidates
        // below it are skipped, or the row is skipped.
        let mut best = vec![0.0; count + 1];
        let mut taken = vec![false; count];
        for k in (0..count).rev() {
            let with = net(k) + best[self.end(k)];
            taken[k] = net(k) > 0.0 && with > best[k + 1];
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

    /// Oracle: max gain within the limits over all selections, by trying every one.
    fn by_trying(c: &Candidates<'_>, limits: [Option<f64>; 2]) -> f64 {
        let mut best = 0.0f64;
        'sets: for set in 0u32..1 << c.nodes.len() {
            let rows: Vec<usize> = (0..c.nodes.len()).filter(|k| set >> k & 1 == 1).collect();
            for pair in rows.windows(2) {
                let above = &c.bvh.nodes[c.nodes[pair[0]] as usize];
                if c.nodes[pair[1]] < c.nodes[pair[0]] + 2 * above.count - 1 {
                    continue 'sets;
                }
            }
            let takes = |kind: usize| rows.iter().map(|&k| c.takes[k][kind]).sum::<f64>();
            if (0..2).all(|kind| limits[kind].is_none_or(|limit| takes(kind) <= limit)) {
                best = best.max(rows.iter().map(|&k| c.gains[k].saved).sum());
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn no_selection_gains_more_and_limits_hold(
            seed in any::<u64>(), saved in prop::collection::vec(-1.0..1.0f64, 11), limit in 0.0..40.0f64
        ) {
            let bvh = tree(seed, 40);
            let nodes: Vec<u32> = (0..bvh.nodes.len() as u32).filter(|i| bvh.nodes[*i as usize].count > 3).take(11).collect();
            let gains: Vec<Gain> = (0..nodes.len()).map(|k| Gain { saved: saved[k], ..Gain::default() }).collect();
            let takes: Vec<[f64; 2]> =
                nodes.iter().map(|n| [f64::from(bvh.nodes[*n as usize].count), 1.0]).collect();
            let c = Candidates { bvh: &bvh, nodes: &nodes, gains: &gains, takes: &takes };
            let gain = |rows: &[usize]| rows.iter().map(|&k| gains[k].saved).sum::<f64>();
            let free = c.best([None, None]);
            prop_assert!((gain(&free) - by_trying(&c, [None, None])).abs() < 1e-9);

            let limited = c.best([Some(limit), None]);
            let bytes: f64 = limited.iter().map(|&k| takes[k][0]).sum();
            prop_assert!(bytes <= limit);
            let most = by_trying(&c, [Some(limit), None]);
            prop_assert!(gain(&limited) <= most + 1e-9);
            // Rounding up adds at most one step for each node.
            let less = limit * (1.0 - nodes.len() as f64 / ONE_STEPS as f64);
            prop_assert!(gain(&limited) >= by_trying(&c, [Some(less), None]) - 1e-9);
            // Limits that all candidates together keep do not change the selection.
            let all: f64 = takes.iter().map(|t| t[0]).sum();
            prop_assert_eq!(c.best([Some(all), None]), free);
        }
    }
}
