//! Choice between two strategies of tracing, with and without a use of hints, by measuring both on the caller's batches.
//!
//! Whether rays that start on a known triangle are faster through tetrahedra or through the BVH depends on the model, the rays,
//! the caches and the speed of gathers on the machine: ratios from 0.5 to 1.3 have been measured (docs/notes/tets.md). Answers
//! have the same bits with either strategy, so the choice can depend on time. Both are compared again at intervals that grow while the
//! faster one remains the same; in the long run one batch in 257 is.
//!
//! What a ray costs differs more between the parts of a picture than between the strategies. Therefore a batch in which they are compared
//! is traced in four parts, the outer ones by one strategy and the inner ones by the other, and the clock is read in no other batch.

use crate::rays::Ray;
use bth_format::Identity;
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

/// Least number of rays of a batch in which the strategies are compared. Smaller batches take the strategy that is faster by the
/// measurements so far.
pub(crate) const MIN_COMPARED_RAYS: usize = 256;
/// Number of comparisons before the first choice.
const TRIALS: u32 = 6;
/// Number of these, from the first on, that warm the caches and do not count.
const WARM_UP: u32 = 1;
/// Least number of batches until the strategies are compared again.
const FIRST_INTERVAL: u32 = 32;
/// Greatest number of batches until then.
const LAST_INTERVAL: u32 = 256;
/// Number of the last comparisons that count.
const COMPARISONS: usize = 16;

/// What is a clear difference of costs, relative to their sum, and counts as no more: an interrupted batch costs many times as much as
/// others.
const CLEAR: f64 = 1.0 / 3.0;

/// Number of parts of a batch in which the strategies are compared.
pub(crate) const PARTS: usize = 4;

/// How the next batch is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Plan {
    /// As a whole.
    Whole(Strategy),
    /// In parts, by both strategies; the time of both is to be recorded.
    Compare([Strategy; PARTS]),
}

/// The measurements for one kind of rays through one object or scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrategyChoice {
    /// By how much [`Strategy::Hinted`] took longer than [`Strategy::Bvh`], relative to the sum of both, in no order. Ratios would have a
    /// greater mean than their reciprocals, and so would never agree on what is faster where parts of a picture differ much.
    differences: [f64; COMPARISONS],
    /// Number of comparisons so far.
    comparisons: usize,
    /// Mean of the differences without the least and the greatest quarter: the thread may be interrupted in any batch, and the strategies may
    /// differ in few batches only, which a median would not see.
    difference: f64,
    /// Number of batches that were planned.
    batches: u32,
    /// Number of batches until the strategies are compared again.
    remaining: u32,
    /// Number of batches between that comparison and the one before. It grows while comparisons agree with the mean.
    interval: u32,
}

impl StrategyChoice {
    pub(crate) fn new() -> StrategyChoice {
        StrategyChoice {
            differences: [0.0; COMPARISONS],
            comparisons: 0,
            difference: 0.0,
            batches: 0,
            remaining: FIRST_INTERVAL,
            interval: FIRST_INTERVAL,
        }
    }

    /// The strategy that is faster by the measurements so far; [`Strategy::Bvh`] without any.
    pub(crate) fn best(&self) -> Strategy {
        if self.difference < 0.0 { Strategy::Hinted } else { Strategy::Bvh }
    }

    /// As [`Self::best`], with the strategy for batches that come before there are measurements.
    pub(crate) fn best_or(&self, unmeasured: Strategy) -> Strategy {
        if self.comparisons == 0 { unmeasured } else { self.best() }
    }

    /// The plan for the next batch.
    pub(crate) fn next(&mut self) -> Plan {
        let batch = self.batches;
        self.batches = batch.saturating_add(1);
        if batch >= TRIALS {
            if self.remaining > 0 {
                self.remaining -= 1;
                return Plan::Whole(self.best());
            }
            self.remaining = self.interval;
        }
        let [a, b] = match self.comparisons % 2 {
            0 => [Strategy::Bvh, Strategy::Hinted],
            _ => [Strategy::Hinted, Strategy::Bvh],
        };
        Plan::Compare([a, b, b, a])
    }

    /// Records the seconds per ray of both strategies, in the order of [`Strategy`], in a batch in which they were compared.
    pub(crate) fn record(&mut self, [bvh, hinted]: [f64; 2]) {
        let difference = (hinted - bvh) / (hinted + bvh);
        // A clock that stood still tells nothing.
        if self.batches <= WARM_UP || !difference.is_finite() || bvh.min(hinted) <= 0.0 {
            return;
        }
        self.differences[self.comparisons % COMPARISONS] = difference.clamp(-CLEAR, CLEAR);
        self.comparisons += 1;
        let mut sorted = self.differences;
        let sorted = &mut sorted[..self.comparisons.min(COMPARISONS)];
        sorted.sort_unstable_by(f64::total_cmp);
        let middle = &sorted[sorted.len() / 4..sorted.len() - sorted.len() / 4];
        self.difference = middle.iter().sum::<f64>() / middle.len() as f64;
        if self.batches > TRIALS {
            let is_confirmed = (difference < 0.0) == (self.difference < 0.0);
            self.interval = if is_confirmed { LAST_INTERVAL.min(2 * self.interval) } else { FIRST_INTERVAL };
            self.remaining = self.interval;
        }
    }
}

/// The choices of one thread, as a hash table by object or scene and kind of rays. A new key replaces the key that has the same row.
#[derive(Debug)]
pub(crate) struct StrategyTable([(usize, StrategyChoice); StrategyTable::ROWS]);

impl StrategyTable {
    const ROWS: usize = 64;
    /// An upper bound on the kinds of rays.
    const KINDS: usize = 16;

    /// The choice for a kind of rays ([`HintUse::kind`]) through an object or a scene.
    pub(crate) fn of(&mut self, traced: Identity, kind: usize) -> &mut StrategyChoice {
        let key = traced.number().wrapping_mul(Self::KINDS).wrapping_add(kind);
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

    /// Number of batches that take [`Strategy::Hinted`] as a whole, of `batches` with the given seconds per ray. One in twenty is interrupted, so
    /// one in eighty parts of those in which the strategies are compared.
    fn tets_taken(choice: &mut StrategyChoice, rng: &mut Rng, batches: u32, cost: [f64; 2]) -> u32 {
        let mut taken = 0;
        for _ in 0..batches {
            match choice.next() {
                Plan::Whole(strategy) => taken += u32::from(strategy == Strategy::Hinted),
                Plan::Compare(strategies) => {
                    let mut seconds = [0.0; 2];
                    for strategy in strategies {
                        let noise = 0.95 + 0.1 * f64::from(rng.below(1000) as u32) / 1000.0;
                        let interruption = if rng.below(80) == 0 { 30.0 } else { 1.0 };
                        seconds[strategy as usize] += cost[strategy as usize] * noise * interruption / 2.0;
                    }
                    choice.record(seconds);
                }
            }
        }
        taken
    }

    #[test]
    fn the_faster_strategy_is_chosen_despite_interruptions() {
        for seed in 0..50 {
            let mut rng = Rng::new(seed);
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [100e-9, 200e-9]);
            assert!(taken < 160, "the slower strategy takes {taken} of 4000");
            let mut choice = StrategyChoice::new();
            let taken = tets_taken(&mut choice, &mut rng, 4000, [200e-9, 100e-9]);
            assert!((3840..3994).contains(&taken), "the faster strategy takes {taken} of 4000");
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
    fn batches_that_cost_four_times_as_much_as_others_do_not_hide_which_strategy_is_faster() {
        for (cost, least, most) in [([100e-9, 80e-9], 3500, 4000), ([80e-9, 100e-9], 0, 100)] {
            for seed in 0..20 {
                let (mut rng, mut choice, mut taken) = (Rng::new(seed), StrategyChoice::new(), 0);
                // Twenty batches through each part of a picture.
                for _ in 0..200 {
                    let part = 1.0 + rng.below(4) as f64;
                    taken += tets_taken(&mut choice, &mut rng, 20, cost.map(|x| x * part));
                }
                assert!((least..=most).contains(&taken), "{cost:?}: hinted take {taken} of 4000");
            }
        }
    }

    #[test]
    fn a_strategy_that_is_slower_in_some_batches_only_is_not_taken() {
        for seed in 0..20 {
            let (mut rng, mut choice, mut taken) = (Rng::new(seed), StrategyChoice::new(), 0);
            for _ in 0..4000 {
                let hinted = if rng.below(5) < 2 { 130e-9 } else { 100e-9 };
                taken += tets_taken(&mut choice, &mut rng, 1, [100e-9, hinted]);
            }
            assert!(taken < 1000, "hinted take {taken} of 4000");
        }
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
        let [object, other] = [Identity::new(), Identity::new()];
        for _ in 0..TRIALS {
            choices.of(object, 0).next();
            choices.of(object, 0).record([2.0, 1.0]);
        }
        assert_eq!(choices.of(object, 0).best(), Strategy::Hinted);
        assert_eq!(choices.of(object, 1).best(), Strategy::Bvh);
        assert_eq!(choices.of(other, 0).best(), Strategy::Bvh);
        assert_eq!(choices.of(object, 0).best(), Strategy::Hinted);
    }
}
