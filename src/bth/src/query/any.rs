//! Queries for any hit, with a type of their own.

use super::goal::{AnyHit, EitherGoal};
use super::{AnswerLanes, EitherQuery, Query, TriangleRef, in_range, may_be_in_range};
use crate::intersect::exact::Intersection;
use crate::intersect::line::widened;
use crate::rays::{PrimitiveRef, Ray};
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;

/// Query for any hit: it is complete at the first intersection in the ray's range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Any {
    tmin: f32,
    tmax: f32,
    found: bool,
}

impl Query for Any {
    type Goal = AnyHit;
    type Answer = bool;
    #[inline(always)]
    fn goal(&self) -> AnyHit {
        AnyHit
    }
    fn answer(&self, _ids: &[u32], _instance: u32) -> bool {
        self.found
    }
    fn answer_of(_surface: PrimitiveRef, _t: f32, _u: f32, _v: f32) -> bool {
        true
    }
    fn answers_of<S: Simd>(_s: S, hits: &AnswerLanes<'_>, answers: &mut [bool; LANES]) {
        for (lane, found) in answers.iter_mut().enumerate() {
            *found = hits.lanes >> lane & 1 != 0;
        }
    }
    fn new(_goal: AnyHit, ray: &Ray) -> Self {
        Any { tmin: ray.tmin, tmax: ray.tmax, found: false }
    }
    fn to_either(&self) -> EitherQuery {
        let mut query = EitherQuery::of_range(EitherGoal { is_any: true }, self.tmin, self.tmax);
        if self.found {
            query.accept();
        }
        query
    }
    fn from_either(_goal: AnyHit, query: &EitherQuery) -> Self {
        Any { tmin: query.tmin, tmax: query.tmax, found: query.triangle != NONE }
    }
    #[inline(always)]
    fn offer(&mut self, _triangle: TriangleRef<'_>, intersection: Intersection) -> bool {
        self.found |= in_range(intersection.t as f32, self.tmin, self.tmax);
        self.found
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        widened(f64::from(self.tmax))
    }
    fn may_matter(&self, t: [f64; 2]) -> bool {
        may_be_in_range(t, self.tmin, self.limit())
    }
    fn found(&self) -> Option<f64> {
        None
    }
    fn accept(&mut self) {
        self.found = true;
    }
    const ACCEPTED: bool = true;
}
