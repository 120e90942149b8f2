//! Where a batch's answers go: one type for models and for scenes, so that every kernel is compiled once for both.

use super::{AnswerLanes, Query};
use crate::intersect::exact_lanes::Intersections;
use crate::rays::{Ray, Surface};
use crate::simd::{LANES, Simd};

/// A ray of a scene that is traced through an instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    /// Place of the ray in the scene's batch.
    pub(crate) ray: u32,
    pub(crate) instance: u32,
}

/// Relates the rays of a batch in object space to those of the scene that they come from.
#[derive(Clone, Copy)]
pub(crate) struct SceneRays<'a> {
    /// All rays of the scene's batch, in world space.
    pub(crate) rays: &'a [Ray],
    /// For each ray in object space the one it comes from, and its instance.
    pub(crate) visits: &'a [Visit],
    /// For each ray in object space the factor that turns its t into the world's.
    pub(crate) t_scale: &'a [f32],
}

/// Takes in what the rays of a batch hit. Rays of which nothing is reported keep the answer that is there: a miss at first.
pub(crate) struct Sink<'a, Q: Query> {
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
    answers: &'a mut [Q::Answer],
    /// The instance that is reported with a hit, unless the visit names it.
    instance: u32,
    scene: Option<SceneRays<'a>>,
    /// Place in the batch of the ray that kernels count from.
    first: usize,
}

impl<'a, Q: Query> Sink<'a, Q> {
    /// Answers by the places of their rays in the batch.
    pub(crate) fn new(ids: &'a [u32], answers: &'a mut [Q::Answer], instance: u32) -> Self {
        Sink { ids, answers, instance, scene: None, first: 0 }
    }

    /// Answers of all rays of a scene's batch: what a visit finds is merged into its ray's.
    pub(crate) fn of_scene(ids: &'a [u32], answers: &'a mut [Q::Answer], scene: SceneRays<'a>) -> Self {
        Sink { ids, answers, instance: 0, scene: Some(scene), first: 0 }
    }

    /// The same answers for a part of the rays, which begins at `first`.
    #[inline(always)]
    pub(crate) fn part(&mut self, first: usize) -> Sink<'_, Q> {
        let Sink { ids, instance, scene, .. } = *self;
        Sink { ids, answers: self.answers, instance, scene, first: self.first + first }
    }

    /// Takes in the answer of a query that has ended.
    #[inline(always)]
    pub(crate) fn query(&mut self, ray: usize, query: &Q) {
        let at = self.first + ray;
        match &self.scene {
            None => self.answers[at] = query.answer(self.ids, self.instance),
            Some(scene) => {
                let answer = query.answer(self.ids, scene.visits[at].instance);
                self.merge(at, answer);
            }
        }
    }

    /// Takes in the nearest hit of a ray, as it is reported. (The numbers come one by one, because a pair of them that passes
    /// through memory stalls the load that follows.)
    #[inline(always)]
    pub(crate) fn hit(&mut self, ray: usize, triangle: u32, t: f32, u: f32, v: f32) {
        let at = self.first + ray;
        match &self.scene {
            None => {
                self.answers[at] = Q::answer_of(Surface { instance: self.instance, triangle }, t, u, v);
            }
            Some(scene) => {
                let instance = scene.visits[at].instance;
                self.merge(at, Q::answer_of(Surface { instance, triangle }, t, u, v));
            }
        }
    }

    /// Takes in the hits of up to sixteen rays from this one on, a bit each, of which nothing has been reported before.
    #[inline(always)]
    pub(crate) fn hits<S: Simd>(&mut self, s: S, ray: usize, mut lanes: u32, found: &Intersections) {
        if self.scene.is_none()
            && let Some(to) = self.answers[self.first + ray..].first_chunk_mut()
        {
            let hits = AnswerLanes { lanes, intersections: found, instance: self.instance };
            return Q::answers_of(s, &hits, to);
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            self.hit(ray + lane, found.triangle[lane], found.t[lane], found.u[lane], found.v[lane]);
        }
    }

    /// Merges the answer of a visit into that of its ray.
    #[inline(never)]
    fn merge(&mut self, visit: usize, answer: Q::Answer) {
        let Some(SceneRays { rays, visits, t_scale }) = &self.scene else { return };
        let ray = visits[visit].ray as usize;
        Q::merge(&mut self.answers[ray], answer, &rays[ray], t_scale[visit]);
    }
}
