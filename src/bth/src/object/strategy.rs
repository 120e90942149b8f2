//! Choice between two strategies of tracing, with and without a use of hints, by measuring both on the caller's batches.
//!
//! Whether rays that start on a known triangle are faster through tetrahedra or through the BVH depends on the model, the rays,
//! the caches and the speed of gathers on the machine: ratios from 0.5 to 1.3 have been measured (docs/notes/tets.md). Answers
//! have the same bits with either strategy, so the choice can depend on time. The slower strategy is measured again at intervals
//! that grow while it remains the slower one; in the long run it gets one batch in 256.

use crate::rays::Ray;
use bth_format::object::ObjectView;

/// How rays that start on known triangles are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strategy {
    /// Through the BVH, without hints.
    Bvh,
    /// By what is known of the triangle on which the ray starts: through tetrahedra first, or not at all in a free direction.
    Hinted,
}

/// What a hint is used for, where both ways are measured.
#[derive(Clone, Copy, Debug)]
pub(crate) enum HintUse {
    /// Walks through tetrahedra.
    Tets,
    /// Look-ups of free directions.
    Free,
    /// Look-ups in scenes before the top level, and walks through tetrahedra of the instance on which a ray starts.
    StartInstance,
}

/// The query of a batch, as far as the costs of strategies depend on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueryKind {
    /// Whether any hit ends a ray.
    pub(crate) any: bool,
    /// Whether the rays are short for their object or scene: ambient occlusion rays end early, shadow rays go in packets.
    pub(crate) short: bool,
}

impl QueryKind {
    /// The kind of a batch by the ray in its middle, through what has the given size.
    #[inline]
    pub(crate) fn of(any: bool, rays: &[Ray], size: f32) -> QueryKind {
        QueryKind { any, short: rays.get(rays.len() / 2).is_some_and(|ray| is_short(ray, size)) }
    }
}

/// The longest side of the object's box.
#[inline]
pub(super) fn size_of(object: &ObjectView<'_>) -> f32 {
    let header = object.header;
    (0..3).fold(0f32, |size, k| size.max(header.upper[k] - header.lower[k]))
}

/// Whether a ray is short for something of the given size.
#[inline]
pub(crate) fn is_short(ray: &Ray, size: f32) -> bool {
    /// Greatest length of a short ray, relative to the size.
    const SHORT: f32 = 0.3;
    let [x, y, z] = ray.direction;
    x.abs().max(y.abs()).max(z.abs()) * ray.tmax <= SHORT * size
}

impl HintUse {
    /// The number of a kind of rays, below [`StrategyTable::KINDS`]: what hints are used for, and what is asked.
    pub(crate) fn kind(self, query: QueryKind) -> usize {
        4 * self as usize + 2 * usize::from(query.short) + usize::from(query.any)
    }
}

/// Least number of rays of a batch that is measured. Smaller batches take the strategy that is faster by the measurements so far.
pub(crate) const MIN_MEASURED_RAYS: usize = 256;
/// Number of batches before the first choice, in which the two strategies alternate.
const TRIALS: u32 = 8;
/// Number of these batches, from the first on, that warm the caches and whose times are ignored.
const WARM_UP: u32 = 2;
/// Number of batches until the slower strategy is measured again, after the first choice or after the other strategy became the
/// faster.
const FIRST_INTERVAL: u32 = 32;
/// Greatest number of batches until the slower strategy is measured again.
const LAST_INTERVAL: u32 = 256;

/// The measurements for one kind of rays through one object or scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrategyChoice {
    /// Seconds per ray of each strategy, in the order of [`Strategy`]; `None` before the first measurement.
    cost: [Option<f64>; 2],
    /// Number of batches that were recorded.
    batches: u32,
    /// Number of batches until the slower strategy is measured again.
    remaining: u32,
    /// Number of batches between that measurement and the following one.
    interval: u32,
}

impl StrategyChoice {
    pub(crate) fn new() -> StrategyChoice {
        StrategyChoice { cost: [None; 2], batches: 0, remaining: FIRST_INTERVAL, interval: FIRST_INTERVAL }
    }

    /// The strategy that is faster by the measurements so far; [`Strategy::Bvh`] without measurements of both.
    pub(crate) fn best(&self) -> Strategy {
        self.best_or(Strategy::Bvh)
    }

    /// As [`Self::best`], with the strategy for batches that come before there are measurements.
    pub(crate) fn best_or(&self, unmeasured: Strategy) -> Strategy {
        match self.cost {
            [Some(bvh), Some(hinted)] if hinted < bvh => Strategy::Hinted,
            [Some(_), Some(_)] => Strategy::Bvh,
            _ => unmeasured,
        }
    }

    /// The strategy for the next batch.
    pub(crate) fn next(&mut self) -> Strategy {
        let best = self.best();
        if self.batches < TRIALS {
            return if self.batches.is_multiple_of(2) { Strategy::Bvh } else { Strategy::Hinted };
        }
        if self.remaining > 0 {
            self.remaining -= 1;
            return best;
        }
        self.remaining = self.interval;
        if best == Strategy::Bvh { Strategy::Hinted } else { Strategy::Bvh }
    }

    /// Records the time of a batch.
    pub(crate) fn record(&mut self, strategy: Strategy, seconds_per_ray: f64) {
        self.batches = self.batches.saturating_add(1);
        if self.batches <= WARM_UP {
            return;
        }
        let before = self.best();
        let cost = &mut self.cost[strategy as usize];
        // The thread may have been interrupted. Therefore the least of the first measurements counts. A later measurement counts
        // as at most twice the expected time, and changes that less if it is greater than if it is smaller.
        *cost = Some(match *cost {
            None => seconds_per_ray,
            Some(cost) if self.batches <= TRIALS => cost.min(seconds_per_ray),
            Some(cost) if seconds_per_ray < cost => (cost + seconds_per_ray) / 2.0,
            Some(cost) => cost + (seconds_per_ray.min(2.0 * cost) - cost) / 8.0,
        });
        if self.batches > TRIALS && self.best() != before {
            (self.remaining, self.interval) = (FIRST_INTERVAL, FIRST_INTERVAL);
        } else if strategy != before {
            self.interval = (self.interval * 2).min(LAST_INTERVAL);
        }
    }
}

/// The choices of one thread, as a hash table by object or scene and kind of rays. A new key replaces the key that has the same row.
#[derive(Debug)]
pub(crate) struct StrategyTable([(usize, StrategyChoice); StrategyTable::ROWS]);

impl StrategyTable {
    const ROWS: usize = 64;
    /// An upper bound on the kinds of rays. No two objects or scenes lie as close to each other, so keys are distinct.
    const KINDS: usize = 16;

    /// The choice for a kind of rays ([`HintUse::kind`]) through the object or scene with the given address. If another one had this
    /// address before, a few batches may take the slower strategy.
    pub(crate) fn of(&mut self, address: usize, kind: usize) -> &mut StrategyChoice {
        let key = (address / Self::KINDS).wrapping_mul(Self::KINDS).wrapping_add(kind);
        let row = (key.wrapping_mul(0x9e37_79b9) >> 16) % Self::ROWS;
        let (stored_key, choice) = &mut self.0[row];
        if *stored_key != key {
            (*stored_key, *choice) = (key, StrategyChoice::new());
        }
        choice
    }
}

impl Default for StrategyTable {
    fn default() -> Self {
        StrategyTable([(0, StrategyChoice::new()); Self::ROWS])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    /// Number of batches that take [`Strategy::Hinted`], of `batches` with the given seconds per ray, one in twenty of which is
    /// interrupted.
    fn tets_taken(choice: &mut StrategyChoice, rng: &mut Rng, batches: u32, cost: [f64; 2]) -> u32 {
        let mut taken = 0;
        for _ in 0..batches {
            let strategy = choice.next();
            taken += u32::from(strategy == Strategy::Hinted);
            let noise = 0.95 + 0.1 * f64::from(rng.below(1000) as u32) / 1000.0;
            let interruption = if rng.below(20) == 0 { 30.0 } else { 1.0 };
            choice.record(strategy, cost[strategy as usize] * noise * interruption);
        }
        taken
    }

    #[test]
    fn the_faster_strategy_is_chosen_despite_interruptions() {
        for seed in 0..50 {
            let mut rng = Rng::new(seed);
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [100e-9, 200e-9]);
            assert!((4..160).contains(&taken), "the slower strategy takes {taken} of 4000");
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [200e-9, 100e-9]);
            assert!((3840..3996).contains(&taken), "the faster strategy takes {taken} of 4000");
        }
    }

    #[test]
    fn the_choice_follows_a_change_of_costs() {
        let mut rng = Rng::new(7);
        let mut choice = StrategyChoice::new();
        tets_taken(&mut choice, &mut rng, 2000, [100e-9, 150e-9]);
        assert_eq!(choice.best(), Strategy::Bvh);
        tets_taken(&mut choice, &mut rng, 4000, [100e-9, 50e-9]);
        assert_eq!(choice.best(), Strategy::Hinted);
    }

    #[test]
    fn short_and_long_rays_are_kinds_of_their_own() {
        let ray = |tmax: f32| Ray { origin: [9.0; 3], tmin: 0.0, direction: [0.0, -2.0, 1.0], tmax };
        let kind = |use_: HintUse, any: bool, tmax: f32| {
            use_.kind(QueryKind::of(any, &[ray(f32::NAN), ray(tmax), ray(f32::NAN)], 1.0))
        };
        let mut kinds = Vec::new();
        for use_ in [HintUse::Tets, HintUse::Free, HintUse::StartInstance] {
            for any in [false, true] {
                assert_eq!(kind(use_, any, 0.16), kind(use_, any, f32::INFINITY));
                kinds.extend([kind(use_, any, 0.14), kind(use_, any, 0.16)]);
            }
        }
        kinds.sort_unstable();
        kinds.dedup();
        assert!(kinds.len() == 12 && kinds[11] < StrategyTable::KINDS, "{kinds:?}");
        assert!(!QueryKind::of(true, &[], 1.0).short);
    }

    #[test]
    fn objects_and_kinds_of_rays_have_separate_choices() {
        let mut choices = StrategyTable::default();
        for _ in 0..TRIALS {
            choices.of(4096, 0).record(Strategy::Bvh, 2.0);
            choices.of(4096, 0).record(Strategy::Hinted, 1.0);
        }
        assert_eq!(choices.of(4096, 0).best(), Strategy::Hinted);
        assert_eq!(choices.of(4096, 1).best(), Strategy::Bvh);
        assert_eq!(choices.of(4096, 0).best(), Strategy::Hinted);
    }
}
