//! Queries over rays, nearest hit and any hit, and the statistics of their traversal.

mod any;
mod goal;
pub(crate) mod sink;
#[cfg(test)]
mod tests;

pub(crate) use self::any::Any;
#[cfg(test)]
pub(crate) use self::goal::EitherAnswers;
pub(crate) use self::goal::{Answer, Answers, AnyHit, EitherGoal, Goal, NearestHit};

use crate::intersect::exact::{Intersection, reported};
use crate::intersect::exact_lanes::Intersections;
use crate::intersect::line::widened;
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;

/// Hits of sixteen rays in an object.
pub(crate) struct AnswerLanes<'a> {
    /// Bits of the rays that hit anything.
    pub(crate) lanes: u32,
    pub(crate) intersections: &'a Intersections,
    /// Instance that is reported with the hits.
    pub(crate) instance: u32,
}

/// A triangle, by its id or by its index in the leaf order of an object. Reading an id is most often a cache miss, and the id
/// is not needed until the query ends: traversals prefetch it when they find the triangle, and the query reads it at its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleRef<'a> {
    /// The id, or the index in `ids`.
    value: u32,
    is_index: bool,
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
}

impl<'a> TriangleRef<'a> {
    /// The triangle with this id.
    #[inline(always)]
    pub(crate) fn id(id: u32, ids: &'a [u32]) -> Self {
        TriangleRef { value: id, is_index: false, ids }
    }
    /// The triangle whose id is `ids[index]`.
    #[inline(always)]
    pub(crate) fn index(index: u32, ids: &'a [u32]) -> Self {
        TriangleRef { value: index, is_index: true, ids }
    }
    /// The id.
    pub(crate) fn read(&self) -> u32 {
        if self.is_index { self.ids[self.value as usize] } else { self.value }
    }
}

/// State of a query over one ray: its range of t and the best hit so far. Values of t are in units of the ray's direction.
pub(crate) trait Query: Copy {
    /// What it looks for.
    type Goal: Goal<Answer = Self::Answer>;
    /// Result of the query.
    type Answer: Answer;
    /// The result of a traversal that has ended. `ids` are the ids of the object's triangles in leaf order, and `instance` is
    /// reported with a hit.
    fn answer(&self, ids: &[u32], instance: u32) -> Self::Answer;
    /// The result for a hit in the ray's range whose t, u and v are already rounded.
    fn answer_of(primitive: PrimitiveRef, t: f32, u: f32, v: f32) -> Self::Answer;
    /// Writes the results of sixteen rays; rays whose bit is not set in `hits.lanes` are misses.
    fn answers_of<S: Simd>(s: S, hits: &AnswerLanes<'_>, answers: &mut [Self::Answer; LANES]);
    /// A query without hits over the range of `ray`.
    fn new(goal: Self::Goal, ray: &Ray) -> Self;
    /// What it looks for.
    fn goal(&self) -> Self::Goal;
    /// The same query, with a goal that is known at run time only.
    fn to_either(&self) -> EitherQuery;
    /// The query with the range and the hits of another one, whose goal is the same.
    fn from_either(goal: Self::Goal, query: &EitherQuery) -> Self;
    /// Offers an intersection with a triangle of the object. Returns whether the query is complete.
    fn offer(&mut self, triangle: TriangleRef<'_>, intersection: Intersection) -> bool;
    /// Upper bound of the exact t of intersections that can still change the result.
    fn limit(&self) -> f64;
    /// Whether an intersection with a t between two values can change the result. It seldom can for the triangle on which a ray
    /// starts; exact arithmetic is then avoided.
    fn may_matter(&self, t: [f64; 2]) -> bool;
    /// t of the nearest hit so far, if there is one; always None for any-hit queries.
    fn found(&self) -> Option<f64>;
    /// Lower and upper bound of the t of [`Self::found`].
    #[inline(always)]
    fn found_bounds(&self) -> Option<[f64; 2]> {
        let limit = self.limit();
        // The lower bound lies as far below t as the limit lies above it.
        self.found().map(|t| [2.0 * t - limit, limit])
    }
    /// Notes that a triangle is certainly hit within the ray's range, which completes an any-hit query.
    fn accept(&mut self);
    /// The result of an any-hit query after [`Self::accept`].
    const ACCEPTED: Self::Answer;
}

/// The answers to queries of a type.
pub(crate) type AnswersOf<'a, Q> = <<Q as Query>::Goal as Goal>::Answers<'a>;

/// Query for the nearest hit: the least t, and among equal t the least triangle id. This order does not depend on the traversal. Where
/// its goal is any hit, it holds that in place of the nearest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest<G = NearestHit> {
    tmin: f32,
    tmax: f32,
    /// The nearest triangle so far, by its id or by its index in leaf order ([`TriangleRef`]); `NONE` if nothing is hit.
    triangle: u32,
    is_index: bool,
    goal: G,
    /// The nearest intersection so far. Its t is `tmax` if nothing is hit.
    best: Intersection,
}

/// The query of walks through tetrahedra, which are compiled once for both goals.
pub(crate) type EitherQuery = Nearest<EitherGoal>;

impl EitherQuery {
    /// For any hits: offers a certain intersection of which only bounds of t are known, which include all roundings. Returns whether
    /// the query is complete.
    pub(crate) fn offer_bounds(&mut self, t: (f64, f64)) -> bool {
        let finite = f64::from(f32::MIN) <= t.0 && t.1 <= f64::from(f32::MAX);
        if finite && f64::from(self.tmin) <= t.0 && t.1 <= f64::from(self.tmax) {
            self.accept();
        }
        self.goal.is_any() && self.triangle != NONE
    }
}

impl<G: Goal> Nearest<G> {
    /// A query without hits.
    #[inline(always)]
    fn of_range(goal: G, tmin: f32, tmax: f32) -> Self {
        let best = Intersection { t: f64::from(tmax), weight: [0.0, 0.0, 1.0] };
        Nearest { tmin, tmax, triangle: NONE, is_index: false, goal, best }
    }
    /// The same query with another type of goal.
    fn with_goal<H>(&self, goal: H) -> Nearest<H> {
        let &Nearest { tmin, tmax, triangle, is_index, best, .. } = self;
        Nearest { tmin, tmax, triangle, is_index, goal, best }
    }
    /// The nearest triangle so far.
    fn best_triangle<'a>(&self, ids: &'a [u32]) -> TriangleRef<'a> {
        TriangleRef { value: self.triangle, is_index: self.is_index, ids }
    }
}

impl<G: Goal<Answer = Hit>> Query for Nearest<G> {
    type Goal = G;
    type Answer = Hit;
    #[inline(always)]
    fn goal(&self) -> G {
        self.goal
    }
    fn answer(&self, ids: &[u32], instance: u32) -> Hit {
        if self.triangle == NONE {
            return Hit::MISS;
        }
        if self.goal.is_any() {
            return Self::ACCEPTED;
        }
        let primitive = PrimitiveRef { instance, triangle: self.best_triangle(ids).read() };
        let [u, v] = self.best.uv();
        Self::answer_of(primitive, reported(self.best.t), u, v)
    }
    #[inline(always)]
    fn answer_of(primitive: PrimitiveRef, t: f32, u: f32, v: f32) -> Hit {
        Hit { t, u, v, primitive }
    }
    #[inline(always)]
    fn answers_of<S: Simd>(s: S, hits: &AnswerLanes<'_>, answers: &mut [Hit; LANES]) {
        let &AnswerLanes { lanes, intersections, instance } = hits;
        let m = s.mask(lanes);
        let Hit { t, u, v, primitive } = Hit::MISS;
        let t = s.select(m, s.load(&intersections.t), s.splat(t));
        let u = s.select(m, s.load(&intersections.u), s.splat(u));
        let v = s.select(m, s.load(&intersections.v), s.splat(v));
        let instance = s.select_u(m, s.splat_u(instance), s.splat_u(primitive.instance));
        let triangle = s.select_u(m, s.load_u(&intersections.triangle), s.splat_u(primitive.triangle));
        s.store_rows5(
            [s.bits(t), s.bits(u), s.bits(v), instance, triangle],
            zerocopy::transmute_mut!(answers),
        );
    }
    fn new(goal: G, ray: &Ray) -> Self {
        Nearest::of_range(goal, ray.tmin, ray.tmax)
    }
    fn to_either(&self) -> EitherQuery {
        self.with_goal(EitherGoal { is_any: self.goal.is_any() })
    }
    fn from_either(goal: G, query: &EitherQuery) -> Self {
        query.with_goal(goal)
    }
    #[inline(always)]
    fn offer(&mut self, triangle: TriangleRef<'_>, intersection: Intersection) -> bool {
        let nearer = self.triangle == NONE
            || intersection.t < self.best.t
            || (intersection.t == self.best.t && triangle.read() < self.best_triangle(triangle.ids).read());
        if nearer && in_range(intersection.t as f32, self.tmin, self.tmax) {
            (self.triangle, self.is_index) = (triangle.value, triangle.is_index);
            self.best = intersection;
        }
        self.goal.is_any() && self.triangle != NONE
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        widened(self.best.t)
    }
    fn may_matter(&self, t: [f64; 2]) -> bool {
        may_be_in_range(t, self.tmin, self.limit())
    }
    fn found(&self) -> Option<f64> {
        (self.triangle != NONE && !self.goal.is_any()).then_some(self.best.t)
    }
    fn accept(&mut self) {
        if self.goal.is_any() {
            (self.triangle, self.is_index) = (0, false);
        }
    }
    const ACCEPTED: Hit = Hit { t: 0.0, ..Hit::MISS };
}

/// The new hit of a ray in a scene, with its t in world space, if it is better than `best`: a lesser t, or an equal t and a
/// lesser instance. None if it is not better, or if its t in world space lies outside the ray's range.
pub(crate) fn better(ray: &Ray, best: &Hit, hit: &Hit, t_scale: f32) -> Option<Hit> {
    if !hit.is_hit() {
        return None;
    }
    // With a factor of 1, t is not rounded again.
    let t = if t_scale == 1.0 { hit.t } else { hit.t * t_scale };
    let hit = Hit { t, ..*hit };
    let nearer = hit.t < best.t || hit.t == best.t && hit.primitive.instance < best.primitive.instance;
    (nearer && in_range(hit.t, ray.tmin, ray.tmax)).then_some(hit)
}

/// Whether a t between two values may lie between `tmin` and `limit` after rounding to f32.
pub(crate) fn may_be_in_range(t: [f64; 2], tmin: f32, limit: f64) -> bool {
    t[0] <= limit && (t[1] as f32).next_up() >= tmin
}

/// Whether a t that is already rounded for the answer lies in the ray's range and is finite.
#[inline(always)]
pub(crate) fn in_range(t: f32, tmin: f32, tmax: f32) -> bool {
    tmin <= t && t <= tmax && t.is_finite()
}

/// Receiver of the statistics of a traversal; `()` counts nothing.
pub(crate) trait Count {
    /// A wide node was entered.
    fn node(&mut self) {}
    /// A leaf was entered.
    fn leaf(&mut self) {}
    /// This many triangles were tested.
    fn triangles(&mut self, _n: u32) {}
    /// A tetrahedron was walked through.
    fn tet(&mut self) {}
    /// A walk was repeated exactly.
    fn flood(&mut self) {}
}

impl Count for () {}

/// Statistics of the traversal of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Wide nodes entered.
    pub nodes: u32,
    /// Triangle and tet leaves entered.
    pub leaves: u32,
    /// Triangles tested in leaves.
    pub triangles: u32,
    /// Tetrahedra walked through.
    pub tets: u32,
    /// Walks through tetrahedra that were repeated exactly, because the ray passes through a vertex, an edge or a face plane.
    pub floods: u32,
}

impl std::ops::AddAssign for Steps {
    fn add_assign(&mut self, other: Steps) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.triangles += other.triangles;
        self.tets += other.tets;
        self.floods += other.floods;
    }
}

impl Count for Steps {
    fn node(&mut self) {
        self.nodes += 1;
    }
    fn leaf(&mut self) {
        self.leaves += 1;
    }
    fn triangles(&mut self, n: u32) {
        self.triangles += n;
    }
    fn tet(&mut self) {
        self.tets += 1;
    }
    fn flood(&mut self) {
        self.floods += 1;
    }
}
