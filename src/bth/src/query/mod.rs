//! What a traversal looks for: the nearest hit or any hit; and what it counts.

pub(crate) mod sink;

use crate::intersect::exact::{Intersection, reported};
use crate::intersect::exact_lanes::Intersections;
use crate::rays::{Hit, Ray, Surface};
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;

/// What sixteen rays hit in an object.
pub(crate) struct AnswerLanes<'a> {
    /// Those that hit anything, a bit each.
    pub(crate) lanes: u32,
    pub(crate) intersections: &'a Intersections,
    pub(crate) instance: u32,
}

/// A triangle, by its id or by its place in leaf order among the ids of an object. An id is most often a cache miss, and of no
/// use until the query ends: it is asked for when the triangle is offered, and read then.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleRef<'a> {
    pub(crate) word: u32,
    pub(crate) is_place: bool,
    pub(crate) ids: &'a [u32],
}

impl<'a> TriangleRef<'a> {
    #[inline(always)]
    pub(crate) fn id(id: u32, ids: &'a [u32]) -> Self {
        TriangleRef { word: id, is_place: false, ids }
    }
    #[inline(always)]
    pub(crate) fn place(place: u32, ids: &'a [u32]) -> Self {
        TriangleRef { word: place, is_place: true, ids }
    }
    fn read(&self) -> u32 {
        if self.is_place { self.ids[self.word as usize] } else { self.word }
    }
}

/// A query in progress over one ray.
pub(crate) trait Query: Copy {
    /// Whether any hit will do.
    const ANY: bool;
    /// What the caller gets.
    type Answer;
    /// `ids` are those of the object, in leaf order.
    fn answer(&self, ids: &[u32], instance: u32) -> Self::Answer;
    /// The same, given t, u and v as they are to be reported.
    fn answer_of(surface: Surface, t: f32, u: f32, v: f32) -> Self::Answer;
    /// The same of sixteen rays; those whose bit is not set hit nothing.
    fn answers_of<S: Simd>(s: S, hits: &AnswerLanes<'_>, to: &mut [Self::Answer; LANES]);
    /// Merges an answer that was found in an object into that of the ray of a scene; `t_scale` turns t of the object into that
    /// of the world.
    fn merge(best: &mut Self::Answer, found: Self::Answer, ray: &Ray, t_scale: f32);
    fn new(ray: &Ray) -> Self;
    /// Whether walks should keep an eye on how far they are: where rays are often short, and where
    /// [`Self::is_settled_by`] has a use for it.
    const KEEPS_DEPTHS: bool = false;
    /// Offers a crossing within the object; true ends the traversal.
    fn offer(&mut self, triangle: TriangleRef<'_>, crossing: Intersection) -> bool;
    /// Tells of a crossing whose t certainly lies between two values, roundings included; true if that is all that the
    /// query wants to know.
    fn is_settled_by(&mut self, _t: (f64, f64)) -> bool {
        false
    }
    /// Nothing whose exact t lies beyond this can be of interest.
    fn limit(&self) -> f64;
    /// Whether a crossing between two values of t can be of interest. (Those of triangles that a ray starts on mostly are
    /// not, and exact arithmetic need not be troubled.)
    fn may_matter(&self, t: [f64; 2]) -> bool;
    /// t of the nearest hit so far, if the query wants the nearest.
    fn found(&self) -> Option<f64>;
    /// Between which t the nearest hit so far lies, if there is one and the query wants the nearest.
    #[inline(always)]
    fn found_between(&self) -> Option<[f64; 2]> {
        let limit = self.limit();
        // As far below as the limit lies above.
        self.found().map(|t| [2.0 * t - limit, limit])
    }
    /// A triangle is certainly hit within the ray's range; of use where any hit will do.
    fn accept(&mut self);
}

/// `t` and all that could be taken for it: t is compared with the ray's range after rounding to f32, and
/// computed only to 2^-28 of itself (`super::crossing`), so of two equal hits one may seem nearer.
fn widened(t: f64) -> f64 {
    const SLACK: f64 = 1.0 / (1 << 23) as f64;
    const LEAST: f64 = f32::from_bits(1) as f64;
    t + (t.abs() * SLACK + LEAST)
}

/// Least t, then least triangle id: an order that does not depend on the traversal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    tmin: f32,
    tmax: f32,
    /// An id, or a place among the ids ([`TriangleRef`]); `NONE` where nothing is hit.
    triangle: u32,
    is_place: bool,
    best: Intersection,
}

impl Nearest {
    /// The nearest triangle so far.
    fn named<'a>(&self, ids: &'a [u32]) -> TriangleRef<'a> {
        TriangleRef { word: self.triangle, is_place: self.is_place, ids }
    }
}

impl Query for Nearest {
    const ANY: bool = false;
    type Answer = Hit;
    fn answer(&self, ids: &[u32], instance: u32) -> Hit {
        if self.triangle == NONE {
            return Hit::MISS;
        }
        let surface = Surface { instance, triangle: self.named(ids).read() };
        let [u, v] = self.best.uv();
        Self::answer_of(surface, reported(self.best.t), u, v)
    }
    #[inline(always)]
    fn answer_of(surface: Surface, t: f32, u: f32, v: f32) -> Hit {
        Hit { t, u, v, surface }
    }
    #[inline(always)]
    fn answers_of<S: Simd>(s: S, hits: &AnswerLanes<'_>, to: &mut [Hit; LANES]) {
        let &AnswerLanes { lanes, intersections: crossings, instance } = hits;
        let m = s.mask(lanes);
        let Hit { t, u, v, surface } = Hit::MISS;
        let t = s.select(m, s.load(&crossings.t), s.splat(t));
        let u = s.select(m, s.load(&crossings.u), s.splat(u));
        let v = s.select(m, s.load(&crossings.v), s.splat(v));
        let instance = s.select_u(m, s.splat_u(instance), s.splat_u(surface.instance));
        let triangle = s.select_u(m, s.load_u(&crossings.triangle), s.splat_u(surface.triangle));
        s.store_rows5([s.bits(t), s.bits(u), s.bits(v), instance, triangle], zerocopy::transmute_mut!(to));
    }
    #[inline]
    fn merge(best: &mut Hit, found: Hit, ray: &Ray, t_scale: f32) {
        *best = better(ray, best, &found, t_scale).unwrap_or(*best);
    }
    fn new(ray: &Ray) -> Self {
        let best = Intersection { t: f64::from(ray.tmax), weight: [0.0, 0.0, 1.0] };
        Nearest { tmin: ray.tmin, tmax: ray.tmax, triangle: NONE, is_place: false, best }
    }
    #[inline(always)]
    fn offer(&mut self, triangle: TriangleRef<'_>, crossing: Intersection) -> bool {
        let nearer = self.triangle == NONE
            || crossing.t < self.best.t
            || (crossing.t == self.best.t && triangle.read() < self.named(triangle.ids).read());
        if nearer && in_range(crossing.t as f32, self.tmin, self.tmax) {
            (self.triangle, self.is_place) = (triangle.word, triangle.is_place);
            self.best = crossing;
        }
        false
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        widened(self.best.t)
    }
    fn may_matter(&self, t: [f64; 2]) -> bool {
        may_be_in_range(t, self.tmin, self.limit())
    }
    fn found(&self) -> Option<f64> {
        (self.triangle != NONE).then_some(self.best.t)
    }
    fn accept(&mut self) {}
}

/// The better of two hits of a ray of a scene: least t, then least instance. None where the new one is no better, or where its t
/// lies outside the ray's range once it is scaled to the world's.
pub(crate) fn better(ray: &Ray, best: &Hit, hit: &Hit, t_scale: f32) -> Option<Hit> {
    if !hit.is_hit() {
        return None;
    }
    // A factor of 1 leaves every t as it is, without a rounding.
    let t = if t_scale == 1.0 { hit.t } else { hit.t * t_scale };
    let hit = Hit { t, ..*hit };
    let in_range = ray.tmin <= hit.t && hit.t <= ray.tmax && hit.is_hit();
    let nearer = hit.t < best.t || hit.t == best.t && hit.surface.instance < best.surface.instance;
    (in_range && nearer).then_some(hit)
}

/// Whether a t between two values may lie in a range, rounding counted in.
fn may_be_in_range(t: [f64; 2], tmin: f32, limit: f64) -> bool {
    t[0] <= limit && (t[1] as f32).next_up() >= tmin
}

/// Whether a t, rounded as it will be reported, lies in the ray's range.
#[inline(always)]
fn in_range(t: f32, tmin: f32, tmax: f32) -> bool {
    tmin <= t && t <= tmax && t < f32::INFINITY
}

/// Ends at the first crossing in range.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Any {
    tmin: f32,
    tmax: f32,
    found: bool,
}

impl Query for Any {
    const ANY: bool = true;
    type Answer = bool;
    fn answer(&self, _ids: &[u32], _instance: u32) -> bool {
        self.found
    }
    fn answer_of(_surface: Surface, _t: f32, _u: f32, _v: f32) -> bool {
        true
    }
    fn answers_of<S: Simd>(_s: S, hits: &AnswerLanes<'_>, to: &mut [bool; LANES]) {
        for (lane, found) in to.iter_mut().enumerate() {
            *found = hits.lanes >> lane & 1 != 0;
        }
    }
    #[inline]
    fn merge(best: &mut bool, found: bool, _ray: &Ray, _t_scale: f32) {
        *best |= found;
    }
    fn new(ray: &Ray) -> Self {
        Any { tmin: ray.tmin, tmax: ray.tmax, found: false }
    }
    const KEEPS_DEPTHS: bool = true;
    #[inline(always)]
    fn offer(&mut self, _triangle: TriangleRef<'_>, crossing: Intersection) -> bool {
        self.found |= in_range(crossing.t as f32, self.tmin, self.tmax);
        self.found
    }
    fn is_settled_by(&mut self, t: (f64, f64)) -> bool {
        self.found |= f64::from(self.tmin) <= t.0 && t.1 <= f64::from(self.tmax.min(f32::MAX));
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
}

/// Counts the work of a traversal, or nothing at all.
pub(crate) trait Count {
    fn node(&mut self) {}
    fn leaf(&mut self) {}
    fn triangles(&mut self, _n: u32) {}
    fn tet(&mut self) {}
    fn flood(&mut self) {}
}

impl Count for () {}

/// Work that one ray took.
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
    /// Walks that met a tie (a ray through a vertex, edge or face plane) and were done again exactly.
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
