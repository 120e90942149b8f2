//! The answers of the rays of a batch, as a caller gets them.

use super::better;
use super::goal::{AnyHit, Goal, NearestHit};
use crate::rays::{Hit, Ray};
use crate::simd::LANES;

/// The answers of the rays of a batch, all of them misses at first.
pub(crate) trait Answers {
    type Goal: Goal;
    type Answer;
    /// What they answer.
    fn goal(&self) -> Self::Goal;
    /// Stores the answer of a ray.
    fn put(&mut self, ray: usize, answer: Self::Answer);
    /// Merges an answer in an object into that of the ray with this index in the scene. `t_scale` is the factor from t in object space
    /// to t in world space.
    fn merge(&mut self, index: usize, found: Self::Answer, ray: &Ray, t_scale: f32);
    /// The answers of sixteen rays from `ray` on, if there are so many, and they are kept as they are.
    fn lanes(&mut self, ray: usize) -> Option<&mut [Self::Answer; LANES]>;
    /// Exchanges the answers of two rays.
    fn swap(&mut self, a: usize, b: usize);
    /// These answers, as those of either goal.
    fn either(&mut self) -> EitherAnswers<'_>;
}

impl Answers for &mut [Hit] {
    type Goal = NearestHit;
    type Answer = Hit;
    #[inline(always)]
    fn goal(&self) -> NearestHit {
        NearestHit
    }
    #[inline(always)]
    fn put(&mut self, ray: usize, answer: Hit) {
        self[ray] = answer;
    }
    #[inline(always)]
    fn merge(&mut self, index: usize, found: Hit, ray: &Ray, t_scale: f32) {
        let best = &mut self[index];
        *best = better(ray, best, &found, t_scale).unwrap_or(*best);
    }
    #[inline(always)]
    fn lanes(&mut self, ray: usize) -> Option<&mut [Hit; LANES]> {
        self[ray..].first_chunk_mut()
    }
    fn swap(&mut self, a: usize, b: usize) {
        <[Hit]>::swap(self, a, b);
    }
    fn either(&mut self) -> EitherAnswers<'_> {
        EitherAnswers::Nearest(self)
    }
}

impl Answers for &mut [bool] {
    type Goal = AnyHit;
    type Answer = bool;
    #[inline(always)]
    fn goal(&self) -> AnyHit {
        AnyHit
    }
    #[inline(always)]
    fn put(&mut self, ray: usize, answer: bool) {
        self[ray] = answer;
    }
    #[inline(always)]
    fn merge(&mut self, index: usize, found: bool, _ray: &Ray, _t_scale: f32) {
        self[index] |= found;
    }
    #[inline(always)]
    fn lanes(&mut self, ray: usize) -> Option<&mut [bool; LANES]> {
        self[ray..].first_chunk_mut()
    }
    fn swap(&mut self, a: usize, b: usize) {
        <[bool]>::swap(self, a, b);
    }
    fn either(&mut self) -> EitherAnswers<'_> {
        EitherAnswers::Any(self)
    }
}

/// Answers of either goal.
pub(crate) enum EitherAnswers<'a> {
    Nearest(&'a mut [Hit]),
    /// Whether rays hit anything. Of the answers that are stored here nothing else is kept.
    Any(&'a mut [bool]),
}

impl EitherAnswers<'_> {
    #[inline(always)]
    pub(crate) fn reborrow(&mut self) -> EitherAnswers<'_> {
        match self {
            EitherAnswers::Nearest(hits) => EitherAnswers::Nearest(hits),
            EitherAnswers::Any(found) => EitherAnswers::Any(found),
        }
    }
}

impl Answers for EitherAnswers<'_> {
    type Goal = super::goal::EitherGoal;
    type Answer = Hit;
    #[inline(always)]
    fn goal(&self) -> Self::Goal {
        super::goal::EitherGoal { is_any: matches!(self, EitherAnswers::Any(_)) }
    }
    #[inline(always)]
    fn put(&mut self, ray: usize, answer: Hit) {
        match self {
            EitherAnswers::Nearest(hits) => hits.put(ray, answer),
            EitherAnswers::Any(found) => found.put(ray, answer.is_hit()),
        }
    }
    #[inline(always)]
    fn merge(&mut self, index: usize, answer: Hit, ray: &Ray, t_scale: f32) {
        match self {
            EitherAnswers::Nearest(hits) => hits.merge(index, answer, ray, t_scale),
            EitherAnswers::Any(found) => found.merge(index, answer.is_hit(), ray, t_scale),
        }
    }
    #[inline(always)]
    fn lanes(&mut self, ray: usize) -> Option<&mut [Hit; LANES]> {
        match self {
            EitherAnswers::Nearest(hits) => hits.lanes(ray),
            EitherAnswers::Any(_) => None,
        }
    }
    fn swap(&mut self, a: usize, b: usize) {
        match self {
            EitherAnswers::Nearest(hits) => hits.swap(a, b),
            EitherAnswers::Any(found) => found.swap(a, b),
        }
    }
    fn either(&mut self) -> EitherAnswers<'_> {
        self.reborrow()
    }
}
