//! What a traversal looks for: the nearest hit or any hit; and what it counts.

use super::crossing::Crossing;
use crate::layout::NONE;
use crate::rays::{Hit, Ray, Surface};

/// A query in progress over one ray.
pub(crate) trait Query: Copy {
    /// Whether any hit will do.
    const ANY: bool;
    /// What the caller gets.
    type Answer;
    fn answer(&self, instance: u32) -> Self::Answer;
    fn new(ray: &Ray) -> Self;
    /// Whether walks should keep an eye on how far they are: where rays are often short, and where
    /// [`Self::settled_by`] has a use for it.
    const KEEPS_DEPTHS: bool = false;
    /// Offers a crossing within the object; true ends the traversal.
    fn offer(&mut self, triangle: u32, crossing: Crossing) -> bool;
    /// Tells of a crossing whose t certainly lies between two values, roundings included; true if that is all that the
    /// query wants to know.
    fn settled_by(&mut self, _t: (f64, f64)) -> bool {
        false
    }
    /// Nothing whose exact t lies beyond this can be of interest.
    fn limit(&self) -> f64;
    /// t of the nearest hit so far, if the query wants the nearest.
    fn found(&self) -> Option<f64>;
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
    triangle: u32,
    best: Crossing,
}

impl Query for Nearest {
    const ANY: bool = false;
    type Answer = Hit;
    fn answer(&self, instance: u32) -> Hit {
        if self.triangle == NONE {
            return Hit::MISS;
        }
        let surface = Surface { instance, triangle: self.triangle };
        let [u, v] = self.best.uv();
        // + 0.0 turns -0.0 into 0.0.
        Hit { t: self.best.t as f32 + 0.0, u: u + 0.0, v: v + 0.0, surface }
    }
    fn new(ray: &Ray) -> Self {
        let best = Crossing { t: f64::from(ray.tmax), weight: [0.0, 0.0, 1.0] };
        Nearest { tmin: ray.tmin, tmax: ray.tmax, triangle: NONE, best }
    }
    #[inline(always)]
    fn offer(&mut self, triangle: u32, crossing: Crossing) -> bool {
        let nearer = self.triangle == NONE
            || crossing.t < self.best.t
            || (crossing.t == self.best.t && triangle < self.triangle);
        if nearer && in_range(crossing.t, self.tmin, self.tmax) {
            self.triangle = triangle;
            self.best = crossing;
        }
        false
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        widened(self.best.t)
    }
    fn found(&self) -> Option<f64> {
        (self.triangle != NONE).then_some(self.best.t)
    }
    fn accept(&mut self) {}
}

/// Whether a t, rounded as it will be reported, lies in the ray's range.
fn in_range(t: f64, tmin: f32, tmax: f32) -> bool {
    let t = t as f32;
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
    fn answer(&self, _instance: u32) -> bool {
        self.found
    }
    fn new(ray: &Ray) -> Self {
        Any { tmin: ray.tmin, tmax: ray.tmax, found: false }
    }
    const KEEPS_DEPTHS: bool = true;
    #[inline(always)]
    fn offer(&mut self, _triangle: u32, crossing: Crossing) -> bool {
        self.found |= in_range(crossing.t, self.tmin, self.tmax);
        self.found
    }
    fn settled_by(&mut self, t: (f64, f64)) -> bool {
        self.found |= f64::from(self.tmin) <= t.0 && t.1 <= f64::from(self.tmax.min(f32::MAX));
        self.found
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        widened(f64::from(self.tmax))
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
