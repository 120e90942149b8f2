//! Points of triangles at which rays start, and the exact intersection of such rays with triangles.
//!
//! The start at weights u and v of the triangle a, b, c is the point S = a + u(b-a) + v(c-a) of the
//! stored numbers: a real point, not rounded. Where u + v exceeds 1, by the rounding of a hit's
//! weights, S is the point (ub + vc)/(u + v) of the edge b→c. So S always lies on the closed
//! triangle.
//!
//! A ray from S hits a closed triangle if its line crosses the triangle at t > 0. Triangles through
//! S are crossed at t = 0, or lie in one plane with the line; neither is a hit. So a ray never hits
//! the surface that it leaves, and never skips a wall, however near.
//!
//! **Exactness.** The weight det[d, p-S, q-S] of a corner and the volume (a-S)·n are affine
//! functions of S: where S is a combination of a, b and c, they are the same combination of their
//! values at a, b and c, which are exact sums ([`bth_format::exact`]). The combination multiplies
//! these by u and v, numbers of f32. f64 decides most rays before: S rounded to f64 is off by a
//! bound that [`RoundedOrigin`] adds to the bounds of the errors.

use super::exact::{Estimate, Intersection, UncertainWeights, decide_exactly, estimate};
use super::filter::TriangleBlock;
use super::line::Line;
use super::origin::RoundedOrigin;
use super::start_point::StartPoint;
use super::vector::wide;
use bth_format::exact::{EDGE_PARTS, Expansion, VOLUME_PARTS};
use bth_format::layout::{IndexedLeaf, TrianglePlace, WIDTH};
use bth_format::object::ObjectView;

/// Weights of hits are rounded to f32: their sum, rounded too, exceeds 1 by at most this.
pub(crate) const ABOVE_ONE: f32 = 1.0 / (1 << 22) as f32;
/// 2^-49: bounds the error of a start in f64 relative to the largest |coordinate| of its triangle.
/// It has five roundings of 2^-53, each of at most twice that coordinate.
const ROUNDING: f64 = 1.0 / (1u64 << 49) as f64;

/// Parts of an affine combination of edges: `a`, and the differences of two other edges with `a`,
/// each times an f32.
const START_EDGE_PARTS: usize = 9 * EDGE_PARTS;
/// The same for volumes.
pub(super) const START_VOLUME_PARTS: usize = 9 * VOLUME_PARTS;

/// Returns true if weights describe a point of a triangle: finite, not negative, with a sum that
/// exceeds 1 by at most the rounding of hits.
#[inline(always)]
pub(crate) fn are_weights([u, v]: [f32; 2]) -> bool {
    // Comparisons with NaN are false.
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 + ABOVE_ONE
}

/// Returns true if u + v exceeds 1 exactly.
#[inline(always)]
fn is_above_one(u: f64, v: f64) -> bool {
    // The error of the sum decides where the rounded sum is 1. The greater number comes first: then
    // this is the exact error.
    let (greater, less) = if u < v { (v, u) } else { (u, v) };
    let sum = u + v;
    (sum > 1.0) | ((sum == 1.0) & (less - (sum - greater) > 0.0))
}

/// The point with weights u and v of a triangle, rounded to f64, and a bound of the error of its
/// coordinates. There are no branches, so that a loop of it can be vectorized.
#[inline(always)]
pub(crate) fn rounded_start([a, b, c]: [[f64; 3]; 3], [u, v]: [f64; 2]) -> RoundedOrigin {
    let above = is_above_one(u, v);
    let share = 1.0 / (u + v);
    let (mut point, mut greatest) = ([0.0; 3], 0.0f64);
    for k in 0..3 {
        let inside = a[k] + (u * (b[k] - a[k]) + v * (c[k] - a[k]));
        let on_edge = (u * b[k] + v * c[k]) * share;
        point[k] = if above { on_edge } else { inside };
        for x in [a[k], b[k], c[k]] {
            greatest = if x.abs() > greatest { x.abs() } else { greatest };
        }
    }
    RoundedOrigin(point, greatest * ROUNDING)
}

/// A start with the corners of its triangle, for exact decisions.
pub(crate) struct ExactStart {
    corners: [[f64; 3]; 3],
    u: f64,
    v: f64,
    is_on_edge: bool,
}

impl ExactStart {
    pub(crate) fn new(corners: [[f32; 3]; 3], u: f32, v: f32) -> Self {
        let (u, v) = (f64::from(u), f64::from(v));
        ExactStart { corners: corners.map(wide), u, v, is_on_edge: is_above_one(u, v) }
    }

    /// What the values of this start are multiplied by: u + v on the edge b→c, else 1.
    fn scale(&self) -> f64 {
        if self.is_on_edge { self.u + self.v } else { 1.0 }
    }

    /// An affine function of a point, given its values at the corners, at this start: exactly,
    /// times [`Self::scale`].
    pub(super) fn combined<const PARTS: usize, const SUM: usize>(
        &self,
        at: impl Fn([f64; 3]) -> Expansion<PARTS>,
    ) -> Expansion<SUM> {
        let ([a, b, c], mut sum) = (self.corners, Expansion::<SUM>::new());
        sum.add_scaled(&at(b), self.u);
        sum.add_scaled(&at(c), self.v);
        if !self.is_on_edge {
            let at_a = at(a);
            sum.add_sum(&at_a);
            sum.add_scaled(&at_a, -self.u);
            sum.add_scaled(&at_a, -self.v);
        }
        sum
    }

    /// det[d, p-S, q-S] for a direction d, exactly, times [`Self::scale`].
    pub(super) fn edge(&self, d: [f64; 3], p: [f64; 3], q: [f64; 3]) -> Expansion<START_EDGE_PARTS> {
        self.combined(|o| {
            let mut sum = Expansion::<EDGE_PARTS>::new();
            sum.add_edge(o, d, p, q);
            sum
        })
    }

    /// det[a-S, b-S, c-S], exactly, times [`Self::scale`].
    pub(super) fn volume(&self, [a, b, c]: [[f64; 3]; 3]) -> Expansion<START_VOLUME_PARTS> {
        self.combined(|o| {
            let mut sum = Expansion::<VOLUME_PARTS>::new();
            sum.add_volume(o, a, b, c);
            sum
        })
    }

    /// The exact `volume` of this start minus s times a determinant, times [`Self::scale`]; its
    /// sign is exact.
    pub(super) fn minus_product(
        &self,
        volume: &Expansion<START_VOLUME_PARTS>,
        determinant: &Expansion<EDGE_PARTS>,
        s: f64,
    ) -> f64 {
        let mut moved = Expansion::<{ 2 * EDGE_PARTS }>::new();
        moved.add_scaled(determinant, -s);
        let mut sum = Expansion::<{ START_VOLUME_PARTS + 8 * EDGE_PARTS }>::new();
        sum.add_sum(volume);
        if self.is_on_edge {
            sum.add_scaled(&moved, self.u);
            sum.add_scaled(&moved, self.v);
        } else {
            sum.add_sum(&moved);
        }
        sum.value()
    }

    /// Returns true if the closed triangle certainly holds the start: it has all corners that have
    /// a weight, at the same coordinates.
    pub(crate) fn is_corner_of(&self, corners: [[f32; 3]; 3]) -> bool {
        let others = corners.map(wide);
        let is_weightless = [!self.has_first_corner(), self.u == 0.0, self.v == 0.0];
        (0..3).all(|i| is_weightless[i] || others.contains(&self.corners[i]))
    }

    /// Returns true if 1 - u - v is above 0 exactly.
    fn has_first_corner(&self) -> bool {
        let mut sum = Expansion::<3>::new();
        [1.0, -self.u, -self.v].into_iter().for_each(|x| sum.add(x));
        sum.value() > 0.0
    }

    /// The intersection of the ray along `line` from this start with a triangle of these corners,
    /// if it is at t > 0.
    pub(crate) fn intersection(&self, line: &Line, corners: [[f32; 3]; 3]) -> Option<Intersection> {
        match decide_start(line.rounded_origin(), line.direction, corners.map(wide)) {
            StartDecision::Certain(found) => found,
            StartDecision::Open(uncertain, _) => {
                decide_start_exactly(self, line.direction, corners, &uncertain)
            }
        }
    }

    /// The intersection of the ray with a triangle that [`estimate`] leaves open, if it is at t >
    /// 0.
    #[cold]
    #[inline(never)]
    fn decide(
        &self,
        direction: [f64; 3],
        corners: [[f64; 3]; 3],
        uncertain: &UncertainWeights,
    ) -> Option<Intersection> {
        let edge = |p, q| self.edge(direction, p, q).value();
        decide_exactly(uncertain, corners, edge, || self.exact_intersection(direction, corners))
            .filter(|found| found.t > 0.0)
    }

    /// t, u and v from exact sums.
    fn exact_intersection(&self, direction: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> Intersection {
        let scale = self.scale();
        let (second, third) = (self.edge(direction, c, a).value(), self.edge(direction, a, b).value());
        // The determinant is the same at every origin, and at a corner the weights of the other two
        // corners are 0.
        let mut determinant = Expansion::<EDGE_PARTS>::new();
        determinant.add_edge(a, direction, b, c);
        let determinant = determinant.value();
        let t = self.volume([a, b, c]).value() / scale / determinant;
        Intersection { t, weight: [second / scale, third / scale, determinant] }
    }
}

/// What is known of a ray from a start and a triangle.
pub(crate) enum StartDecision {
    /// The ray misses the triangle, or hits it at this intersection.
    Certain(Option<Intersection>),
    /// Exact arithmetic must decide. The array bounds t if the ray hits.
    Open(UncertainWeights, [f64; 2]),
}

/// Decides in f64 whether a ray from a start hits a triangle, where the bounds of errors allow.
#[inline(always)]
pub(crate) fn decide_start(
    origin: RoundedOrigin,
    direction: [f64; 3],
    corners: [[f64; 3]; 3],
) -> StartDecision {
    match estimate(origin, direction, corners) {
        Estimate::Missed => StartDecision::Certain(None),
        Estimate::Intersects(found) => StartDecision::Certain(Some(found).filter(|found| found.t > 0.0)),
        Estimate::Open(_, [_, last]) if last <= 0.0 => StartDecision::Certain(None),
        Estimate::Open(uncertain, t) => StartDecision::Open(uncertain, t),
    }
}

/// Decides exactly what [`decide_start`] leaves open.
#[cold]
#[inline(never)]
pub(crate) fn decide_start_exactly(
    start: &ExactStart,
    direction: [f64; 3],
    corners: [[f32; 3]; 3],
    uncertain: &UncertainWeights,
) -> Option<Intersection> {
    if start.is_corner_of(corners) {
        return None;
    }
    start.decide(direction, corners.map(wide), uncertain)
}

/// The child code of the leaf that holds a triangle, and its slot there. Special
/// leaves have slots, too.
#[inline(always)]
pub(crate) fn place(object: &ObjectView<'_>, triangle: u32) -> Option<(u32, u32)> {
    let code = *object.places.get(triangle as usize)?;
    match TrianglePlace::from_code(code) {
        Some(TrianglePlace { leaf, slot }) => Some((leaf.code(), slot)),
        None => object.special_place(triangle),
    }
}

/// The corners of the triangle with an id in the source's space, from its leaf or from the source.
/// `None` if the file tells neither.
pub(crate) fn corners_by_id(object: &ObjectView<'_>, id: u32) -> Option<[[f64; 3]; 3]> {
    match place(object, id).and_then(|(leaf, slot)| start_corners(object, leaf, slot)) {
        Some(of_leaf) => Some(object.exact_corners(|| id, of_leaf)),
        None => source_corners(object, id),
    }
}

/// The vertices of a triangle as they are traced; `None` if the file does not keep them or there is
/// no such triangle.
pub(crate) fn source_corners(view: &ObjectView<'_>, id: u32) -> Option<[[f64; 3]; 3]> {
    if !view.exact.is_empty() {
        return view.exact.corners(id);
    }
    let rows = view.triangles.get(id as usize)?;
    let [a, b, c] = rows.map(|row| view.positions.get(row as usize).copied());
    let corners = [a?, b?, c?];
    Some(corners.map(|corner| view.grid.map_or(corner, |grid| grid.nearest(corner)).map(f64::from)))
}

/// The corners of the triangle in a slot of a leaf, given as its child code. `None` if there is no
/// such leaf.
#[inline(always)]
pub(crate) fn start_corners(object: &ObjectView<'_>, leaf: u32, slot: u32) -> Option<[[f32; 3]; 3]> {
    let mut own = None;
    // Most triangles lie in indexed leaves of f32. The others become one, so that in either case
    // the corners are loaded, not copied: what was just stored number by number is slow to load as
    // vectors.
    let (leaf, triangle) = match object.node_base().indexed_leaf(leaf) {
        Some(leaf) => (leaf, slot as usize),
        None => (&*own.insert(leaf_of(object.corners_in(leaf, slot)?)), 0),
    };
    Some(leaf.corners(triangle))
}

/// A leaf of one triangle.
fn leaf_of(corners: [[f32; 3]; 3]) -> IndexedLeaf {
    let vertex = [0, 1, 2].map(|axis| std::array::from_fn(|i| corners[i.min(2)][axis]));
    let corner = [0, 1, 2].map(|i| [i; WIDTH]);
    IndexedLeaf { vertex, corner, first: 0, triangles: 1, vertices: 3, reserved: 0 }
}

/// A start with the corners of its triangle.
pub(crate) fn start_on(object: &ObjectView<'_>, start: &StartPoint) -> Option<ExactStart> {
    let corners = start_corners(object, start.leaf, start.slot)?;
    Some(ExactStart::new(corners, start.u, start.v))
}
