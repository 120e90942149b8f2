//! Distance of a point to a triangle in world space ([`WideTriangle`]): bounds in f64, and exactly.
//!
//! The closest point lies on a corner if no edge there leads towards the point, on an edge if the
//! foot of the perpendicular lies within it and the point on its outer side, else on the face
//! (the regions of Ericson, "Real-Time Collision Detection", 5.1.5). Signs that f64 leaves open
//! only make the bounds of the distance looser; who needs more asks for [`ExactDistance`].
//!
//! **Errors**, with u = 2^-53 and the sizes of [`super::wide_triangle`]. A corner of size s is off
//! by √3 · 4.01 us, and its length by less than 16 us. |p × e| / |e| is off by less than 128 u
//! s(p)s(e) / |e|: 32√3 u for the product, and 7 u s(e) / |e| of the quotient, which is at most √3
//! s(p). With N, the product of the sizes of two edges, |n·p| / |n| is off by less than 512 u N
//! s(p) / |n|: 128 u for the product and 32√3 u N / |n| of the quotient. Squares of these relative
//! errors are negligible where N / |n| or s(e) / |e| is below [`FLATTEST`]. These bounds, doubled,
//! hold for the components of the vector to the closest point, too.

use super::point_triangle::Feature;
use super::vector::{cross, dot};
use super::wide_triangle::{CROSS_ERROR, VOLUME_ERROR, WEIGHT_ERROR, WideRelative, WideTriangle, in_range};
use bth_format::exact::{Dyadic, DyadicVector, dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
use std::cmp::Ordering;

/// Max quotient of a product of sizes and the length of the vector.
const FLATTEST: f64 = (1u64 << 36) as f64;
/// 2^-40: bounds the error of a reported distance and point relative to the distance plus the
/// longest edge.
const ACCURACY: f64 = 1.0 / (1u64 << 40) as f64;
/// 2^-29: bounds the error of a reported distance relative to itself.
const RELATIVE: f64 = 1.0 / (1 << 29) as f64;
/// 2^-26: bounds the error of weights.
const WEIGHT_ACCURACY: f64 = 1.0 / (1 << 26) as f64;

/// Bounds of the distance of a point to a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured {
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Where the closest point lies, if f64 is certain of it.
    pub(crate) feature: Option<Feature>,
}

/// A distance, and an upper bound of its error.
type Bounded = (f64, f64);

fn length(v: [f64; 3]) -> f64 {
    dot(v, v).sqrt()
}

/// The distance to corner i.
fn to_corner(r: &WideRelative, i: usize) -> Bounded {
    (length(r.corner[i]), CROSS_ERROR / 2.0 * r.far[i])
}

/// The distance to the line of edge i.
fn to_line(r: &WideRelative, i: usize) -> Bounded {
    let j = (i + 1) % 3;
    let nearest = if r.far[i] <= r.far[j] { i } else { j };
    let (edge, far) = (length(r.edge[i]), r.far[nearest]);
    let flatness = r.long[i] / edge;
    let distance = length(cross(r.corner[nearest], r.edge[i])) / edge;
    (distance, if flatness < FLATTEST { 4.0 * CROSS_ERROR * flatness * far } else { f64::INFINITY })
}

/// The distance to the plane.
fn to_plane(r: &WideRelative, (normal, size): ([f64; 3], f64)) -> Bounded {
    let nearest = [1, 2].into_iter().fold(0, |best, i| if r.far[i] < r.far[best] { i } else { best });
    let whole = length(normal);
    let flatness = size / whole;
    let distance = dot(normal, r.corner[nearest]).abs() / whole;
    let error = 4.0 * VOLUME_ERROR * flatness * r.far[nearest];
    (distance, if flatness < FLATTEST { error } else { f64::INFINITY })
}

fn is_exactly_at(r: &WideRelative) -> Option<Measured> {
    let i = r.far.iter().position(|far| *far == 0.0)?;
    Some(Measured { low: 0.0, high: 0.0, feature: Some(Feature::Vertex(i as u8)) })
}

/// Bounds the distance of the point to the triangle.
#[inline(never)]
pub(crate) fn measure(r: &WideRelative) -> Measured {
    if !in_range(&r.far) || !in_range(&r.long) {
        let unknown = Measured { low: 0.0, high: f64::INFINITY, feature: None };
        return is_exactly_at(r).unwrap_or(unknown);
    }
    let normal = r.normal();
    let sides = [r.side(0, normal), r.side(1, normal), r.side(2, normal)];
    let around = |(distance, error): Bounded, feature| {
        let low = if distance > error { distance - error } else { 0.0 };
        Measured { low, high: distance + error, feature }
    };
    if sides == [1; 3] {
        return around(to_plane(r, normal), Some(Feature::Face));
    }
    let feet = [r.foot(0), r.foot(1), r.foot(2)];
    let mut bounds = Measured { low: f64::INFINITY, high: f64::INFINITY, feature: None };
    for i in 0..3 {
        if feet[i] == [1; 2] && sides[(i + 2) % 3] < 0 {
            return around(to_line(r, i), Some(Feature::Edge(i as u8)));
        }
        let corner = around(to_corner(r, i), Some(Feature::Vertex(i as u8)));
        if feet[i][0] < 0 && feet[(i + 2) % 3][1] < 0 {
            return corner;
        }
        (bounds.low, bounds.high) = (bounds.low.min(corner.low), bounds.high.min(corner.high));
    }
    // Nothing that may hold the closest point is nearer than it, and each point of the triangle is
    // at least as far away.
    for i in (0..3).filter(|i| feet[*i].iter().all(|sign| *sign >= 0)) {
        let line = around(to_line(r, i), None);
        bounds.low = bounds.low.min(line.low);
        if feet[i] == [1; 2] {
            bounds.high = bounds.high.min(line.high);
        }
    }
    if sides.iter().all(|sign| *sign >= 0) {
        bounds.low = bounds.low.min(around(to_plane(r, normal), None).low);
    }
    bounds
}

/// The exact distance of a point to a triangle.
#[derive(Clone, Debug)]
pub(crate) struct ExactDistance {
    pub(crate) feature: Feature,
    /// The vector to the closest point, and the weights of the corners, times `whole`.
    vector: DyadicVector,
    weight: DyadicVector,
    whole: Dyadic,
}

/// a·x + b·y for vectors a and b.
fn combined([a, x]: [&DyadicVector; 2], [b, y]: [&Dyadic; 2]) -> DyadicVector {
    [0, 1, 2].map(|k| &(&a[k] * b) + &(&x[k] * y))
}

impl ExactDistance {
    #[cold]
    #[inline(never)]
    pub(crate) fn new(point: [f64; 3], triangle: &WideTriangle) -> ExactDistance {
        let point = dyadic_vector(point);
        let corner = triangle.exact().map(|corner| dyadic_difference(&corner, &point));
        let edge = [0, 1, 2].map(|i| dyadic_difference(&corner[(i + 1) % 3], &corner[i]));
        let [zero, one] = [0.0, 1.0].map(Dyadic::from);
        let feet = [0, 1, 2]
            .map(|i| [-&dyadic_dot(&edge[i], &corner[i]), dyadic_dot(&edge[i], &corner[(i + 1) % 3])]);
        let mut weight = [zero.clone(), zero.clone(), zero];
        for i in 0..3 {
            if feet[i][0].sign().is_le() && feet[(i + 2) % 3][1].sign().is_le() {
                weight[i] = one.clone();
                let feature = Feature::Vertex(i as u8);
                return ExactDistance { feature, vector: corner[i].clone(), weight, whole: one };
            }
        }
        let normal = dyadic_cross(&edge[0], &edge[1]);
        let weights =
            [0, 1, 2].map(|i| dyadic_dot(&normal, &dyadic_cross(&corner[(i + 1) % 3], &corner[(i + 2) % 3])));
        for i in 0..3 {
            let [from, to] = &feet[i];
            if from.sign().is_gt() && to.sign().is_gt() && weights[(i + 2) % 3].sign().is_le() {
                let whole = from + to;
                let vector = combined([&corner[i], &edge[i]], [&whole, from]);
                (weight[i], weight[(i + 1) % 3]) = (to.clone(), from.clone());
                return ExactDistance { feature: Feature::Edge(i as u8), vector, weight, whole };
            }
        }
        let (whole, height) = (dyadic_dot(&normal, &normal), dyadic_dot(&normal, &corner[0]));
        let vector = normal.map(|x| &x * &height);
        ExactDistance { feature: Feature::Face, vector, weight: weights, whole }
    }

    /// Compares two distances.
    pub(crate) fn compare(&self, other: &ExactDistance) -> Ordering {
        let square = |x: &Dyadic| x * x;
        let (left, right) =
            (dyadic_dot(&self.vector, &self.vector), dyadic_dot(&other.vector, &other.vector));
        (&(&left * &square(&other.whole)) - &(&right * &square(&self.whole))).sign()
    }

    /// Compares the distance with a number that is not negative.
    pub(crate) fn compare_with(&self, distance: f64) -> Ordering {
        if distance == f64::INFINITY {
            return Ordering::Less;
        }
        let limit = &Dyadic::from(distance) * &self.whole;
        (&dyadic_dot(&self.vector, &self.vector) - &(&limit * &limit)).sign()
    }

    /// The vector to the closest point, each component rounded.
    fn rounded(&self) -> [f64; 3] {
        self.vector.each_ref().map(|x| x.ratio(&self.whole))
    }

    /// The distance, off by at most 8 u of it.
    pub(crate) fn distance(&self) -> f64 {
        scaled_length(self.rounded())
    }
}

/// The length of a vector whose squares may over- or underflow.
fn scaled_length(v: [f64; 3]) -> f64 {
    let most = v.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    // The first is 0 or infinite.
    if most == 0.0 || most == f64::INFINITY { most } else { length(v.map(|x| x / most)) * most }
}

/// The closest point of a triangle, as it is reported.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Located {
    pub(crate) distance: f64,
    /// The vector from the point.
    pub(crate) vector: [f64; 3],
    /// Barycentric weights of the second and of the third corner.
    pub(crate) weight: [f64; 2],
    pub(crate) feature: Feature,
}

/// The closest point of a triangle. With d, the distance, and s, the longest edge (maximum norm),
/// distance and components are off by at most 2^-40 (d + s), the distance by at most 2^-29 d, and
/// weights by at most 2^-26.
pub(crate) fn locate(point: [f64; 3], triangle: &WideTriangle) -> Located {
    let relative = triangle.relative(point);
    let measured = measure(&relative);
    if let Some(feature) = measured.feature
        && let Some(located) = located_in_f64(&relative, feature)
    {
        return located;
    }
    let exact = ExactDistance::new(point, triangle);
    let weight = [1, 2].map(|i| exact.weight[i].ratio(&exact.whole));
    Located { distance: exact.distance(), vector: exact.rounded(), weight, feature: exact.feature }
}

/// The closest point on a feature, computed in f64, if that is accurate enough.
///
/// On an edge, the place of the foot is off by 192 u times the far end, on the face by twice what
/// the distance is: both by less than twice the error of the distance times the ratio of the sizes
/// of the corners. Weights of the face are off by 512 u N/n² s² where the corners relative to the
/// foot are within 2 s, and by 16 s/|n| for each unit by which these are off.
fn located_in_f64(r: &WideRelative, feature: Feature) -> Option<Located> {
    let longest = r.edge.iter().flatten().fold(0.0f64, |most, x| most.max(x.abs()));
    let far = r.far[0].max(r.far[1]).max(r.far[2]);
    let ratio = 2.0 * far / r.far[0].min(r.far[1]).min(r.far[2]);
    let mut weight = [0.0; 3];
    let (vector, (distance, error), off, weight_error);
    match feature {
        Feature::Vertex(i) => {
            let i = usize::from(i);
            weight[i] = 1.0;
            (vector, (distance, error)) = (r.corner[i], to_corner(r, i));
            (off, weight_error) = (error, 0.0);
        }
        Feature::Edge(i) => {
            let i = usize::from(i);
            let (j, edge) = ((i + 1) % 3, r.edge[i]);
            let (from, to) = (-dot(edge, r.corner[i]), dot(edge, r.corner[j]));
            let t = from / (from + to);
            (weight[i], weight[j]) = (1.0 - t, t);
            vector = [0, 1, 2].map(|k| r.corner[i][k] + t * edge[k]);
            (distance, error) = to_line(r, i);
            off = error * ratio;
            weight_error = off / length(edge);
        }
        Feature::Face => {
            let (normal, size) = r.normal();
            let squared = dot(normal, normal);
            let height = dot(normal, r.corner[0]) / squared;
            vector = normal.map(|x| x * height);
            let flat = r.corner.map(|p| [0, 1, 2].map(|k| p[k] - vector[k]));
            for i in 0..3 {
                weight[i] = dot(normal, cross(flat[(i + 1) % 3], flat[(i + 2) % 3])) / squared;
            }
            (distance, error) = to_plane(r, (normal, size));
            off = error * ratio;
            let rounding = 8.0 * WEIGHT_ERROR * size * longest * longest / squared;
            weight_error = rounding + 16.0 * off * longest / squared.sqrt();
        }
    }
    let is_accurate = off <= ACCURACY * (distance + longest)
        && (error <= RELATIVE * distance || error == 0.0)
        && weight_error <= WEIGHT_ACCURACY;
    let [_, u, v] = weight.map(|w| w.clamp(0.0, 1.0));
    is_accurate.then_some(Located { distance, vector, weight: [u, v], feature })
}
