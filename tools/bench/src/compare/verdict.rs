//! The verdict on a new build, set by set.

use crate::rounds::{geometric_mean, median};
use bth_random::Rng;

/// A comparison of the new build with the old one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Faster by more than the threshold, with 95 % confidence.
    Faster,
    /// Within the threshold either way, with 95 % confidence.
    Equal,
    /// The rounds do not tell: more are needed, or a quieter machine.
    Undecided,
    /// Slower by more than the threshold, with 95 % confidence.
    Slower,
}

impl Verdict {
    fn of([low, high]: [f64; 2], worse: f64) -> Verdict {
        if low > 1.0 + worse {
            Verdict::Slower
        } else if high < 1.0 - worse {
            Verdict::Faster
        } else if 1.0 - worse <= low && high <= 1.0 + worse {
            Verdict::Equal
        } else {
            Verdict::Undecided
        }
    }
}

/// The ratios new / old of the rounds, by set and model.
#[derive(Debug, Default)]
pub(super) struct SetRatios(Vec<(&'static str, Vec<Vec<f64>>)>);

impl SetRatios {
    /// Adds the rounds of a set with another model.
    pub(super) fn add(&mut self, set: &'static str, rounds: Vec<f64>) {
        match self.0.iter_mut().find(|(name, _)| *name == set) {
            Some((_, models)) => models.push(rounds),
            None => self.0.push((set, vec![rounds])),
        }
    }

    /// Notes the verdict on each set. Returns slower if any is, else undecided if any is, else
    /// faster if any is.
    pub(super) fn judge(&self, worse: f64, notes: &mut Vec<String>) -> Verdict {
        let mut verdicts = Vec::new();
        for (set, models) in &self.0 {
            let medians = models.iter().filter_map(|rounds| median(rounds.clone()));
            let Some(mean) = geometric_mean(medians) else { continue };
            let [low, high] = interval(models);
            let verdict = Verdict::of([low, high], worse);
            notes.push(format!(
                "{set}: new / old {mean:.3}, {low:.3} to {high:.3}: {}",
                format!("{verdict:?}").to_lowercase()
            ));
            verdicts.push(verdict);
        }
        let order = [Verdict::Slower, Verdict::Undecided, Verdict::Faster];
        order.into_iter().find(|v| verdicts.contains(v)).unwrap_or(Verdict::Equal)
    }
}

/// The 95 % confidence interval of the geometric mean of the medians, by resampling each model's
/// rounds (percentile bootstrap, Efron 1979). A single round allows any value.
fn interval(models: &[Vec<f64>]) -> [f64; 2] {
    const RESAMPLES: usize = 1000;
    if models.iter().any(|rounds| rounds.len() < 2) {
        return [0.0, f64::INFINITY];
    }
    let mut rng = Rng::new(1);
    let mut mean = |_| {
        let medians = models.iter().filter_map(|rounds| {
            let draw = |_| rounds[rng.below(rounds.len() as u64) as usize];
            median((0..rounds.len()).map(draw).collect())
        });
        geometric_mean(medians)
    };
    let mut means: Vec<f64> = (0..RESAMPLES).filter_map(&mut mean).collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|share| means.get((share * means.len() as f64) as usize).copied().unwrap_or(f64::NAN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_by_intervals_of_the_means() {
        let judge = |ratio: f64, scatter: f64, rounds: usize| {
            let mut ratios = SetRatios::default();
            let round = |i: usize| ratio * (1.0 + scatter * (i as f64 / 10.0 - 1.0));
            for _ in 0..2 {
                ratios.add("primary", (0..rounds).map(round).collect());
                ratios.add("ao", (0..rounds).map(|_| 1.0).collect());
            }
            let mut notes = Vec::new();
            (ratios.judge(0.01, &mut notes), notes)
        };
        assert_eq!(judge(1.0, 0.005, 21).0, Verdict::Equal);
        assert_eq!(judge(1.05, 0.005, 21).0, Verdict::Slower);
        // The mean alone would be slower; such noisy rounds do not show it.
        assert_eq!(judge(1.015, 0.2, 21).0, Verdict::Undecided);
        assert_eq!(judge(1.05, 0.0, 1).0, Verdict::Undecided);
        let (verdict, notes) = judge(0.9, 0.001, 21);
        assert_eq!(verdict, Verdict::Faster);
        assert!(notes[0].starts_with("primary: new / old 0.900, 0.900 to 0.900: faster"), "{notes:?}");
    }
}
