//! A cheap proof that two triangles that share a vertex touch only there: a separating plane, with
//! a bound on the rounding of the dot products. Makes the exact tests unnecessary for most
//! neighbours.

use super::Point;

type Vector = [f64; 3];

/// Bound on the relative rounding of `dot(p - s, d)` in f64, of the sum of the magnitudes of its
/// terms: one rounding each for the difference, the product and two additions, doubled for safety.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

#[inline]
fn minus(p: Point, s: Point) -> Vector {
    [f64::from(p[0]) - f64::from(s[0]), f64::from(p[1]) - f64::from(s[1]), f64::from(p[2]) - f64::from(s[2])]
}

#[inline]
fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns true if `dot(v, d)` is certainly positive, for `v` a rounded difference of f32 points.
#[inline]
fn certainly_positive(v: Vector, d: Vector) -> bool {
    let magnitude = (v[0] * d[0]).abs() + (v[1] * d[1]).abs() + (v[2] * d[2]).abs();
    dot(v, d) > ROUNDING * magnitude
}

#[inline]
fn unit(v: Vector) -> Vector {
    let scale = 1.0 / dot(v, v).sqrt();
    [v[0] * scale, v[1] * scale, v[2] * scale]
}

/// Returns true if a plane through `s` certainly has `a` strictly on one side and `b` strictly on
/// the other, so that the triangles (s, a0, a1) and (s, b0, b1) have only `s` in common. False
/// proves nothing. Any direction is a valid witness; the one tried runs between the corners'
/// bisectors.
#[inline]
pub(super) fn fans_are_apart(s: Point, a: [Point; 2], b: [Point; 2]) -> bool {
    // Written out because `map` on arrays of arrays is not always inlined and this code runs for
    // most pairs.
    let (a0, a1, b0, b1) = (minus(a[0], s), minus(a[1], s), minus(b[0], s), minus(b[1], s));
    let (ua0, ua1, ub0, ub1) = (unit(a0), unit(a1), unit(b0), unit(b1));
    let between = |k: usize| (ua0[k] + ua1[k]) - (ub0[k] + ub1[k]);
    let d = [between(0), between(1), between(2)];
    let back = [-d[0], -d[1], -d[2]];
    certainly_positive(a0, d)
        && certainly_positive(a1, d)
        && certainly_positive(b0, back)
        && certainly_positive(b1, back)
}
