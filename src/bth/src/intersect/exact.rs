//! Intersection of a line with a closed triangle: whether they cross, and t, u and v. All
//! acceleration structures, records and instruction sets use this module, so they all give the same
//! bits.
//!
//! With o + t·d = a + u·(b-a) + v·(c-a), Cramer's rule gives t, u and v as quotients of
//! determinants (Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 1997).
//! The products are ordered so that everything but three scalar products with d is the same for all
//! rays from one point ([`OriginTerms`]). Signs and quotients are computed in f64; where the error
//! bound leaves a sign or a digit uncertain, they are computed from exact sums
//! ([`bth_format::exact`]).
//!
//! **Errors.** Let u = 2^-53, and let r, m and D be the largest |coordinates| of a-o, of the edges
//! b-a and c-a, and of d. Differences have a relative error of u. A component of a vector product
//! of two differences has two products, each with three roundings, and a subtraction: its error is
//! 8u times the sizes of both factors. The determinant and the weights of b and c are scalar
//! products of such vectors with d: they are off by 3·8u because of the vectors and by 16u because
//! of the roundings of the scalar products, which gives 40uDm² and 40uDmr. The weight of a is the
//! determinant minus the other two weights: 98uDm(m+r). The volume is off by (3·8 + 3·2 + 16)urm².
//! Products of three differences of f32 values, and of three such with the bounds, lie far from the
//! limits of f64.

use crate::intersect::line::Line;
pub(crate) use crate::intersect::line::RATIO_ERROR;
use crate::intersect::origin::{Origin, RoundedLine};
use crate::intersect::pairs;
use crate::intersect::vector::{cross, dot, greater, lesser, max_norm, minus, wide};
use crate::simd::{Doubles, PlainDoubles};
use bth_format::exact::{EDGE_PARTS, Expansion, VOLUME_PARTS, wide_volume};

/// 128u, more than the 98u above: bounds the error of weights relative to Dm(m+r), and the error of
/// the volume relative to rm².
pub(super) const WEIGHT_ERROR: f64 = 128.0 / (1u64 << 53) as f64;
/// Factor from the bound of an error to the smallest value whose relative error is at most
/// [`RATIO_ERROR`].
pub(super) const INVERSE_RATIO_ERROR: f64 = 1.0 / RATIO_ERROR;

/// Intersection of a line and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Intersection {
    /// Parameter of the ray, in units of its direction. Hits are ordered by this value and reported
    /// rounded to f32.
    pub(crate) t: f64,
    /// u, v and 1, all multiplied by the determinant.
    pub(crate) weight: [f64; 3],
}

/// Rounds t for the answer, and turns -0.0 to 0.0.
#[inline(always)]
pub(crate) fn reported(x: f64) -> f32 {
    x as f32 + 0.0
}

/// Rounds u or v for the answer, and replaces -0.0 and values below 0, which rounding errors can
/// give, by 0.0.
#[inline(always)]
pub(crate) fn reported_barycentric(x: f64) -> f32 {
    // This comparison, unlike `f64::max`, compiles to a single vector instruction.
    (if x > 0.0 { x } else { 0.0 }) as f32
}

impl Intersection {
    /// Barycentric weights of the triangle's second and third vertex, rounded for the answer.
    pub(crate) fn uv(&self) -> [f32; 2] {
        let [u, v, determinant] = self.weight;
        let inverse = 1.0 / determinant;
        [reported_barycentric(u * inverse), reported_barycentric(v * inverse)]
    }
}

/// Decision of f64 on a line and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Estimate {
    /// The line certainly misses the triangle.
    Missed,
    /// The line certainly crosses the triangle, and t, u and v are within [`RATIO_ERROR`].
    Intersects(Intersection),
    /// The error bounds leave the intersection, or its t, u and v, uncertain. The array bounds t if
    /// the line crosses.
    Open(UncertainWeights, [f64; 2]),
}

/// Input of the exact decision on a line and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UncertainWeights {
    rounded: RoundedIntersection,
    /// Weights of the three corners.
    weight: [f64; 3],
    /// Bound of the error of `weight`.
    bound: f64,
}

impl UncertainWeights {
    /// u and v in f64, rounded for the answer.
    pub(crate) fn uv(&self) -> [f32; 2] {
        self.rounded.intersection().uv()
    }

    /// Returns true if f64 leaves only the volume inaccurate.
    #[inline(always)]
    fn is_certain_but_for_volume(&self) -> bool {
        let &UncertainWeights { rounded, weight: [first, second, third], bound } = self;
        let least = lesser(lesser(first, second), third);
        let greatest = greater(greater(first, second), third);
        let is_inside = (least > bound) | (greatest < -bound);
        let [.., determinant] = rounded.weight;
        is_inside & (determinant.abs() > INVERSE_RATIO_ERROR * bound)
    }

    /// The intersection with this volume.
    #[inline(always)]
    fn with_volume(&self, volume: f64) -> Intersection {
        Intersection { t: volume * self.rounded.inverse, weight: self.rounded.weight }
    }

    /// The intersection in f64, if only the signs of weights are uncertain.
    pub(crate) fn if_accurate(&self) -> Option<Intersection> {
        self.rounded.is_accurate.then(|| self.rounded.intersection())
    }
}

/// Scalar product that does not depend on the order of the axes: the largest of the sums in three
/// orders. t is computed from such products, so it has the same bits after model and rays are
/// rotated by a multiple of 90° about a coordinate axis, and the choice between equal hits does not
/// change. u and v need not have this property, because no decision depends on them.
#[inline(always)]
fn unordered_scalar_product(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
    greater(greater(x + y + z, y + z + x), z + x + y)
}

/// Terms of the determinants of a triangle that depend on the ray's origin but not on its
/// direction. No operation here and in [`RoundedIntersection`] is fused or conditional, so the bits
/// are the same on every machine, for one triangle or in lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OriginTerms {
    /// (b-a) × (c-a). Its scalar product with the direction is the determinant, which is the sum of
    /// the three weights.
    pub(crate) normal: [f64; 3],
    /// (c-a) × (a-o). Its scalar product with the direction is the weight of the second corner.
    pub(crate) second: [f64; 3],
    /// (a-o) × (b-a). Its scalar product with the direction is the weight of the third corner.
    pub(crate) third: [f64; 3],
    /// (a-o) · normal, which is t multiplied by the determinant.
    pub(crate) volume: f64,
    /// t, u and v are within [`RATIO_ERROR`] where |determinant| exceeds this value times the
    /// direction's largest |component|.
    pub(crate) min_determinant: f64,
}

impl OriginTerms {
    #[inline(always)]
    pub(crate) fn new(origin: impl Origin, corners: [[f64; 3]; 3]) -> OriginTerms {
        OriginTerms::with_errors(origin, corners).0
    }

    /// Also returns bounds of the errors of the weights, for a direction whose largest |component|
    /// is 1, and of the volume.
    #[inline(always)]
    fn with_errors(origin: impl Origin, [a, b, c]: [[f64; 3]; 3]) -> (OriginTerms, [f64; 2]) {
        let (offset, second, third) = (minus(a, origin.point()), minus(b, a), minus(c, a));
        let normal = cross(second, third);
        let volume = unordered_scalar_product(offset, normal);
        let (distance, edge) = (max_norm(offset), greater(max_norm(second), max_norm(third)));
        let error = [WEIGHT_ERROR * (edge * (edge + distance)), WEIGHT_ERROR * (distance * (edge * edge))];
        let error = origin.enlarge(error, edge, distance);
        let is_accurate = INVERSE_RATIO_ERROR * error[1] < volume.abs();
        let terms = OriginTerms {
            normal,
            second: cross(third, offset),
            third: cross(offset, second),
            volume,
            min_determinant: if is_accurate { INVERSE_RATIO_ERROR * error[0] } else { f64::INFINITY },
        };
        (terms, error)
    }
}

/// Intersection of a line with the plane of a triangle in f64, with rounding errors; whether it
/// lies in the triangle is not decided.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedIntersection {
    /// Weights of the second and the third corner, and the determinant, which is the sum of all
    /// three weights.
    pub(crate) weight: [f64; 3],
    /// 1 / determinant.
    pub(crate) inverse: f64,
    pub(crate) t: f64,
    /// True if t, u and v are within [`RATIO_ERROR`].
    pub(crate) is_accurate: bool,
}

impl RoundedIntersection {
    /// `norm` is the direction's largest |component|.
    #[inline(always)]
    pub(crate) fn new(terms: &OriginTerms, direction: [f64; 3], norm: f64) -> RoundedIntersection {
        let determinant = unordered_scalar_product(direction, terms.normal);
        let weight = [dot(direction, terms.second), dot(direction, terms.third), determinant];
        let inverse = 1.0 / determinant;
        RoundedIntersection {
            weight,
            inverse,
            t: terms.volume * inverse,
            is_accurate: terms.min_determinant * norm < determinant.abs(),
        }
    }

    #[inline(always)]
    pub(crate) fn intersection(&self) -> Intersection {
        Intersection { t: self.t, weight: self.weight }
    }
}

/// A line and a triangle in f64: its intersection with the triangle's plane, and on which sides of
/// the edges it passes.
struct LineSides {
    rounded: RoundedIntersection,
    /// Weights of the three corners.
    weight: [f64; 3],
    /// Bounds of the errors of `weight` and of the volume.
    error: [f64; 2],
    /// The line certainly crosses the triangle, or certainly misses it.
    is_inside: bool,
    is_outside: bool,
}

impl LineSides {
    /// There are no branches, so that the compiler can vectorize a loop of it.
    #[inline(always)]
    fn new(origin: impl Origin, direction: [f64; 3], corners: [[f64; 3]; 3]) -> LineSides {
        let (terms, error) = OriginTerms::with_errors(origin, corners);
        let norm = max_norm(direction);
        let rounded = RoundedIntersection::new(&terms, direction, norm);
        let [second, third, determinant] = rounded.weight;
        let first = determinant - second - third;
        let least = lesser(lesser(first, second), third);
        let greatest = greater(greater(first, second), third);
        let bound = error[0] * norm;
        LineSides {
            rounded,
            weight: [first, second, third],
            error: [bound, error[1]],
            is_inside: (least > bound) | (greatest < -bound),
            is_outside: (least < -bound) & (greatest > bound),
        }
    }
}

/// Decides in f64 whether a line crosses a triangle and computes t, u and v, or returns
/// [`Estimate::Open`] where the error bounds do not allow it.
#[inline(always)]
pub(crate) fn estimate(origin: impl Origin, direction: [f64; 3], corners: [[f64; 3]; 3]) -> Estimate {
    let LineSides { rounded, weight, error, is_inside, is_outside } =
        LineSides::new(origin, direction, corners);
    if is_outside {
        return Estimate::Missed;
    }
    if is_inside && rounded.is_accurate {
        return Estimate::Intersects(rounded.intersection());
    }
    let t = if is_inside {
        t_range(rounded.t, rounded.weight[2], error)
    } else {
        [f64::NEG_INFINITY, f64::INFINITY]
    };
    Estimate::Open(UncertainWeights { rounded, weight, bound: error[0] }, t)
}

/// The intersection of a line and a triangle. It is valid only if the flag is true: where
/// [`estimate`] returns [`Estimate::Intersects`].
#[inline(always)]
pub(crate) fn certain_intersection(
    origin: [f64; 3],
    direction: [f64; 3],
    corners: [[f64; 3]; 3],
) -> (Intersection, bool) {
    let LineSides { rounded, is_inside, .. } = LineSides::new(origin, direction, corners);
    (rounded.intersection(), is_inside & rounded.is_accurate)
}

/// The intersection of a line with a triangle that it crosses, if t certainly has a relative error
/// of at most 2^-40, and u and v are within [`RATIO_ERROR`].
///
/// With the notation above, let n' be the rounded normal, N its max |component|, h the point of the
/// hit, and e and δ the errors of the line. V and W have the error of n' in common: from a-o = td +
/// (a-h) follows V/W - t = (a-h)·n'/W, which is at most 24um³/W. The roundings of the products with
/// n' add 12urN to V and 9uDN to W, the errors of the line 3eN and 3δDN.
pub(crate) fn precise(line: &RoundedLine, corners: [[f64; 3]; 3]) -> Option<Intersection> {
    /// The relative rounding of an operation, u.
    const U: f64 = 1.0 / (1u64 << 53) as f64;
    const PRECISE: f64 = 1.0 / (1u64 << 40) as f64;
    let (terms, norm) = (OriginTerms::new(*line, corners), max_norm(line.direction));
    let rounded = RoundedIntersection::new(&terms, line.direction, norm);
    let [a, b, c] = corners;
    let (distance, edge) =
        (max_norm(minus(a, line.point())), greater(max_norm(minus(b, a)), max_norm(minus(c, a))));
    let (normal, [.., determinant]) = (max_norm(terms.normal), rounded.weight);
    let of_volume = 24.0 * U * edge * edge * edge + (12.0 * U * distance + 3.0 * line.origin.1) * normal;
    let of_determinant = (9.0 * U + 3.0 * line.direction_error) * norm * normal;
    let error = of_volume + rounded.t.abs() * of_determinant;
    let is_precise = 1.01 * error <= PRECISE * rounded.t.abs() * determinant.abs();
    (is_precise && rounded.is_accurate).then(|| rounded.intersection())
}

/// Bounds of the t at which a line crosses a triangle, given t in f64, the determinant W, whose
/// sign is certain, and bounds of the errors of W and of the volume V: (V+p)/(W+q) - V/W = (p -
/// q·V/W)/(W+q).
#[inline(never)]
fn t_range(t: f64, determinant: f64, error: [f64; 2]) -> [f64; 2] {
    /// Bounds the relative roundings of this function and of t itself.
    const ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;
    let determinant = determinant.abs();
    if determinant <= 2.0 * error[0] {
        return [f64::NEG_INFINITY, f64::INFINITY];
    }
    let shift = (error[1] + t.abs() * error[0]) / (determinant - error[0]);
    let shift = shift + (shift + t.abs()) * ROUNDING;
    [t - shift, t + shift]
}

/// The intersection of a line that certainly crosses a triangle, where f64 leaves only the volume
/// inaccurate: with the volume in pairs. `None` if more than that is uncertain.
#[inline(always)]
pub(crate) fn in_pairs<D: Doubles>(
    s: D,
    origin: [f32; 3],
    corners: [[f32; 3]; 3],
    uncertain: &UncertainWeights,
) -> Option<Intersection> {
    // A closure might be compiled without the instruction set of the kernel.
    if !uncertain.is_certain_but_for_volume() {
        return None;
    }
    Some(uncertain.with_volume(pairs::volume(s, origin, corners)?))
}

/// The same for a line in f64 without errors.
pub(crate) fn with_exact_volume(
    line: &RoundedLine,
    corners: [[f64; 3]; 3],
    uncertain: &UncertainWeights,
) -> Option<Intersection> {
    let is_exact = line.origin.1 == 0.0 && line.direction_error == 0.0;
    if !is_exact || !uncertain.is_certain_but_for_volume() {
        return None;
    }
    Some(uncertain.with_volume(wide_volume(line.point(), corners)?))
}

/// Decides a triangle that f64 leaves uncertain: uncertain weights are replaced by exact ones, and
/// t, u and v are computed from exact sums unless the f64 values are accurate. `edge` returns the
/// exact weight of the corner opposite an edge, or its product with a positive number; `exact` the
/// intersection from exact sums.
pub(super) fn decide_exactly(
    uncertain: &UncertainWeights,
    corners: [[f64; 3]; 3],
    edge: impl Fn([f64; 3], [f64; 3]) -> f64,
    exact: impl FnOnce() -> Intersection,
) -> Option<Intersection> {
    let &UncertainWeights { rounded, mut weight, bound } = uncertain;
    for i in 0..3 {
        if weight[i].abs() <= bound {
            weight[i] = edge(corners[(i + 1) % 3], corners[(i + 2) % 3]);
        }
    }
    let positive = weight.iter().any(|&w| w > 0.0);
    let negative = weight.iter().any(|&w| w < 0.0);
    if positive == negative {
        return None; // The line passes outside of the triangle or lies in its plane.
    }
    Some(if rounded.is_accurate { rounded.intersection() } else { exact() })
}

impl Line {
    /// The intersection of the line with the closed triangle of these corners (object space),
    /// decided exactly.
    pub(crate) fn intersection(&self, corners: [[f32; 3]; 3]) -> Option<Intersection> {
        match estimate(self.origin, self.direction, corners.map(wide)) {
            Estimate::Missed => None,
            Estimate::Intersects(intersection) => Some(intersection),
            Estimate::Open(uncertain, _) => in_pairs(PlainDoubles, self.f32_origin(), corners, &uncertain)
                .or_else(|| self.decide_uncertain(corners.map(wide), &uncertain)),
        }
    }

    /// The origin, which is one of f32 unless the ray starts on a triangle.
    fn f32_origin(&self) -> [f32; 3] {
        self.origin.map(|x| x as f32)
    }

    #[cold]
    #[inline(never)]
    fn decide_uncertain(&self, corners: [[f64; 3]; 3], uncertain: &UncertainWeights) -> Option<Intersection> {
        let edge = |p, q| self.edge(p, q).value();
        decide_exactly(uncertain, corners, edge, || self.exact_intersection(corners))
    }

    /// The weight of the corner opposite an edge p→q: det[d, p-o, q-o].
    fn edge(&self, p: [f64; 3], q: [f64; 3]) -> Expansion<EDGE_PARTS> {
        let mut sum = Expansion::<EDGE_PARTS>::new();
        sum.add_edge(self.origin, self.direction, p, q);
        sum
    }

    /// t, u and v from exact sums.
    fn exact_intersection(&self, [a, b, c]: [[f64; 3]; 3]) -> Intersection {
        let (second, third) = (self.edge(c, a), self.edge(a, b));
        let mut determinant = Expansion::<{ 3 * EDGE_PARTS }>::new();
        determinant.add_edge(self.origin, self.direction, b, c);
        determinant.add_sum(&second);
        determinant.add_sum(&third);
        let mut volume = Expansion::<VOLUME_PARTS>::new();
        volume.add_volume(self.origin, a, b, c);
        let determinant = determinant.value();
        Intersection { t: volume.value() / determinant, weight: [second.value(), third.value(), determinant] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Ray;
    use bth_random::Rng;

    /// Fewer rounds under Miri, which takes a thousand times as long.
    const ROUNDS: usize = if cfg!(miri) { 200 } else { 40_000 };

    /// Absolute difference of a number and an exact sum.
    fn error_of<const PARTS: usize>(sum: &Expansion<PARTS>, x: f64) -> f64 {
        let mut difference = Expansion::<{ VOLUME_PARTS + 8 }>::new();
        difference.add_sum(sum);
        difference.add(-x);
        difference.value().abs()
    }

    /// A random line and triangle: triangles of all sizes and shapes, slivers among them, and
    /// origins near and far, some in the triangle's plane. None if the ray has no line.
    fn random_pair(rng: &mut Rng, round: usize) -> Option<(Line, [[f64; 3]; 3])> {
        let scale = [1.0, 1e-30, 3e37, 1e-42, 1e12][round % 5];
        let size = [1.0, 1e-3, 1e-6][round / 5 % 3];
        let unit = |rng: &mut Rng| rng.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0;
        let mut point = |near: [f32; 3], size: f32| near.map(|x| (x + unit(rng) * size).clamp(-8.0, 8.0));
        let middle = point([0.0; 3], 4.0);
        let mut corners = [(); 3].map(|()| point(middle, size));
        if (round / 15).is_multiple_of(3) {
            corners[2] = [0, 1, 2].map(|k| corners[0][k] * 0.5 + corners[1][k] * 0.5 + corners[2][k] * 1e-5);
        }
        let mut origin =
            if (round / 45).is_multiple_of(2) { point([0.0; 3], 8.0) } else { point(middle, size) };
        if (round / 90).is_multiple_of(4) {
            origin = [0, 1, 2].map(|k| corners[0][k] * 0.25 + corners[1][k] * 0.25 + corners[2][k] * 0.5);
        }
        let target = point(middle, size * 0.5);
        let direction = [0, 1, 2].map(|k| target[k] - origin[k]);
        let [origin, direction] = [origin, direction].map(|v| v.map(|x| x * scale * 0.1));
        let ray = Ray::new(origin, direction);
        Some((Line::new(&ray)?, corners.map(|p| wide(p.map(|x| x * scale * 0.1)))))
    }

    #[test]
    fn errors_of_weights_volumes_and_t_stay_below_their_bounds_and_accurate_results_within_the_ratio_error() {
        let mut rng = Rng::new(17);
        let (mut accurate, mut open, mut bounded) = (0, 0, 0);
        for round in 0..ROUNDS {
            let Some((line, corners)) = random_pair(&mut rng, round) else { continue };
            let [a, b, c] = corners;
            let (terms, error) = OriginTerms::with_errors(line.origin, corners);
            let norm = max_norm(line.direction);
            let rounded = RoundedIntersection::new(&terms, line.direction, norm);
            let [second, third, determinant] = rounded.weight;
            let weights = [(determinant - second - third, b, c), (second, c, a), (third, a, b)];
            for (weight, p, q) in weights {
                let off = error_of(&line.edge(p, q), weight);
                assert!(off <= error[0] * norm, "round {round}: {weight} is off by {off}");
            }
            let mut volume = Expansion::<VOLUME_PARTS>::new();
            volume.add_volume(line.origin, a, b, c);
            let off = error_of(&volume, terms.volume);
            assert!(off <= error[1], "round {round}: volume {} is off by {off}", terms.volume);
            let same = |sign: f64| weights.iter().all(|(w, ..)| w * sign > error[0] * norm);
            if !same(1.0) && !same(-1.0) {
                open += 1;
                continue;
            }
            let exact = line.exact_intersection(corners);
            let [low, high] = t_range(rounded.t, determinant, [error[0] * norm, error[1]]);
            assert!(low <= exact.t && exact.t <= high, "round {round}: {} is not {low} to {high}", exact.t);
            bounded += usize::from(high - low < exact.t.abs());
            if rounded.is_accurate {
                accurate += 1;
                let off = (rounded.t - exact.t).abs();
                assert!(off <= RATIO_ERROR * exact.t.abs(), "round {round}: t {} is off by {off}", exact.t);
                for i in 0..2 {
                    let off = (rounded.weight[i] * rounded.inverse - exact.weight[i] / exact.weight[2]).abs();
                    assert!(off <= RATIO_ERROR, "round {round}: u or v is off by {off}");
                }
            }
        }
        let enough = ROUNDS / 20;
        assert!(
            accurate > enough && open > enough && bounded > accurate,
            "{accurate} accurate, {open} open, {bounded} bounded"
        );
    }
}
