//! The volume of a start and a triangle in pairs of f64, for rays that begin so close to a triangle
//! that f64 leaves t inaccurate: a ray whose origin is a hit, rounded.
//!
//! A pair holds a number as the sum of two f64, by operations whose errors are f64 (Dekker, "A
//! Floating-Point Technique for Extending the Available Precision", Numerische Mathematik 1971).
//! The errors are the same with and without fused operations, so all instruction sets give the same
//! bits.
//!
//! **Error.** Let u = 2^-53, and let r and m be the largest |coordinates| of a-o and of the edges.
//! These differences must be exact. A component n of the normal is known up to 6u²m²: its products
//! and the difference are exact as pairs, and the low parts, at most 4um² together, are rounded
//! twice. Its product with a component of a-o adds 10u²rm². The three low parts are at most 18urm²
//! together and rounded six times, and the high parts add two roundings of their errors, at most
//! 30urm²: together less than 2^8 u²rm² = 2^-98 rm².

use crate::intersect::vector::{greater, max_norm};
use crate::simd::Doubles;

/// 2^-68: a volume of at least this times rm² has a relative error below 2^-29.
const LEAST: f64 = 1.0 / (1u128 << 68) as f64;

#[inline(always)]
fn vector<D: Doubles>(s: D, [x, y, z]: [f32; 3]) -> D::V {
    s.widen([x, y, z, 0.0])
}

/// The difference of two vectors if it is exact in all three components.
#[inline(always)]
fn exact_difference<D: Doubles>(s: D, p: D::V, q: D::V) -> Option<D::V> {
    let difference = s.sub(p, q);
    let of_q = s.sub(p, difference);
    let rest_of_p = s.sub(p, s.add(difference, of_q));
    let [x, y, z, _] = s.array(s.add(s.abs(rest_of_p), s.abs(s.sub(of_q, q))));
    (x == 0.0 && y == 0.0 && z == 0.0).then_some(difference)
}

/// A sum of three numbers that does not depend on their order: the largest of the sums in three
/// orders.
#[inline(always)]
fn unordered_sum([x, y, z]: [f64; 3]) -> f64 {
    greater(greater(x + y + z, y + z + x), z + x + y)
}

/// (a-o) · ((b-a) × (c-a)), if its relative error is certainly below 2^-29.
#[inline(always)]
pub(super) fn volume<D: Doubles>(s: D, origin: [f32; 3], corners: [[f32; 3]; 3]) -> Option<f64> {
    let [a, b, c] = corners;
    let (a, b, c) = (vector(s, a), vector(s, b), vector(s, c));
    let offset = exact_difference(s, a, vector(s, origin))?;
    let (second, third) = (exact_difference(s, b, a)?, exact_difference(s, c, a)?);
    // With the axes turned by one and by two: x, y and z of these are y, z, x and z, x, y.
    let [second_1, third_1] = [s.rotate(second), s.rotate(third)];
    let [second_2, third_2] = [s.rotate(second_1), s.rotate(third_1)];
    let (p, q) = (s.mul(second_1, third_2), s.mul(second_2, third_1));
    let low = s.sub(s.product_error(second_1, third_2, p), s.product_error(second_2, third_1, q));
    // The normal as a pair.
    let normal = s.sub(p, q);
    let of_q = s.sub(p, normal);
    let error = s.add(s.sub(p, s.add(normal, of_q)), s.sub(of_q, q));
    let low = s.add(error, low);
    let high = s.mul(offset, normal);
    let rest = s.add(s.product_error(offset, normal, high), s.mul(offset, low));
    let ([x, y, z, _], [rest_x, rest_y, rest_z, _]) = (s.array(high), s.array(rest));
    let rest = [rest_x, rest_y, rest_z];
    // The exact error of a sum of two does not depend on their order; of three, the two of greater
    // size come first.
    let (sum, low) = sum_of_three([x, y, z]);
    let value = sum + (low + unordered_sum(rest));
    let [x_o, y_o, z_o, _] = s.array(s.abs(offset));
    let [x_e, y_e, z_e, _] = s.array(s.max(s.abs(second), s.abs(third)));
    let (distance, edge) = (max_norm([x_o, y_o, z_o]), max_norm([x_e, y_e, z_e]));
    let is_zero = [x, y, z] == [0.0; 3] && rest == [0.0; 3];
    (value.abs() > LEAST * (distance * (edge * edge)) || is_zero).then_some(value)
}

/// The sum of three numbers and its error, rounded, in an order by their sizes.
#[inline(always)]
fn sum_of_three([x, y, z]: [f64; 3]) -> (f64, f64) {
    // The number of smallest size last.
    let (x, z) = if x.abs() < z.abs() { (z, x) } else { (x, z) };
    let (y, z) = if y.abs() < z.abs() { (z, y) } else { (y, z) };
    let (first, first_error) = sum_of_two(x, y);
    let (sum, second_error) = sum_of_two(first, z);
    (sum, first_error + second_error)
}

/// The sum of two numbers and its exact error.
#[inline(always)]
fn sum_of_two(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}
