//! Crossings of surfaces by rays, for the crossing rule of the runtime, by another way: the origin
//! of the ray is moved by a small vector instead of an infinitely small one.
//!
//! Let all coordinates relative to the origin, the direction, the scale of the line and the ends of
//! the range be multiples of 2^low and below 2^high, with low <= 0 <= high. Every sign that the
//! rule asks for is the sign of a number c + x·δ₁ + y·δ₂ + z·δ₃, where c, x, y and z are sums of at
//! most 24 products of up to five such numbers: multiples of 2^(5 low), below 2^(5 high + 5). With
//! δ = (2^-b, 2^-2b, 2^-3b) and b = 5 (high - low) + 8, such a number has the sign of c, or if that
//! is 0 of x, or else of y, or else of z: the sign that it has for all smaller δ of this kind. So
//! the moved ray is one in general position, and plain determinants decide.

use crate::intersection::{IDENTITY, Line, Placed};
use crate::nearest::row;
use crate::number::{Coordinate, Number, Point, determinant, sub};
use crate::ray::ExactRay;
use bth::Crossings;

/// Returns the sign of the direction times the normal if the moved line crosses a triangle within
/// the ray's range, else 0.
fn crossing(ray: &ExactRay, line: &Line, triangle: &Placed<'_>) -> i32 {
    let corners = line.relative(&triangle.exact());
    let ends = ray.range.into_iter().filter(|x| x.is_finite()).map(|x| Number::from(x).range());
    let all = corners.as_flattened().iter().chain(&line.direction).chain([&line.scale]).map(Number::range);
    let [low, high] = all.chain(ends).fold([0; 2], |[low, high], [a, b]| [low.min(a), high.max(b)]);
    let bits = 5 * (high - low) + 8;
    let moved: Point = [1, 2, 3].map(|k| Number::power_of_two(-bits * k));
    let [a, b, c] = corners.each_ref().map(|p| sub(p, &moved));
    let d = &line.direction;
    let sides = [determinant(d, &b, &c), determinant(d, &c, &a), determinant(d, &a, &b)];
    let sign = match () {
        () if sides.iter().all(Number::is_positive) => 1,
        () if sides.iter().all(Number::is_negative) => -1,
        () => return 0,
    };
    let is_ahead = |x: &Number| if sign > 0 { x.is_positive() } else { x.is_negative() };
    // t = volume / whole.
    let whole = &sides.into_iter().sum::<Number>() * &line.scale;
    let volume = determinant(&a, &b, &c);
    let is_after = |end: f64| match end.is_infinite() {
        true => end < 0.0,
        false => is_ahead(&(&volume - &(&Number::from(end) * &whole))),
    };
    let [tmin, tmax] = ray.range;
    // The line through a start itself, not the moved one, crosses the plane at t > 0.
    let is_begun = match ray.is_from_start() {
        true => is_ahead(&determinant(&corners[0], &corners[1], &corners[2])),
        false => is_after(tmin),
    };
    if is_begun && !is_after(tmax) { sign } else { 0 }
}

/// The crossings of triangles by a ray, by the rule of the runtime.
pub fn crossings<T: Coordinate>(corners: &[[[T; 3]; 3]], ray: impl Into<ExactRay>) -> Crossings {
    let (ray, mut found) = (ray.into(), Crossings::default());
    let Some(line) = ray.line(|primitive| row(corners, primitive.triangle)) else { return found };
    if ray.range.iter().any(|x| x.is_nan()) {
        return found;
    }
    for &triangle in corners {
        let triangle = Placed::new(triangle, &IDENTITY);
        if !line.certainly_misses(&triangle) {
            let sign = crossing(&ray, &line, &triangle);
            found.count += sign.unsigned_abs();
            found.winding += sign;
        }
    }
    found
}

/// The winding number of a surface around a point, along a ray in a direction, on which it does not
/// depend if the surface is closed.
pub fn winding<T: Coordinate>(corners: &[[[T; 3]; 3]], point: [T; 3], direction: [T; 3]) -> i32 {
    crossings(corners, ExactRay::double(point.map(Into::into), direction.map(Into::into))).winding
}
