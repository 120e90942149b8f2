//! What queries look for. A goal is a value, which kernels ask for at run time. Goals that are types of no size have kernels of their
//! own; walks through tetrahedra, batches with vectors of 128 bits, and with the feature `small` all kernels, serve both by
//! [`EitherGoal`].

#[cfg(not(feature = "small"))]
use super::Any;
use super::Nearest;
use super::answers::Answers;
use crate::rays::Hit;

/// What a query looks for: the nearest hit, or any.
pub(crate) trait Goal: Copy {
    /// The result of a ray.
    type Answer: Answer;
    /// The results of the rays of a batch.
    type Answers<'a>: Answers<Goal = Self, Answer = Self::Answer>;
    /// Whether a query ends at the first hit found.
    fn is_any(self) -> bool;
    /// The same answers for a shorter time.
    fn reborrow<'s>(answers: &'s mut Self::Answers<'_>) -> Self::Answers<'s>;
}

/// The result of a ray.
pub(crate) trait Answer: Copy {
    /// Nothing is hit.
    const MISS: Self;
    /// Whether something is hit.
    fn is_hit(&self) -> bool;
}

impl Answer for Hit {
    const MISS: Hit = Hit::MISS;
    #[inline(always)]
    fn is_hit(&self) -> bool {
        Hit::is_hit(self)
    }
}

impl Answer for bool {
    const MISS: bool = false;
    #[inline(always)]
    fn is_hit(&self) -> bool {
        *self
    }
}

/// The nearest hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestHit;

impl Goal for NearestHit {
    type Answer = Hit;
    type Answers<'a> = &'a mut [Hit];
    #[inline(always)]
    fn is_any(self) -> bool {
        false
    }
    #[inline(always)]
    fn reborrow<'s>(answers: &'s mut Self::Answers<'_>) -> Self::Answers<'s> {
        answers
    }
}

/// Any hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnyHit;

impl Goal for AnyHit {
    type Answer = bool;
    type Answers<'a> = &'a mut [bool];
    #[inline(always)]
    fn is_any(self) -> bool {
        true
    }
    #[inline(always)]
    fn reborrow<'s>(answers: &'s mut Self::Answers<'_>) -> Self::Answers<'s> {
        answers
    }
}

/// One of both, known at run time only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EitherGoal {
    pub(crate) is_any: bool,
}

impl Goal for EitherGoal {
    type Answer = Hit;
    type Answers<'a> = super::answers::EitherAnswers<'a>;
    #[inline(always)]
    fn is_any(self) -> bool {
        self.is_any
    }
    #[inline(always)]
    fn reborrow<'s>(answers: &'s mut Self::Answers<'_>) -> Self::Answers<'s> {
        answers.reborrow()
    }
}

/// The queries by which objects are traced, for nearest and for any hits, with their goals and the answers that they store.
#[cfg(not(feature = "small"))]
mod chosen {
    use super::{Any, AnyHit, Hit, Nearest, NearestHit};

    pub(crate) type NearestQuery = Nearest;
    pub(crate) type AnyQuery = Any;
    pub(crate) const NEAREST: NearestHit = NearestHit;
    pub(crate) const ANY: AnyHit = AnyHit;

    #[inline(always)]
    pub(crate) fn nearest_answers(hits: &mut [Hit]) -> &mut [Hit] {
        hits
    }
    #[inline(always)]
    pub(crate) fn any_answers(found: &mut [bool]) -> &mut [bool] {
        found
    }
}

#[cfg(feature = "small")]
mod chosen {
    use super::{EitherGoal, Hit, Nearest};
    use crate::query::answers::EitherAnswers;

    pub(crate) type NearestQuery = Nearest<EitherGoal>;
    pub(crate) type AnyQuery = Nearest<EitherGoal>;
    pub(crate) const NEAREST: EitherGoal = EitherGoal { is_any: false };
    pub(crate) const ANY: EitherGoal = EitherGoal { is_any: true };

    #[inline(always)]
    pub(crate) fn nearest_answers(hits: &mut [Hit]) -> EitherAnswers<'_> {
        EitherAnswers::Nearest(hits)
    }
    #[inline(always)]
    pub(crate) fn any_answers(found: &mut [bool]) -> EitherAnswers<'_> {
        EitherAnswers::Any(found)
    }
}

pub(crate) use chosen::{ANY, AnyQuery, NEAREST, NearestQuery, any_answers, nearest_answers};
