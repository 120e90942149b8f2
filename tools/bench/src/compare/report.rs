//! What `compare` found, as JSON and as tables.

use crate::markdown::{cells, table};
use crate::rounds::{geometric_mean, median};
use bth_random::Rng;
use serde::Serialize;

/// A comparison of two builds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Rays in a call.
    pub batch: usize,
    /// A set whose mean ratio exceeds 1 by more than this is slower.
    pub worse: f64,
    /// One entry a model.
    pub models: Vec<ModelComparison>,
}

/// A model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelComparison {
    /// Name of the model.
    pub name: String,
    /// Its ray sets.
    pub sets: Vec<SetComparison>,
}

/// A ray set of a model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SetComparison {
    /// Name of the set.
    pub name: String,
    /// Rays in it.
    pub rays: usize,
    /// Median CPU time a ray of the old build, in ns.
    pub old_ns: f64,
    /// The same of the new build.
    pub new_ns: f64,
    /// Median over the rounds of the new build's time over the old one's.
    pub ratio: f64,
    /// Lower quartile of that.
    pub low: f64,
    /// Upper quartile of that.
    pub high: f64,
    /// The ratio of each round.
    #[serde(skip)]
    pub ratios: Vec<f64>,
    /// Whether both builds gave the same answers, to the bit.
    pub same: bool,
}

/// Whether the new build is slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// By more than the threshold, with 95 % confidence.
    Faster,
    /// By less than the threshold either way, with 95 % confidence.
    Equal,
    /// The rounds do not tell: more are needed, or a quieter machine.
    Undecided,
    /// By more than the threshold, with 95 % confidence.
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

    fn name(self) -> &'static str {
        match self {
            Verdict::Faster => "faster",
            Verdict::Equal => "equal",
            Verdict::Undecided => "undecided",
            Verdict::Slower => "slower",
        }
    }
}

/// A set's mean over the models.
#[derive(Clone, Debug, PartialEq)]
pub struct Mean {
    /// Name of the set.
    pub set: String,
    /// Geometric mean of the models' median ratios.
    pub ratio: f64,
    /// The interval that holds it with 95 % confidence.
    pub interval: [f64; 2],
}

/// The interval in which the geometric mean of the medians lies with 95 % confidence, by resampling each model's rounds
/// (percentile bootstrap, Efron 1979). A single round allows any value.
fn interval(models: &[&[f64]]) -> [f64; 2] {
    const RESAMPLES: usize = 1000;
    if models.iter().any(|rounds| rounds.len() < 2) {
        return [0.0, f64::INFINITY];
    }
    let mut rng = Rng::new(1);
    let mut means: Vec<f64> = (0..RESAMPLES)
        .filter_map(|_| {
            let medians = models.iter().filter_map(|rounds| {
                let draw = |_| rounds[rng.below(rounds.len().max(1) as u64) as usize];
                median((0..rounds.len()).map(draw).collect())
            });
            geometric_mean(medians.collect::<Vec<_>>())
        })
        .collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|share| means.get((share * means.len() as f64) as usize).copied().unwrap_or(f64::NAN))
}

impl Comparison {
    /// Geometric mean over the models of each set's ratio, in the order of the sets.
    pub fn means(&self) -> Vec<Mean> {
        let mut order: Vec<&str> = Vec::new();
        for set in self.models.iter().flat_map(|model| &model.sets) {
            if !order.contains(&set.name.as_str()) {
                order.push(&set.name);
            }
        }
        let mean = |name: &str| {
            let of = |model: &'_ ModelComparison| model.sets.iter().position(|set| set.name == name);
            let sets: Vec<&SetComparison> =
                self.models.iter().filter_map(|model| Some(&model.sets[of(model)?])).collect();
            let ratio = geometric_mean(sets.iter().map(|set| set.ratio))?;
            let rounds: Vec<&[f64]> = sets.iter().map(|set| &set.ratios[..]).collect();
            Some(Mean { set: name.to_owned(), ratio, interval: interval(&rounds) })
        };
        order.into_iter().filter_map(mean).collect()
    }

    /// Slower if any set is, else undecided if any is, else faster if any is.
    pub fn verdict(&self) -> Verdict {
        let verdicts: Vec<Verdict> =
            self.means().iter().map(|mean| Verdict::of(mean.interval, self.worse)).collect();
        let order = [Verdict::Slower, Verdict::Undecided, Verdict::Faster];
        order.into_iter().find(|v| verdicts.contains(v)).unwrap_or(Verdict::Equal)
    }

    /// Model and set where the builds gave different answers.
    pub fn differing(&self) -> Vec<String> {
        let sets = self.models.iter().flat_map(|model| model.sets.iter().map(move |set| (model, set)));
        sets.filter(|(_, set)| !set.same).map(|(model, set)| format!("{} {}", model.name, set.name)).collect()
    }

    /// A row for each model and set, and the means with their verdicts.
    pub fn markdown(&self) -> String {
        let mut rows = Vec::new();
        for model in &self.models {
            for set in &model.sets {
                rows.push(vec![
                    format!("{} {}", model.name, set.name),
                    format!("{:.1}", set.old_ns),
                    format!("{:.1}", set.new_ns),
                    format!("{:.3}", set.ratio),
                    format!("{:.3} to {:.3}", set.low, set.high),
                    if set.same { "same bits" } else { "DIFFERENT" }.to_owned(),
                ]);
            }
        }
        let verdicts: Vec<Vec<String>> = self
            .means()
            .iter()
            .map(|Mean { set, ratio, interval }| {
                let [low, high] = interval;
                let verdict = Verdict::of(*interval, self.worse).name().to_owned();
                vec![set.clone(), format!("{ratio:.3}"), format!("{low:.3} to {high:.3}"), verdict]
            })
            .collect();
        format!(
            "{}\n{}",
            table(&cells(&["model and set", "old ns", "new ns", "new / old", "quartiles", "answers"]), &rows),
            table(&cells(&["mean over models", "new / old", "95 %", "verdict"]), &verdicts),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A set whose rounds scatter by so much around a ratio.
    fn set(name: &str, ratio: f64, scatter: f64) -> SetComparison {
        let ratios = (0..21).map(|i| ratio * (1.0 + scatter * (f64::from(i) / 10.0 - 1.0))).collect();
        SetComparison {
            name: name.to_owned(),
            rays: 4096,
            old_ns: 100.0,
            new_ns: 100.0 * ratio,
            ratio,
            low: ratio,
            high: ratio,
            ratios,
            same: true,
        }
    }

    fn comparison(ratio: f64, scatter: f64) -> Comparison {
        let model = |name: &str| ModelComparison {
            name: name.to_owned(),
            sets: vec![set("primary", ratio, scatter), set("ao", 1.0, 0.001)],
        };
        Comparison { batch: 1024, worse: 0.01, models: vec![model("a"), model("b")] }
    }

    #[test]
    fn verdicts_are_those_of_intervals_of_the_means() {
        assert_eq!(comparison(1.0, 0.005).verdict(), Verdict::Equal);
        assert_eq!(comparison(1.05, 0.005).verdict(), Verdict::Slower);
        assert_eq!(comparison(0.9, 0.005).verdict(), Verdict::Faster);
        // The mean alone would be slower; so noisy rounds do not show it.
        assert_eq!(comparison(1.015, 0.2).verdict(), Verdict::Undecided);
        assert!(comparison(0.9, 0.001).markdown().contains("| primary | 0.900 |"));
    }

    #[test]
    fn a_single_round_decides_nothing() {
        let mut quick = comparison(1.05, 0.0);
        quick.models.iter_mut().flat_map(|m| &mut m.sets).for_each(|set| set.ratios.truncate(1));
        assert_eq!(quick.verdict(), Verdict::Undecided);
    }

    #[test]
    fn different_answers_are_named() {
        let mut different = comparison(1.0, 0.0);
        different.models[1].sets[1].same = false;
        assert_eq!(different.differing(), ["b ao"]);
    }
}
