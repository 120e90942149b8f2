//! Queries of rays: what they look for ([`Goal`]), what one ray has found so far ([`RayQuery`]),
//! where the answers of a batch go ([`sink`]), and the statistics of traversals ([`Count`]).

pub(crate) mod double;
pub(crate) mod sink;
#[cfg(test)]
mod tests;

use crate::intersect::exact::{Intersection, reported};
use crate::intersect::line::widened;
use crate::rays::{Hit, PrimitiveRef, Ray};
use bth_format::layout::NONE;

/// What a query looks for: the nearest hit, or any. Kernels ask a goal for it at run time. A goal
/// of size zero gets a separate kernel. Special leaves and batches with vectors of 128
/// bits serve both goals by [`EitherGoal`].
pub(crate) trait Goal: Copy {
    /// True if kernels of batches with this goal are compiled for vectors of 128 bits, and for
    /// longer ones.
    const QUADS: bool = false;
    const LONG_VECTORS: bool = true;
    /// True if [`Self::accepts`] may return false.
    const HAS_CONDITIONS: bool = false;
    /// Returns true if a query ends at the first hit found.
    fn is_any(self) -> bool;
    /// Returns true if a hit counts that is in the range of the ray, and better than all before.
    #[inline(always)]
    fn accepts(self, _triangle: TriangleRef<'_>, _found: &Intersection) -> bool {
        true
    }
}

/// The nearest hit: the smallest t, and among equal t the smallest triangle id. This order does not
/// depend on the traversal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearestHit;

/// Any hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnyHit;

/// Nearest or any hit, known at run time only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EitherGoal {
    pub(crate) is_any: bool,
}

impl Goal for NearestHit {
    #[inline(always)]
    fn is_any(self) -> bool {
        false
    }
}

impl Goal for AnyHit {
    #[inline(always)]
    fn is_any(self) -> bool {
        true
    }
}

impl Goal for EitherGoal {
    const QUADS: bool = true;
    const LONG_VECTORS: bool = false;
    #[inline(always)]
    fn is_any(self) -> bool {
        self.is_any
    }
}

/// Evaluates an expression with the goal of a batch as the type for which kernels of batches are
/// compiled. With vectors of 128 bits, with which kernels are long, one kernel serves both goals.
macro_rules! with_batch_goal {
    ($isa:expr, $either:expr, $goal:ident => $do:expr) => {
        match ($isa.has_long_vectors(), $either) {
            (false, $goal) => $do,
            (true, crate::query::EitherGoal { is_any: false }) => {
                let $goal = crate::query::NearestHit;
                $do
            }
            (true, crate::query::EitherGoal { is_any: true }) => {
                let $goal = crate::query::AnyHit;
                $do
            }
        }
    };
}
pub(crate) use with_batch_goal;

/// A triangle, by its id or by its index in the leaf order of an object. Reading an id is most
/// often a cache miss, and the id is not needed until the query ends: traversals prefetch it when
/// they find the triangle, and the query reads it at its end.
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

/// State of a query over one ray: its range of t and the best hit so far. Values of t are in units
/// of the ray's direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayQuery<G> {
    tmin: f32,
    tmax: f32,
    /// The best triangle so far, by its id or by its index in leaf order ([`TriangleRef`]); `NONE`
    /// if nothing is hit.
    triangle: u32,
    is_index: bool,
    goal: G,
    /// The best intersection so far. Its t is `tmax` if nothing is hit.
    best: Intersection,
}

/// The query of special leaves, which are compiled once for both goals.
pub(crate) type EitherQuery = RayQuery<EitherGoal>;

impl EitherQuery {
    /// For any hits: offers a certain intersection for which only bounds of t are known. The bounds
    /// include all roundings. Returns true if the query is complete.
    pub(crate) fn offer_bounds(&mut self, t: (f64, f64)) -> bool {
        let finite = f64::from(f32::MIN) <= t.0 && t.1 <= f64::from(f32::MAX);
        if finite && f64::from(self.tmin) <= t.0 && t.1 <= f64::from(self.tmax) {
            self.accept();
        }
        self.is_complete()
    }
}

impl<G: Goal> RayQuery<G> {
    /// A query without hits over the range of `ray`.
    #[inline(always)]
    pub(crate) fn new(goal: G, ray: &Ray) -> Self {
        let &Ray { tmin, tmax, .. } = ray;
        let best = Intersection { t: f64::from(tmax), weight: [0.0, 0.0, 1.0] };
        RayQuery { tmin, tmax, triangle: NONE, is_index: false, goal, best }
    }

    /// The same query with another type of goal.
    pub(crate) fn with_goal<H>(&self, goal: H) -> RayQuery<H> {
        let &RayQuery { tmin, tmax, triangle, is_index, best, .. } = self;
        RayQuery { tmin, tmax, triangle, is_index, goal, best }
    }

    /// The same query with a goal that is known at run time only.
    pub(crate) fn to_either(self) -> EitherQuery {
        self.with_goal(EitherGoal { is_any: self.goal.is_any() })
    }

    #[inline(always)]
    pub(crate) fn goal(&self) -> G {
        self.goal
    }

    /// Returns true if the query has found what it looks for.
    #[inline(always)]
    fn is_complete(&self) -> bool {
        self.goal.is_any() && self.triangle != NONE
    }

    /// The result of a traversal that has ended; for any hit [`Hit::SOME`]. `ids` are the ids of
    /// the object's triangles in leaf order, and `instance` is reported with a hit.
    pub(crate) fn answer(&self, ids: &[u32], instance: u32) -> Hit {
        if self.triangle == NONE {
            return Hit::MISS;
        }
        if self.goal.is_any() {
            return Hit::SOME;
        }
        let primitive = PrimitiveRef { instance, triangle: self.best_triangle(ids).read() };
        let [u, v] = self.best.uv();
        Hit { t: reported(self.best.t), u, v, primitive }
    }

    /// Offers an intersection with a triangle of the object. Returns true if the query is complete.
    #[inline(always)]
    pub(crate) fn offer(&mut self, triangle: TriangleRef<'_>, intersection: Intersection) -> bool {
        let nearer = self.triangle == NONE
            || intersection.t < self.best.t
            || (intersection.t == self.best.t && triangle.read() < self.best_triangle(triangle.ids).read());
        if nearer
            && in_range(intersection.t as f32, self.tmin, self.tmax)
            && self.goal.accepts(triangle, &intersection)
        {
            (self.triangle, self.is_index) = (triangle.value, triangle.is_index);
            self.best = intersection;
        }
        self.is_complete()
    }

    /// Notes that a triangle is certainly hit within the ray's range, which completes an any-hit
    /// query.
    pub(crate) fn accept(&mut self) {
        if self.goal.is_any() {
            (self.triangle, self.is_index) = (0, false);
        }
    }

    /// Upper bound of the exact t of intersections that can still change the result.
    #[inline(always)]
    pub(crate) fn limit(&self) -> f64 {
        widened(self.best.t)
    }

    /// Returns true if an intersection with a t between two values can change the result. It seldom
    /// can for the triangle on which a ray starts; exact arithmetic is then avoided.
    pub(crate) fn may_matter(&self, t: [f64; 2]) -> bool {
        may_be_in_range(t, self.tmin, self.limit())
    }

    /// t of the nearest hit so far, if there is one; always `None` for any-hit queries.
    pub(crate) fn found(&self) -> Option<f64> {
        (self.triangle != NONE && !self.goal.is_any()).then_some(self.best.t)
    }

    /// Id and t of the nearest hit so far; `None` as for [`Self::found`].
    pub(crate) fn best(&self, ids: &[u32]) -> Option<(u32, f64)> {
        let t = self.found()?;
        Some((self.best_triangle(ids).read(), t))
    }

    /// Replaces the nearest hit so far by one whose t lies in the range.
    pub(crate) fn replace(&mut self, triangle: TriangleRef<'_>, intersection: Intersection) {
        (self.triangle, self.is_index) = (triangle.value, triangle.is_index);
        self.best = intersection;
    }

    /// Lower and upper bound of the t of [`Self::found`].
    #[inline(always)]
    pub(crate) fn found_bounds(&self) -> Option<[f64; 2]> {
        let limit = self.limit();
        // The lower bound lies as far below t as the limit lies above it.
        self.found().map(|t| [2.0 * t - limit, limit])
    }

    /// The best triangle so far.
    fn best_triangle<'a>(&self, ids: &'a [u32]) -> TriangleRef<'a> {
        TriangleRef { value: self.triangle, is_index: self.is_index, ids }
    }
}

/// The new hit of a ray in a scene, with its t in world space, if it is better than `best`: a
/// lesser t, or an equal t and a lesser instance. `None` if it is not better, or if its t in world
/// space lies outside the ray's range.
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

/// Returns true if a t between two values may lie between `tmin` and `limit` after rounding to f32.
pub(crate) fn may_be_in_range(t: [f64; 2], tmin: f32, limit: f64) -> bool {
    t[0] <= limit && reaches((t[1] as f32).next_up(), tmin)
}

/// Returns true if t is at least `tmin`; neither is NaN. The bits are compared: some processors
/// take a hundred cycles where one of two floats is denormal, as `tmin` is where rays exclude 0.
#[inline(always)]
fn reaches(t: f32, tmin: f32) -> bool {
    let ordered = |x: f32| {
        let bits = x.to_bits().cast_signed();
        bits ^ (bits >> 31).cast_unsigned().wrapping_shr(1).cast_signed()
    };
    // The sum turns -0 into 0; a -0 of `tmin` is less.
    ordered(tmin) <= ordered(t + 0.0)
}

/// Returns true if a t that is already rounded for the answer lies in the ray's range and is
/// finite.
#[inline(always)]
pub(crate) fn in_range(t: f32, tmin: f32, tmax: f32) -> bool {
    reaches(t, tmin) && t <= tmax && t.is_finite()
}

/// Receiver of the triangles that a ray may hit.
pub(crate) trait Receiver {
    /// Receives a triangle and its corners in object space, in the order of the source. Returns
    /// true if the query is complete, which ends the enumeration.
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool;
    /// Upper bound of the exact t, in the units of the ray, of further intersections that can
    /// change the result. It may shrink with every triangle. Triangles beyond it may be skipped.
    fn limit(&self) -> f64;
}

/// Receiver of the statistics of a traversal; `()` counts nothing.
pub(crate) trait Count {
    /// A wide node was entered.
    fn node(&mut self) {}
    /// A leaf was entered.
    fn leaf(&mut self) {}
    /// This many triangles were tested.
    fn triangles(&mut self, _n: u32) {}
    /// A tetrahedron was passed.
    fn cell(&mut self) {}
    /// A walk was repeated exactly.
    fn flood(&mut self) {}
}

impl Count for () {}

/// Statistics of the traversal of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Wide nodes entered.
    pub nodes: u32,
    /// Leaves entered.
    pub leaves: u32,
    /// Triangles tested in leaves.
    pub triangles: u32,
    /// Tetrahedra passed.
    pub cells: u32,
    /// Walks through tetrahedra that were repeated exactly, because the ray passes through a
    /// vertex, an edge or a face plane.
    pub floods: u32,
}

impl std::ops::AddAssign for Steps {
    fn add_assign(&mut self, other: Steps) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.triangles += other.triangles;
        self.cells += other.cells;
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
    fn cell(&mut self) {
        self.cells += 1;
    }
    fn flood(&mut self) {
        self.floods += 1;
    }
}
