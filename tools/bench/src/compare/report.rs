//! What `compare` found, as JSON and as tables.

use crate::markdown::table;
use crate::rounds::geometric_mean;
use serde::Serialize;
use std::collections::BTreeMap;

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
    /// Whether both builds gave the same answers, to the bit.
    pub same: bool,
}

/// Whether the new build is slower.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// By more than the threshold.
    Faster,
    /// Neither.
    Equal,
    /// By more than the threshold.
    Slower,
}

impl Verdict {
    fn of(ratio: f64, worse: f64) -> Verdict {
        if ratio > 1.0 + worse {
            Verdict::Slower
        } else if ratio < 1.0 - worse {
            Verdict::Faster
        } else {
            Verdict::Equal
        }
    }

    fn name(self) -> &'static str {
        match self {
            Verdict::Faster => "faster",
            Verdict::Equal => "equal",
            Verdict::Slower => "slower",
        }
    }
}

impl Comparison {
    /// Geometric mean over the models of each set's ratio, in the order of the sets.
    pub fn means(&self) -> Vec<(String, f64)> {
        let mut order: Vec<&str> = Vec::new();
        let mut ratios: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for set in self.models.iter().flat_map(|model| &model.sets) {
            if !order.contains(&set.name.as_str()) {
                order.push(&set.name);
            }
            ratios.entry(&set.name).or_default().push(set.ratio);
        }
        let mean = |name: &str| geometric_mean(ratios[name].iter().copied());
        order.into_iter().filter_map(|name| Some((name.to_owned(), mean(name)?))).collect()
    }

    /// Slower if any set is, else faster if any set is.
    pub fn verdict(&self) -> Verdict {
        let verdicts: Vec<Verdict> =
            self.means().iter().map(|(_, mean)| Verdict::of(*mean, self.worse)).collect();
        [Verdict::Slower, Verdict::Faster]
            .into_iter()
            .find(|v| verdicts.contains(v))
            .unwrap_or(Verdict::Equal)
    }

    /// Model and set where the builds gave different answers.
    pub fn differing(&self) -> Vec<String> {
        let sets = self.models.iter().flat_map(|model| model.sets.iter().map(move |set| (model, set)));
        sets.filter(|(_, set)| !set.same).map(|(model, set)| format!("{} {}", model.name, set.name)).collect()
    }

    /// A row for each model and set, and the means with their verdicts.
    pub fn markdown(&self) -> String {
        let cells = |texts: &[&str]| texts.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>();
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
        let means = self.means();
        let verdicts: Vec<Vec<String>> = means
            .iter()
            .map(|(name, mean)| {
                vec![name.clone(), format!("{mean:.3}"), Verdict::of(*mean, self.worse).name().to_owned()]
            })
            .collect();
        format!(
            "{}\n{}",
            table(&cells(&["model and set", "old ns", "new ns", "new / old", "quartiles", "answers"]), &rows),
            table(&cells(&["mean over models", "new / old", "verdict"]), &verdicts),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(name: &str, ratio: f64, same: bool) -> SetComparison {
        let (old_ns, new_ns) = (100.0, 100.0 * ratio);
        SetComparison {
            name: name.to_owned(),
            rays: 4096,
            old_ns,
            new_ns,
            ratio,
            low: ratio,
            high: ratio,
            same,
        }
    }

    #[test]
    fn verdicts_are_those_of_the_means_over_models() {
        let model = |name: &str, ratio| ModelComparison {
            name: name.to_owned(),
            sets: vec![set("primary", ratio, true), set("ao", 1.0, true)],
        };
        let models = vec![model("a", 1.02), model("b", 0.98)];
        let mut comparison = Comparison { batch: 1024, worse: 0.01, models };
        assert_eq!(comparison.verdict(), Verdict::Equal);
        comparison.models[1].sets[0].ratio = 1.02;
        assert_eq!(comparison.verdict(), Verdict::Slower);
        for model in &mut comparison.models {
            model.sets[0].ratio = 0.9;
        }
        assert_eq!(comparison.verdict(), Verdict::Faster);
        assert!(comparison.markdown().contains("| primary | 0.900 | faster |"));
    }

    #[test]
    fn different_answers_are_named() {
        let models = vec![ModelComparison { name: "a".to_owned(), sets: vec![set("ao", 1.0, false)] }];
        assert_eq!(Comparison { batch: 1, worse: 0.01, models }.differing(), ["a ao"]);
    }
}
