//! Whether, where and how lines cross closed triangles. This one place decides it, whatever structure led there, so that every
//! structure, record and instruction set gives the same bits.
//!
//! With o + t·d = a + u·(b-a) + v·(c-a), Cramer's rule gives t, u and v as quotients of determinants (Möller and Trumbore,
//! "Fast, Minimum Storage Ray/Triangle Intersection", JGT 1997), here with the products in such an order that all but three
//! scalar products with d is the same for every ray from one point ([`OriginTerms`]). f64 decides; where its error bound leaves a sign,
//! or a digit, open, exact sums decide ([`bth_format::exact`]).
//!
//! **Errors.** u = 2^-53; r, m and D are the greatest coordinates of a-o, of the two edges, and of d. Differences are off by u of
//! themselves. A component of a vector product of two of them has two products, each off by three roundings, and a difference: 8u times
//! both sizes. So the whole and the weights of b and c, scalar products with d, are off by 3·8u and 16u for their own roundings: 40uDm²
//! and 40uDmr. The weight of a is the whole without those two: 98uDm(m+r). The volume: (3·8 + 3·2 + 16)urm².
//! Products of three differences of f32 values, and of three such with bounds, lie far from f64's limits.

use crate::intersect::line::Line;
use bth_format::exact::{EDGE_PARTS, Expansion, VOLUME_PARTS};

/// t, u and v are computed exactly unless f64 gives them to 2^-28, an eighth of the rounding of f32: u and v relative to 1, t to itself.
pub(crate) const RATIO_ERROR: f64 = 1.0 / (1u64 << 28) as f64;
/// More than 98 roundings of f64: bounds the error of weights relative to Dm(m+r), and that of the volume relative to rm².
const WEIGHT_ERROR: f64 = 128.0 / (1u64 << 53) as f64;

/// Where a triangle is hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Intersection {
    /// In units of the direction. Order hits by this; report it rounded to f32.
    pub(crate) t: f64,
    /// u, v and 1 as multiples of the same.
    pub(crate) weight: [f64; 3],
}

/// A number as it is reported: rounded, and never -0.0.
#[inline(always)]
pub(crate) fn reported(x: f64) -> f32 {
    x as f32 + 0.0
}

/// A share as it is reported: rounded, and neither less than 0 for being off nor -0.0.
#[inline(always)]
pub(crate) fn reported_share(x: f64) -> f32 {
    // Compared in the way that vector instructions do.
    (if x > 0.0 { x } else { 0.0 }) as f32
}

impl Intersection {
    /// Barycentric weights of the triangle's second and third vertex, as they are reported.
    pub(crate) fn uv(&self) -> [f32; 2] {
        let [u, v, whole] = self.weight;
        let share = 1.0 / whole;
        [reported_share(u * share), reported_share(v * share)]
    }
}

/// What f64 makes of a line and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Estimate {
    /// The line passes the triangle.
    Missed,
    /// It crosses, at t, u and v good to [`RATIO_ERROR`].
    Crossed(Intersection),
    /// Rounding hides the answer; and between which t the line crosses, if it does.
    Open(Doubt, [f64; 2]),
}

/// What rounding hides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Doubt {
    weighed: Weighed,
    /// The weights of all corners, and the bound of their error.
    weight: [f64; 3],
    bound: f64,
}

/// The lesser, and the greater. Compared in the way that vector instructions do; nothing is NaN here.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The greatest |coordinate|.
#[inline(always)]
pub(crate) fn size([x, y, z]: [f64; 3]) -> f64 {
    greater(greater(x.abs(), y.abs()), z.abs())
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn vector_product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn scalar_product(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The greatest of the sums in all orders. t is made of these: then a model and rays that are turned by quarters give the same bits
/// of it, and of two hits that are equal the same is the nearest. (u and v decide nothing.)
#[inline(always)]
fn unordered_scalar_product(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
    greater(greater(x + y + z, y + z + x), z + x + y)
}

/// A triangle as it is seen from a point, in whatever direction. No operation here and below is fused and none is
/// conditional, so the bits are the same on every machine, one triangle at a time or many.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OriginTerms {
    /// What a direction's scalar products with give the sum of all weights,
    pub(crate) whole: [f64; 3],
    /// that of the second corner
    pub(crate) second: [f64; 3],
    /// and of the third.
    pub(crate) third: [f64; 3],
    /// t as a multiple of the sum of all weights.
    pub(crate) volume: f64,
    /// t, u and v are good to [`RATIO_ERROR`] where the sum of the weights exceeds this times the size of the direction.
    pub(crate) least: f64,
}

impl OriginTerms {
    #[inline(always)]
    pub(crate) fn new(origin: [f64; 3], corners: [[f64; 3]; 3]) -> OriginTerms {
        OriginTerms::with_errors(origin, corners).0
    }

    /// Also bounds of the error of weights, for a direction of size 1, and of the volume.
    #[inline(always)]
    fn with_errors(origin: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> (OriginTerms, [f64; 2]) {
        let (to, second, third) = (minus(a, origin), minus(b, a), minus(c, a));
        let whole = vector_product(second, third);
        let volume = unordered_scalar_product(to, whole);
        let (far, edge) = (size(to), greater(size(second), size(third)));
        let error = [WEIGHT_ERROR * (edge * (edge + far)), WEIGHT_ERROR * (far * (edge * edge))];
        const AS_WELL: f64 = 1.0 / RATIO_ERROR;
        let is_good = AS_WELL * error[1] < volume.abs();
        let seen = OriginTerms {
            whole,
            second: vector_product(third, to),
            third: vector_product(to, second),
            volume,
            least: if is_good { AS_WELL * error[0] } else { f64::INFINITY },
        };
        (seen, error)
    }
}

/// What f64 makes of a line and a triangle, before anything is decided from it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weighed {
    /// Of the second and the third corner, and the sum of all three.
    pub(crate) weight: [f64; 3],
    /// 1 / that sum.
    pub(crate) share: f64,
    pub(crate) t: f64,
    /// t, u and v are good to [`RATIO_ERROR`].
    pub(crate) is_good: bool,
}

impl Weighed {
    /// Of a direction of this size.
    #[inline(always)]
    pub(crate) fn new(seen: &OriginTerms, direction: [f64; 3], size: f64) -> Weighed {
        let whole = unordered_scalar_product(direction, seen.whole);
        let weight = [scalar_product(direction, seen.second), scalar_product(direction, seen.third), whole];
        let share = 1.0 / whole;
        Weighed { weight, share, t: seen.volume * share, is_good: seen.least * size < whole.abs() }
    }

    fn crossing(&self) -> Intersection {
        Intersection { t: self.t, weight: self.weight }
    }
}

/// Decides in f64, or leaves it open.
#[inline(always)]
pub(crate) fn estimate(origin: [f64; 3], direction: [f64; 3], corners: [[f64; 3]; 3]) -> Estimate {
    let (seen, error) = OriginTerms::with_errors(origin, corners);
    let size = size(direction);
    let weighed = Weighed::new(&seen, direction, size);
    let [second, third, whole] = weighed.weight;
    let first = whole - second - third;
    let least = lesser(lesser(first, second), third);
    let greatest = greater(greater(first, second), third);
    let bound = error[0] * size;
    if least < -bound && greatest > bound {
        return Estimate::Missed;
    }
    let inside = least > bound || greatest < -bound;
    if inside && weighed.is_good {
        return Estimate::Crossed(weighed.crossing());
    }
    let t = if inside {
        t_range(weighed.t, whole, [bound, error[1]])
    } else {
        [f64::NEG_INFINITY, f64::INFINITY]
    };
    Estimate::Open(Doubt { weighed, weight: [first, second, third], bound }, t)
}

/// Between which t a line crosses a triangle, given t, the sum of its weights and the errors of that, whose sign is certain, and of the volume:
/// (V+p)/(W+q) - V/W = (p - q·V/W)/(W+q).
#[inline(never)]
fn t_range(t: f64, whole: f64, error: [f64; 2]) -> [f64; 2] {
    /// More than the roundings of this and of t itself.
    const ROUNDING: f64 = 1.0 / (1u64 << 48) as f64;
    let whole = whole.abs();
    if whole <= 2.0 * error[0] {
        return [f64::NEG_INFINITY, f64::INFINITY];
    }
    let shift = (error[1] + t.abs() * error[0]) / (whole - error[0]);
    let shift = shift + (shift + t.abs()) * ROUNDING;
    [t - shift, t + shift]
}

#[inline(always)]
pub(crate) fn wide(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

impl Line {
    /// Whether, where and how the line crosses the closed triangle with these corners.
    pub(crate) fn crossing(&self, corners: [[f32; 3]; 3]) -> Option<Intersection> {
        match estimate(self.origin, self.direction, corners.map(wide)) {
            Estimate::Missed => None,
            Estimate::Crossed(crossing) => Some(crossing),
            Estimate::Open(doubt, _) => self.close_crossing(corners, &doubt),
        }
    }

    /// A crossing that f64 leaves open: whether there is one is decided exactly, and t, u and v are exact unless f64's are good.
    #[cold]
    #[inline(never)]
    fn close_crossing(&self, corners: [[f32; 3]; 3], doubt: &Doubt) -> Option<Intersection> {
        let corners = corners.map(wide);
        let &Doubt { weighed, mut weight, bound } = doubt;
        for i in 0..3 {
            if weight[i].abs() <= bound {
                weight[i] = self.edge(corners[(i + 1) % 3], corners[(i + 2) % 3]).value();
            }
        }
        let positive = weight.iter().any(|&w| w > 0.0);
        let negative = weight.iter().any(|&w| w < 0.0);
        if positive == negative {
            return None; // passes outside, or lies in the plane
        }
        Some(if weighed.is_good { weighed.crossing() } else { self.exact_crossing(corners) })
    }

    /// The weight of the corner opposite an edge p→q: det[d, p-o, q-o].
    fn edge(&self, p: [f64; 3], q: [f64; 3]) -> Expansion<EDGE_PARTS> {
        let mut sum = Expansion::<EDGE_PARTS>::new();
        sum.add_edge(self.origin, self.direction, p, q);
        sum
    }

    /// t, u and v from exact sums.
    fn exact_crossing(&self, [a, b, c]: [[f64; 3]; 3]) -> Intersection {
        let (second, third) = (self.edge(c, a), self.edge(a, b));
        let mut whole = Expansion::<{ 3 * EDGE_PARTS }>::new();
        whole.add_edge(self.origin, self.direction, b, c);
        whole.add_sum(&second);
        whole.add_sum(&third);
        let mut volume = Expansion::<VOLUME_PARTS>::new();
        volume.add_volume(self.origin, a, b, c);
        let whole = whole.value();
        Intersection { t: volume.value() / whole, weight: [second.value(), third.value(), whole] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Ray;
    use bth_random::Rng;

    /// Miri takes a thousand times as long.
    const ROUNDS: usize = if cfg!(miri) { 200 } else { 40_000 };

    /// By how much a number differs from an exact sum.
    fn off<const PARTS: usize>(sum: &Expansion<PARTS>, x: f64) -> f64 {
        let mut difference = Expansion::<{ VOLUME_PARTS + 8 }>::new();
        difference.add_sum(sum);
        difference.add(-x);
        difference.value().abs()
    }

    /// Triangles of all sizes and shapes near and far, seen from points on their planes, too.
    fn draw(rng: &mut Rng, round: usize) -> Option<(Line, [[f64; 3]; 3])> {
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
        let ray = Ray { origin, tmin: 0.0, direction, tmax: f32::INFINITY };
        Some((Line::new(&ray)?, corners.map(|p| wide(p.map(|x| x * scale * 0.1)))))
    }

    #[test]
    fn weights_and_volumes_are_off_by_less_than_their_bounds_and_good_ones_by_less_than_they_say() {
        let mut rng = Rng::new(17);
        let (mut good, mut open, mut bounded) = (0, 0, 0);
        for round in 0..ROUNDS {
            let Some((line, corners)) = draw(&mut rng, round) else { continue };
            let [a, b, c] = corners;
            let (seen, error) = OriginTerms::with_errors(line.origin, corners);
            let size = size(line.direction);
            let weighed = Weighed::new(&seen, line.direction, size);
            let [second, third, whole] = weighed.weight;
            let weights = [(whole - second - third, b, c), (second, c, a), (third, a, b)];
            for (weight, p, q) in weights {
                let off = off(&line.edge(p, q), weight);
                assert!(off <= error[0] * size, "round {round}: {weight} is off by {off}");
            }
            let mut volume = Expansion::<VOLUME_PARTS>::new();
            volume.add_volume(line.origin, a, b, c);
            let off = off(&volume, seen.volume);
            assert!(off <= error[1], "round {round}: volume {} is off by {off}", seen.volume);
            let same = |sign: f64| weights.iter().all(|(w, ..)| w * sign > error[0] * size);
            if !same(1.0) && !same(-1.0) {
                open += 1;
                continue;
            }
            let exact = line.exact_crossing(corners);
            let [low, high] = t_range(weighed.t, whole, [error[0] * size, error[1]]);
            assert!(low <= exact.t && exact.t <= high, "round {round}: {} is not {low} to {high}", exact.t);
            bounded += usize::from(high - low < exact.t.abs());
            if weighed.is_good {
                good += 1;
                let off = (weighed.t - exact.t).abs();
                assert!(off <= RATIO_ERROR * exact.t.abs(), "round {round}: t {} is off by {off}", exact.t);
                for i in 0..2 {
                    let off = (weighed.weight[i] * weighed.share - exact.weight[i] / exact.weight[2]).abs();
                    assert!(off <= RATIO_ERROR, "round {round}: a share is off by {off}");
                }
            }
        }
        let enough = ROUNDS / 20;
        assert!(
            good > enough && open > enough && bounded > good,
            "{good} good, {open} open, {bounded} bounded"
        );
    }
}
