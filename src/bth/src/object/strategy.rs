//! Which of two ways to trace is the faster: found out by trying both on the caller's own batches.
//!
//! Whether rays that start on a surface are faster through tetrahedra or through the BVH beside them depends on the
//! model, the rays, the caches and the gathers of the machine: ratios from 0.5 to 1.3 have been measured
//! (docs/notes/tets.md). Answers are the same bits either way, so the choice can be left to the clock. The slower way is tried
//! again now and then, ever more seldom while nothing changes: in the long run it takes one batch in 256.

use std::time::Instant;

/// A way to trace rays that start on known surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    Bvh,
    Tets,
}

/// Batches of fewer rays are too short for the clock: they take the way that is thought the faster, and teach nothing.
pub(crate) const FEWEST_MEASURED_RAYS: usize = 256;
/// Batches by which both ways are tried in turn before any choice. The first two warm the caches, and do not count.
const TRIALS: u32 = 8;
const WARM_UP: u32 = 2;
/// Batches until the slower way is tried again, at first and at last.
const FIRST_WAIT: u32 = 32;
const LAST_WAIT: u32 = 256;

/// What has been measured so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrategyChoice {
    /// Seconds a ray, of either way.
    cost: [Option<f64>; 2],
    batches: u32,
    /// Batches until the slower way is tried again, and how many there will be the next time.
    left: u32,
    wait: u32,
}

impl StrategyChoice {
    pub(crate) fn new() -> StrategyChoice {
        StrategyChoice { cost: [None; 2], batches: 0, left: FIRST_WAIT, wait: FIRST_WAIT }
    }

    /// The way that is thought the faster.
    pub(crate) fn best(&self) -> Strategy {
        match self.cost {
            [Some(bvh), Some(tets)] if tets < bvh => Strategy::Tets,
            _ => Strategy::Bvh,
        }
    }

    /// The way that the next batch is to take.
    pub(crate) fn next(&mut self) -> Strategy {
        let best = self.best();
        if self.batches < TRIALS {
            return if self.batches.is_multiple_of(2) { Strategy::Bvh } else { Strategy::Tets };
        }
        if self.left > 0 {
            self.left -= 1;
            return best;
        }
        self.left = self.wait;
        if best == Strategy::Bvh { Strategy::Tets } else { Strategy::Bvh }
    }

    /// Learns what a batch took.
    pub(crate) fn learn(&mut self, way: Strategy, seconds_a_ray: f64) {
        self.batches = self.batches.saturating_add(1);
        if self.batches <= WARM_UP {
            return;
        }
        let before = self.best();
        let cost = &mut self.cost[way as usize];
        // The thread may have been interrupted: of the first trials the least counts, later nothing as more than twice
        // what was expected, and less than that more readily.
        *cost = Some(match *cost {
            None => seconds_a_ray,
            Some(cost) if self.batches <= TRIALS => cost.min(seconds_a_ray),
            Some(cost) if seconds_a_ray < cost => (cost + seconds_a_ray) / 2.0,
            Some(cost) => cost + (seconds_a_ray.min(2.0 * cost) - cost) / 8.0,
        });
        if self.batches > TRIALS && self.best() != before {
            (self.left, self.wait) = (FIRST_WAIT, FIRST_WAIT);
        } else if way != before {
            self.wait = (self.wait * 2).min(LAST_WAIT);
        }
    }
}

/// StrategyTable by what is traced: a thread's own.
#[derive(Debug)]
pub(crate) struct StrategyTable([(usize, StrategyChoice); StrategyTable::ROWS]);

impl StrategyTable {
    const ROWS: usize = 32;

    /// The choice for rays of a kind through an object, told from others by a number that is most often unique. If it is
    /// not, or was another object's before, a few batches take the slower way.
    pub(crate) fn of(&mut self, object: usize, kind: usize) -> &mut StrategyChoice {
        let name = (object / 8).wrapping_mul(2).wrapping_add(kind);
        let row = (name.wrapping_mul(0x9e37_79b9) >> 16) % Self::ROWS;
        let (key, choice) = &mut self.0[row];
        if *key != name {
            (*key, *choice) = (name, StrategyChoice::new());
        }
        choice
    }
}

impl Default for StrategyTable {
    fn default() -> Self {
        StrategyTable([(0, StrategyChoice::new()); Self::ROWS])
    }
}

/// A clock, where the machine has one.
pub(crate) fn now() -> Option<Instant> {
    // There, asking panics.
    if cfg!(all(target_family = "wasm", target_os = "unknown")) { None } else { Some(Instant::now()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    /// Batches that took tets, of so many, at such costs; every twentieth is interrupted.
    fn tets_taken(choice: &mut StrategyChoice, rng: &mut Rng, batches: u32, cost: [f64; 2]) -> u32 {
        let mut taken = 0;
        for _ in 0..batches {
            let way = choice.next();
            taken += u32::from(way == Strategy::Tets);
            let noise = 0.95 + 0.1 * f64::from(rng.below(1000) as u32) / 1000.0;
            let interruption = if rng.below(20) == 0 { 30.0 } else { 1.0 };
            choice.learn(way, cost[way as usize] * noise * interruption);
        }
        taken
    }

    #[test]
    fn the_faster_way_is_taken_whatever_interrupts() {
        for seed in 0..50 {
            let mut rng = Rng::new(seed);
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [100e-9, 200e-9]);
            assert!((4..160).contains(&taken), "the slower way takes {taken} of 4000");
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [200e-9, 100e-9]);
            assert!((3840..3996).contains(&taken), "the faster way takes {taken} of 4000");
        }
    }

    #[test]
    fn a_change_is_noticed() {
        let mut rng = Rng::new(7);
        let mut choice = StrategyChoice::new();
        tets_taken(&mut choice, &mut rng, 2000, [100e-9, 150e-9]);
        assert_eq!(choice.best(), Strategy::Bvh);
        tets_taken(&mut choice, &mut rng, 4000, [100e-9, 50e-9]);
        assert_eq!(choice.best(), Strategy::Tets);
    }

    #[test]
    fn choices_of_different_objects_and_kinds_are_apart() {
        let mut choices = StrategyTable::default();
        for _ in 0..TRIALS {
            choices.of(4096, 0).learn(Strategy::Bvh, 2.0);
            choices.of(4096, 0).learn(Strategy::Tets, 1.0);
        }
        assert_eq!(choices.of(4096, 0).best(), Strategy::Tets);
        assert_eq!(choices.of(4096, 1).best(), Strategy::Bvh);
        assert_eq!(choices.of(4096, 0).best(), Strategy::Tets);
    }
}
