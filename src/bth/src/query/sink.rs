//! Destination of the answers of a batch: one type for models and for scenes, and for both goals,
//! so that every kernel is compiled once for all.

use super::{EitherGoal, Goal, RayQuery, better};
use crate::intersect::exact_lanes::Intersections;
use crate::intersect::exact_ray::Lines;
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::layout::NONE;

/// The traversal of one instance by one ray of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Visit {
    /// Index of the ray in the scene's batch.
    pub(crate) ray: u32,
    pub(crate) instance: u32,
}

/// Returns the new hit of a ray of the scene's batch, given by its index, with its t in world space
/// if it is better than the best one so far, which comes first. The number is the factor from t in
/// object space to t in world space.
pub(crate) type Better<'a> = dyn Fn(usize, &Hit, &Hit, f32) -> Option<Hit> + 'a;

/// Maps the rays of a batch in object space to the rays of the scene's batch from which they were
/// transformed.
#[derive(Clone, Copy)]
pub(crate) struct SceneRays<'a> {
    /// All rays of the scene's batch, in world space.
    pub(crate) rays: &'a [Ray],
    /// How hits of rays in f64 are compared, if they are.
    pub(crate) better_wide: Option<&'a Better<'a>>,
    /// For each ray in object space its ray in the scene, and the instance.
    pub(crate) visits: &'a [Visit],
    /// For each ray in object space the factor from its t to t in world space.
    pub(crate) t_scale: &'a [f32],
}

/// The answers of the rays of a batch, all of them misses at first.
pub(crate) enum Answers<'a> {
    /// The nearest hits.
    Nearest(&'a mut [Hit]),
    /// True for rays that hit anything.
    Any(&'a mut [bool]),
}

impl Answers<'_> {
    /// The same answers for a shorter time.
    #[inline(always)]
    pub(crate) fn reborrow(&mut self) -> Answers<'_> {
        match self {
            Answers::Nearest(hits) => Answers::Nearest(hits),
            Answers::Any(found) => Answers::Any(found),
        }
    }

    /// What the answers are about.
    #[inline(always)]
    pub(crate) fn goal(&self) -> EitherGoal {
        EitherGoal { is_any: matches!(self, Answers::Any(_)) }
    }

    /// Makes all answers misses.
    pub(crate) fn clear(&mut self) {
        match self {
            Answers::Nearest(hits) => fill_misses(hits),
            Answers::Any(found) => found.fill(false),
        }
    }

    /// Exchanges the answers of two rays.
    pub(crate) fn swap(&mut self, a: usize, b: usize) {
        match self {
            Answers::Nearest(hits) => hits.swap(a, b),
            Answers::Any(found) => found.swap(a, b),
        }
    }
}

/// Stores the answers of the rays of a batch. Rays for which nothing is reported keep their initial
/// answer, a miss.
pub(crate) struct Sink<'a> {
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
    answers: Answers<'a>,
    /// Instance that is reported with a hit if there is no `scene`.
    instance: u32,
    /// If set, answers are merged into the answers of the scene's rays.
    scene: Option<SceneRays<'a>>,
    /// Index in the batch of the ray with index 0 in calls.
    first: usize,
    /// The lines of the rays of the batch.
    lines: Lines<'a>,
}

impl<'a> Sink<'a> {
    /// Stores the answer of ray i as answer i.
    pub(crate) fn new(ids: &'a [u32], answers: Answers<'a>, instance: u32) -> Self {
        Sink { ids, answers, instance, scene: None, first: 0, lines: Lines::Rays }
    }

    /// Merges the answer of each visit into the answer of its ray; `answers` belong to the scene's
    /// batch.
    pub(crate) fn of_scene(ids: &'a [u32], answers: Answers<'a>, scene: SceneRays<'a>) -> Self {
        Sink { scene: Some(scene), ..Sink::new(ids, answers, 0) }
    }

    /// The same sink for rays with these lines.
    pub(crate) fn with_lines(self, lines: Lines<'a>) -> Self {
        Sink { lines, ..self }
    }

    /// The lines of the rays, by their index in calls.
    #[inline(always)]
    pub(crate) fn lines(&self) -> Lines<'a> {
        self.lines.from(self.first)
    }

    /// What the answers are about.
    #[inline(always)]
    pub(crate) fn goal(&self) -> EitherGoal {
        self.answers.goal()
    }

    /// A sink for the rays from `first` on, whose indices in calls begin at 0.
    #[inline(always)]
    pub(crate) fn part(&mut self, first: usize) -> Sink<'_> {
        let (ids, instance, scene, lines) = (self.ids, self.instance, self.scene, self.lines);
        let answers = self.answers.reborrow();
        Sink { ids, answers, instance, scene, first: self.first + first, lines }
    }

    /// The instance that is reported with a hit of a ray.
    #[inline(always)]
    pub(crate) fn instance_of(&self, ray: usize) -> u32 {
        self.scene.as_ref().map_or(self.instance, |scene| scene.visits[self.first + ray].instance)
    }

    /// Stores the answer of a ray.
    #[inline(always)]
    pub(crate) fn answer(&mut self, ray: usize, hit: Hit) {
        if hit.is_hit() {
            self.hit(ray, hit.primitive.triangle, hit.t, hit.u, hit.v);
        }
    }

    /// Stores the answer of a query that has ended.
    #[inline(always)]
    pub(crate) fn query<G: Goal>(&mut self, ray: usize, query: &RayQuery<G>) {
        self.answer(ray, query.answer(self.ids, self.instance_of(ray)));
    }

    /// Records that `ray` hits something, which answers an any-hit query.
    #[inline(always)]
    pub(crate) fn accepted(&mut self, ray: usize) {
        self.hit(ray, NONE, 0.0, 0.0, 0.0);
    }

    /// Stores a hit of a ray; t, u and v are already rounded. They are separate parameters, here
    /// and in [`Self::merge`], because an aggregate would be passed through memory and stall the
    /// load that follows.
    #[inline(always)]
    pub(crate) fn hit(&mut self, ray: usize, triangle: u32, t: f32, u: f32, v: f32) {
        let index = self.first + ray;
        match (&self.scene, &mut self.answers) {
            (None, Answers::Nearest(hits)) => {
                let primitive = PrimitiveRef { instance: self.instance, triangle };
                hits[index] = Hit { t, u, v, primitive };
            }
            (None, Answers::Any(found)) => found[index] = true,
            (Some(_), _) => self.merge(index, triangle, t, u, v),
        }
    }

    /// Stores the hits of up to sixteen consecutive rays from `ray` on. Bit i of `lanes` is set if
    /// ray i hits; nothing may have been reported for these rays before.
    #[inline(always)]
    pub(crate) fn hits<S: Simd>(&mut self, s: S, ray: usize, mut lanes: u32, found: &Intersections) {
        if self.scene.is_none()
            && let Answers::Nearest(hits) = &mut self.answers
            && let Some(hits) = hits[self.first + ray..].first_chunk_mut()
        {
            return store_hits(s, lanes, found, self.instance, hits);
        }
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            self.hit(ray + lane, found.triangle[lane], found.t[lane], found.u[lane], found.v[lane]);
        }
    }

    /// Merges the hit of a visit into the answer of its ray.
    #[inline(never)]
    fn merge(&mut self, visit: usize, triangle: u32, t: f32, u: f32, v: f32) {
        let Some(SceneRays { rays, better_wide, visits, t_scale }) = &self.scene else { return };
        let Visit { ray, instance } = visits[visit];
        let hit = Hit { t, u, v, primitive: PrimitiveRef { instance, triangle } };
        match &mut self.answers {
            Answers::Nearest(hits) => {
                let best = &mut hits[ray as usize];
                let (at, t_scale) = (ray as usize, t_scale[visit]);
                // The results of two branches would be passed through memory.
                if let Some(better) = better_wide {
                    *best = better(at, best, &hit, t_scale).unwrap_or(*best);
                } else if let Some(nearer) = better(&rays[at], best, &hit, t_scale) {
                    *best = nearer;
                }
            }
            Answers::Any(found) => found[ray as usize] |= hit.is_hit(),
        }
    }
}

/// Stores the hits of sixteen rays in an instance; rays whose bit is not set in `lanes` are misses.
#[inline(always)]
pub(crate) fn store_hits<S: Simd>(
    s: S,
    lanes: u32,
    found: &Intersections,
    instance: u32,
    hits: &mut [Hit; LANES],
) {
    let m = s.mask(lanes);
    let Hit { t, u, v, primitive } = Hit::MISS;
    let t = s.select(m, s.load(&found.t), s.splat(t));
    let u = s.select(m, s.load(&found.u), s.splat(u));
    let v = s.select(m, s.load(&found.v), s.splat(v));
    let instance = s.select_u(m, s.splat_u(instance), s.splat_u(primitive.instance));
    let triangle = s.select_u(m, s.load_u(&found.triangle), s.splat_u(primitive.triangle));
    s.store_rows5([s.bits(t), s.bits(u), s.bits(v), instance, triangle], zerocopy::transmute_mut!(hits));
}

/// Fewest hits for which the call of a kernel takes less time than a loop.
const MIN_HITS: usize = 4;

/// Fills `hits` with [`Hit::MISS`].
#[inline]
fn fill_misses(hits: &mut [Hit]) {
    if hits.len() < MIN_HITS {
        hits.fill(Hit::MISS);
    } else {
        Isa::chosen().run(MissKernel(hits));
    }
}

/// The kernel of [`fill_misses`], which stores whole vectors.
struct MissKernel<'a>(&'a mut [Hit]);

impl Kernel for MissKernel<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if !S::HAS_VECTORS {
            return self.0.fill(Hit::MISS);
        }
        let (blocks, rest) = self.0.as_chunks_mut();
        for block in blocks {
            store_hits(s, 0, &Intersections::NONE, NONE, block);
        }
        rest.fill(Hit::MISS);
    }
}
