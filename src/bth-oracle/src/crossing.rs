//! Crossings of surfaces by rays, for the crossing rule of the runtime, by another way: the origin
//! of the ray is moved by a small rational vector instead of an infinitely small one.
//!
//! Coordinates are integers in units of 2^-149. Every sign that the rule asks for is the sign of a
//! number c + x·δ₁ + y·δ₂ + z·δ₃ whose integers c, x, y and z lie below 2^720: products of at most
//! four coordinates or differences, each below 2^279, and a factor of at most 2^149 · 6. With δ =
//! (2^-BITS, 2^-2BITS, 2^-3BITS) and BITS = 724, such a number has the sign of c, or if that is 0
//! of x, or else of y, or else of z: the sign that it has for all smaller δ of this kind. So the
//! moved ray is one in general position, and plain integer determinants decide.

use crate::intersection::{Point, certainly_missed, determinant, has_line, integer, sub};
use bth::Crossings;
use bth::rays::Ray;
use num_bigint::BigInt;
use num_traits::Signed;

/// Binary digits by which the three components of the movement differ.
const BITS: u32 = 724;

/// Returns true if the moved ray of an origin (moved, in units of 2^-(149 + 3 BITS)) crosses a
/// triangle within the ray's range: the sign of its direction times the normal, or 0.
fn crossing(ray: &Ray, moved: &Point, direction: &Point, corners: [[f32; 3]; 3]) -> i32 {
    let [a, b, c] = corners.map(|p| {
        let fine: Point = p.map(|x| integer(x) << (3 * BITS));
        sub(&fine, moved)
    });
    let sides =
        [determinant(direction, &b, &c), determinant(direction, &c, &a), determinant(direction, &a, &b)];
    let all = |test: fn(&BigInt) -> bool| sides.iter().all(test);
    let sign = if all(BigInt::is_positive) {
        1
    } else if all(BigInt::is_negative) {
        -1
    } else {
        return 0;
    };
    // t is volume / whole, in units of 2^-3BITS because the direction is not multiplied as the
    // corners are.
    let (volume, whole): (BigInt, BigInt) = (determinant(&a, &b, &c), sides.iter().sum());
    let after = |end: f32| {
        if end.is_infinite() {
            return end < 0.0;
        }
        // volume / whole > end, with both sides times whole · 2^149.
        let difference: BigInt = (&volume << 149u32) - ((integer(end) * &whole) << (3 * BITS));
        if sign > 0 { difference.is_positive() } else { difference.is_negative() }
    };
    if after(ray.tmin) && !after(ray.tmax) { sign } else { 0 }
}

/// The crossings of triangles by a ray, by the rule of the runtime.
pub fn crossings(corners: &[[[f32; 3]; 3]], ray: &Ray) -> Crossings {
    let mut found = Crossings::default();
    if !has_line(ray) || ray.tmin.is_nan() || ray.tmax.is_nan() {
        return found;
    }
    let mut moved: Point = ray.origin.map(|x| integer(x) << (3 * BITS));
    for (k, x) in moved.iter_mut().enumerate() {
        *x += BigInt::from(1) << ((2 - k as u32) * BITS);
    }
    let direction = ray.direction.map(integer);
    for &triangle in corners {
        let from = triangle.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(ray.origin[k])));
        if certainly_missed(ray.direction.map(f64::from), from, 0.0) {
            continue;
        }
        let sign = crossing(ray, &moved, &direction, triangle);
        found.count += sign.unsigned_abs();
        found.winding += sign;
    }
    found
}

/// The winding number of a surface around a point, along a ray in a direction, on which it does not
/// depend if the surface is closed.
pub fn winding(corners: &[[[f32; 3]; 3]], point: [f32; 3], direction: [f32; 3]) -> i32 {
    crossings(corners, &Ray::new(point, direction)).winding
}
