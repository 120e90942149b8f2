//! Destination of the answers of a batch: one type for models and for scenes, so that every kernel is compiled once for both.

use super::{AnswerLanes, Answers, AnswersOf, EitherQuery, Goal, Query};
use crate::intersect::exact_lanes::Intersections;
use crate::intersect::start_point::Starts;
use crate::rays::{PrimitiveRef, Ray};
use crate::simd::{LANES, Simd};

/// The traversal of one instance by one ray of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    /// Index of the ray in the scene's batch.
    pub(crate) ray: u32,
    pub(crate) instance: u32,
}

/// Maps the rays of a batch in object space to the rays of the scene's batch from which they were transformed.
#[derive(Clone, Copy)]
pub(crate) struct SceneRays<'a> {
    /// All rays of the scene's batch, in world space.
    pub(crate) rays: &'a [Ray],
    /// For each ray in object space its ray in the scene, and the instance.
    pub(crate) visits: &'a [Visit],
    /// For each ray in object space the factor from its t to t in world space.
    pub(crate) t_scale: &'a [f32],
}

/// Stores the answers of the rays of a batch. Rays for which nothing is reported keep their initial answer, a miss.
pub(crate) struct Sink<'a, Q: Query> {
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
    answers: AnswersOf<'a, Q>,
    /// Instance that is reported with a hit if there is no `scene`.
    instance: u32,
    /// If set, answers are merged into those of the scene's rays.
    scene: Option<SceneRays<'a>>,
    /// Index in the batch of the ray with index 0 in calls.
    first: usize,
    /// Where the rays of the batch start.
    starts: Starts<'a>,
}

impl<'a, Q: Query> Sink<'a, Q> {
    /// Stores the answer of ray i in `answers[i]`.
    pub(crate) fn new(ids: &'a [u32], answers: AnswersOf<'a, Q>, instance: u32) -> Self {
        Sink { ids, answers, instance, scene: None, first: 0, starts: Starts::NONE }
    }

    /// The same sink for rays with these starts.
    pub(crate) fn with_starts(self, starts: Starts<'a>) -> Self {
        Sink { starts, ..self }
    }

    /// Where the rays start, by their index in calls.
    #[inline(always)]
    pub(crate) fn starts(&self) -> Starts<'a> {
        self.starts.from(self.first)
    }

    /// Merges the answer of each visit into the answer of its ray; `answers` are those of the scene's batch.
    pub(crate) fn of_scene(ids: &'a [u32], answers: AnswersOf<'a, Q>, scene: SceneRays<'a>) -> Self {
        Sink { ids, answers, instance: 0, scene: Some(scene), first: 0, starts: Starts::NONE }
    }

    /// What the answers are about.
    #[inline(always)]
    pub(crate) fn goal(&self) -> Q::Goal {
        self.answers.goal()
    }

    /// A sink for the rays from `first` on, whose indices in calls begin at 0.
    #[inline(always)]
    pub(crate) fn part(&mut self, first: usize) -> Sink<'_, Q> {
        let (ids, instance, scene, starts) = (self.ids, self.instance, self.scene, self.starts);
        let answers = Q::Goal::reborrow(&mut self.answers);
        Sink { ids, answers, instance, scene, first: self.first + first, starts }
    }

    /// A sink for the same rays, to which queries of either goal report.
    pub(crate) fn either(&mut self) -> Sink<'_, EitherQuery> {
        let Sink { ids, instance, scene, first, starts, .. } = *self;
        Sink { ids, answers: self.answers.either(), instance, scene, first, starts }
    }

    /// The instance that is reported with a hit of a ray.
    pub(crate) fn instance_of(&self, ray: usize) -> u32 {
        self.scene.as_ref().map_or(self.instance, |scene| scene.visits[self.first + ray].instance)
    }

    /// Stores the answer of a ray, which reports the instance of [`Self::instance_of`].
    pub(crate) fn answer(&mut self, ray: usize, answer: Q::Answer) {
        let index = self.first + ray;
        match &self.scene {
            None => self.answers.put(index, answer),
            Some(_) => self.merge(index, answer),
        }
    }

    /// Stores the answer of a query that has ended.
    #[inline(always)]
    pub(crate) fn query(&mut self, ray: usize, query: &Q) {
        let index = self.first + ray;
        match &self.scene {
            None => self.answers.put(index, query.answer(self.ids, self.instance)),
            Some(scene) => {
                let answer = query.answer(self.ids, scene.visits[index].instance);
                self.merge(index, answer);
            }
        }
    }

    /// Records that `ray` hits something.
    #[inline(always)]
    pub(crate) fn accepted(&mut self, ray: usize) {
        let index = self.first + ray;
        match &self.scene {
            None => self.answers.put(index, Q::ACCEPTED),
            Some(_) => self.merge(index, Q::ACCEPTED),
        }
    }

    /// Stores the nearest hit of a ray; t, u and v are already rounded. They are separate parameters, because an aggregate
    /// would be passed through memory and stall the load that follows.
    #[inline(always)]
    pub(crate) fn hit(&mut self, ray: usize, triangle: u32, t: f32, u: f32, v: f32) {
        let index = self.first + ray;
        match &self.scene {
            None => {
                let primitive = PrimitiveRef { instance: self.instance, triangle };
                self.answers.put(index, Q::answer_of(primitive, t, u, v));
            }
            Some(scene) => {
                let instance = scene.visits[index].instance;
                self.merge(index, Q::answer_of(PrimitiveRef { instance, triangle }, t, u, v));
            }
        }
    }

    /// Stores the hits of up to sixteen consecutive rays from `ray` on. Bit i of `lanes` is set if ray i hits; nothing may have
    /// been reported for these rays before.
    #[inline(always)]
    pub(crate) fn hits<S: Simd>(&mut self, s: S, ray: usize, mut lanes: u32, found: &Intersections) {
        if self.scene.is_none()
            && let Some(answers) = self.answers.lanes(self.first + ray)
        {
            let hits = AnswerLanes { lanes, intersections: found, instance: self.instance };
            return Q::answers_of(s, &hits, answers);
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            self.hit(ray + lane, found.triangle[lane], found.t[lane], found.u[lane], found.v[lane]);
        }
    }

    /// Merges the answer of a visit into the answer of its ray.
    #[inline(never)]
    fn merge(&mut self, visit: usize, answer: Q::Answer) {
        let Some(SceneRays { rays, visits, t_scale }) = &self.scene else { return };
        let ray = visits[visit].ray as usize;
        self.answers.merge(ray, answer, &rays[ray], t_scale[visit]);
    }
}
