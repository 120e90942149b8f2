//! Judges answers by the exact ones.

use super::exact::ExactAnswer;
use super::sets::{Query, Set};
use bth_format::layout::NONE;

/// An answer: a miss has the id [`NONE`]. To questions of yes or no the id is 1 or 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EngineAnswer {
    pub(super) t: f64,
    pub(super) id: u32,
}

impl EngineAnswer {
    /// A ray that hits nothing.
    pub(super) const MISS: EngineAnswer = EngineAnswer { t: f64::INFINITY, id: NONE };

    /// Yes or no.
    pub(super) fn flag(is_true: bool) -> EngineAnswer {
        EngineAnswer { t: 0.0, id: u32::from(is_true) }
    }
}

/// What is wrong with the answers to a set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Judgement {
    /// Answers.
    pub(super) answers: usize,
    /// No triangle was found, or no blocker, though one exists.
    pub(super) missed: usize,
    /// A triangle was found, or a blocker, though nothing is hit; or a point is on the other side.
    pub(super) invented: usize,
    /// A triangle that is not a nearest one.
    pub(super) other: usize,
    /// Pairs of points with different answers in both directions.
    pub(super) one_sided: usize,
    /// The largest relative error of t where the triangle is right and the ray starts at a point.
    pub(super) error_of_t: f64,
}

impl Judgement {
    /// All wrong answers.
    pub(super) fn wrong(&self) -> usize {
        self.missed + self.invented + self.other
    }

    /// The same, per million.
    pub(super) fn per_million(&self) -> f64 {
        self.wrong() as f64 * 1e6 / self.answers.max(1) as f64
    }

    /// One-sided pairs, per million pairs.
    pub(super) fn one_sided_per_million(&self) -> f64 {
        self.one_sided as f64 * 2e6 / self.answers.max(1) as f64
    }
}

/// Judges the answers to these rows of the questions of a set.
pub(super) fn judge(set: &Set, rows: impl Iterator<Item = usize>, answers: &[EngineAnswer]) -> Judgement {
    let mut judgement = Judgement { answers: answers.len(), ..Judgement::default() };
    for (row, answer) in rows.zip(answers) {
        let question = &set.questions[row];
        match &set.truths[row] {
            ExactAnswer::Miss => judgement.invented += usize::from(answer.id != NONE),
            ExactAnswer::Hit { .. } if answer.id == NONE => judgement.missed += 1,
            ExactAnswer::Hit { triangles, .. } if !triangles.contains(&answer.id) => judgement.other += 1,
            ExactAnswer::Hit { .. } if question.from.is_some() => {}
            ExactAnswer::Hit { t, .. } => {
                judgement.error_of_t = judgement.error_of_t.max((answer.t - t).abs() / t);
            }
            ExactAnswer::Flag(truth) if (answer.id == 1) == *truth => {}
            ExactAnswer::Flag(false) if set.query == Query::Visible => judgement.missed += 1,
            ExactAnswer::Flag(_) => judgement.invented += 1,
        }
    }
    if set.query == Query::Visible {
        let differ = |pair: &&[EngineAnswer]| pair.iter().any(|answer| answer.id != pair[0].id);
        judgement.one_sided = answers.chunks(2).filter(differ).count();
    }
    judgement
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::sets;

    /// Every kind of wrong answer, planted.
    #[test]
    fn planted_wrong_answers_are_found() {
        for set in sets::all(300) {
            assert!(!set.truths.is_empty(), "{}", set.name);
            let right: Vec<EngineAnswer> = set.truths.iter().map(answer).collect();
            let Judgement { answers, error_of_t, .. } = judge(&set, 0.., &right);
            assert_eq!(
                judge(&set, 0.., &right),
                Judgement { answers, ..Judgement::default() },
                "{}",
                set.name
            );
            assert_eq!(error_of_t, 0.0);
            let planted = |index: usize, answer: EngineAnswer| {
                let mut answers = right.clone();
                answers[index] = answer;
                judge(&set, 0.., &answers)
            };
            let one = Judgement { answers: right.len(), ..Judgement::default() };
            for (index, truth) in set.truths.iter().enumerate() {
                let right = right[index];
                match truth {
                    ExactAnswer::Miss => {
                        let ghost = EngineAnswer { t: 1.0, id: 0 };
                        assert_eq!(planted(index, ghost), Judgement { invented: 1, ..one });
                    }
                    ExactAnswer::Hit { triangles, .. } => {
                        assert_eq!(planted(index, EngineAnswer::MISS), Judgement { missed: 1, ..one });
                        let other = (0..).find(|id| !triangles.contains(id)).unwrap();
                        let found = planted(index, EngineAnswer { id: other, ..right });
                        assert_eq!(found, Judgement { other: 1, ..one });
                        for id in triangles {
                            assert_eq!(planted(index, EngineAnswer { id: *id, ..right }), one);
                        }
                        let late = planted(index, EngineAnswer { t: 1.5 * right.t, ..right });
                        let expected = if set.questions[index].from.is_some() { 0.0 } else { 0.5 };
                        assert_eq!(late, Judgement { error_of_t: late.error_of_t, ..one });
                        assert!((late.error_of_t - expected).abs() < 1e-12);
                    }
                    ExactAnswer::Flag(is_true) => {
                        let found = planted(index, EngineAnswer::flag(!is_true));
                        assert_eq!(found.wrong(), 1);
                        assert_eq!(found.one_sided, usize::from(set.query == Query::Visible));
                        assert_eq!(found.missed == 1, set.query == Query::Visible && !is_true);
                    }
                }
            }
        }
    }

    fn answer(truth: &ExactAnswer) -> EngineAnswer {
        match truth {
            ExactAnswer::Miss => EngineAnswer::MISS,
            ExactAnswer::Hit { t, triangles, .. } => EngineAnswer { t: *t, id: triangles[0] },
            ExactAnswer::Flag(is_true) => EngineAnswer::flag(*is_true),
        }
    }
}
