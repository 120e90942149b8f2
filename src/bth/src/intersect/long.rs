//! Numbers and lines with twice the digits of f64, for what f64 leaves open about lines in world
//! space. Most of it is the precision of t, u and v; [`super::exact_line`] decides the rest.
//!
//! A number is the sum of two f64, by operations whose errors are f64 (Dekker, "A Floating-Point
//! Technique for Extending the Available Precision", Numerische Mathematik 1971). Sums and products
//! have relative errors below 2^-100. Nothing is fused, so all instruction sets give the same bits.

use super::exact::{INVERSE_RATIO_ERROR, Intersection};
use super::origin::{Origin, RoundedLine, RoundedOrigin};
use super::vector::{greater, max_norm};
use std::ops::{Add, Div, Mul, Sub};

/// The sum of two f64, the second at most half a unit in the last place of the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Long(f64, f64);

/// A vector.
pub(crate) type LongVector = [Long; 3];

fn two_sum(a: f64, b: f64) -> Long {
    let sum = a + b;
    let of_b = sum - a;
    Long(sum, (a - (sum - of_b)) + (b - of_b))
}

/// Like [`two_sum`], for |a| >= |b|.
fn quick_sum(a: f64, b: f64) -> Long {
    let sum = a + b;
    Long(sum, b - (sum - a))
}

fn product(a: f64, b: f64) -> Long {
    let split = |x: f64| {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    };
    let (product, (ah, al), (bh, bl)) = (a * b, split(a), split(b));
    Long(product, al * bl - (((product - ah * bh) - al * bh) - ah * bl))
}

impl From<f64> for Long {
    fn from(x: f64) -> Long {
        Long(x, 0.0)
    }
}

impl Add for Long {
    type Output = Long;
    fn add(self, other: Long) -> Long {
        let (high, low) = (two_sum(self.0, other.0), two_sum(self.1, other.1));
        let sum = quick_sum(high.0, high.1 + low.0);
        quick_sum(sum.0, sum.1 + low.1)
    }
}

impl Sub for Long {
    type Output = Long;
    fn sub(self, other: Long) -> Long {
        self + Long(-other.0, -other.1)
    }
}

impl Mul for Long {
    type Output = Long;
    fn mul(self, other: Long) -> Long {
        let high = product(self.0, other.0);
        quick_sum(high.0, high.1 + (self.0 * other.1 + self.1 * other.0))
    }
}

impl Div for Long {
    type Output = Long;
    fn div(self, other: Long) -> Long {
        let quotient = self.0 / other.0;
        let rest = self - other * Long::from(quotient);
        quick_sum(quotient, rest.0 / other.0)
    }
}

impl Long {
    /// The number, rounded.
    pub(crate) fn rounded(self) -> f64 {
        self.0
    }
}

/// The vector of exact numbers.
pub(crate) fn long_vector(v: [f64; 3]) -> LongVector {
    v.map(Long::from)
}

/// a - b.
pub(crate) fn long_difference(a: LongVector, b: LongVector) -> LongVector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

/// a · b.
pub(crate) fn long_dot(a: LongVector, b: LongVector) -> Long {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn long_cross(a: LongVector, b: LongVector) -> LongVector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
}

/// 2^-98: bounds the errors of sums of products of three components relative to their sizes.
pub(crate) const LONG_ERROR: f64 = 1.0 / (1u128 << 98) as f64;

/// 2^-52: bounds the rounding of a number to f64, relative to the number.
const ROUNDED: f64 = f64::EPSILON;

/// The point with weights u and v of a triangle: a + u(b-a) + v(c-a), or (ub + vc)/(u + v) where
/// u + v exceeds 1.
pub(crate) fn long_start(corners: [[f64; 3]; 3], [u, v]: [f64; 2]) -> LongVector {
    let [a, b, c] = corners.map(long_vector);
    let sum = two_sum(u, v);
    let is_above_one = sum.0 > 1.0 || sum.0 == 1.0 && sum.1 > 0.0;
    let (u, v) = (Long::from(u), Long::from(v));
    [0, 1, 2].map(|k| match is_above_one {
        true => (u * b[k] + v * c[k]) / sum,
        false => a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]),
    })
}

/// A line in the space of an object.
pub(crate) struct LongLine {
    pub(crate) origin: LongVector,
    /// Bound of the error of the origin's coordinates.
    pub(crate) origin_error: f64,
    pub(crate) direction: LongVector,
    /// Bound of the error of the direction's components, relative to the largest |component|.
    pub(crate) direction_error: f64,
}

impl LongLine {
    /// Decides about a triangle: whether the line crosses it and where, as
    /// [`super::exact::estimate`] does. `None` if the bounds of errors leave that open.
    #[cold]
    #[inline(never)]
    pub(crate) fn decide(&self, corners: [[f64; 3]; 3]) -> Option<Option<Intersection>> {
        let [a, b, c] = corners.map(long_vector);
        let (offset, second, third) =
            (long_difference(a, self.origin), long_difference(b, a), long_difference(c, a));
        let normal = long_cross(second, third);
        let volume = long_dot(offset, normal);
        let determinant = long_dot(self.direction, normal);
        let weights = [long_cross(third, offset), long_cross(offset, second)]
            .map(|term| long_dot(self.direction, term).rounded());
        let first = (determinant - Long::from(weights[0]) - Long::from(weights[1])).rounded();
        let size = |v: LongVector| max_norm(v.map(Long::rounded));
        let (distance, edge) = (size(offset), greater(size(second), size(third)));
        let rounding = 64.0 * LONG_ERROR;
        let line = RoundedLine {
            origin: RoundedOrigin([0.0; 3], self.origin_error),
            direction: [0.0; 3],
            direction_error: self.direction_error,
        };
        let error = [rounding * edge * (edge + distance), rounding * distance * edge * edge];
        let [weight_error, volume_error] = line.enlarge(error, edge, distance);
        // The weights were rounded to f64.
        let of_weights = ROUNDED * (first.abs() + weights[0].abs() + weights[1].abs());
        let bound = weight_error * size(self.direction) + of_weights;
        let (volume, determinant) = (volume.rounded(), determinant.rounded());
        let all = [first, weights[0], weights[1]];
        if all.iter().any(|w| *w > bound) && all.iter().any(|w| *w < -bound) {
            return Some(None);
        }
        let is_inside = all.iter().all(|w| *w > bound) || all.iter().all(|w| *w < -bound);
        let is_accurate = INVERSE_RATIO_ERROR * bound < determinant.abs()
            && INVERSE_RATIO_ERROR * volume_error < volume.abs();
        (is_inside && is_accurate).then(|| {
            let weight = [weights[0], weights[1], determinant];
            Some(Intersection { t: volume / determinant, weight })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_format::exact::Dyadic;
    use bth_random::Rng;
    use std::cmp::Ordering;

    #[test]
    fn errors_of_sums_products_and_quotients_stay_below_their_bound() {
        let mut rng = Rng::new(5);
        for _ in 0..if cfg!(miri) { 20 } else { 5_000 } {
            let mut draw = || {
                let mut number =
                    |least: u64| f64::from_bits(rng.below(1 << 52) | (least + rng.below(20)) << 52);
                quick_sum(number(1013), -number(950))
            };
            let (a, b) = (draw(), draw());
            let exact = |x: Long| &Dyadic::from(x.0) + &Dyadic::from(x.1);
            let close = |found: Long, expected: &Dyadic, scale: &Dyadic| {
                let off = &(&exact(found) * scale) - expected;
                let bound = expected * &Dyadic::from(4.0 * LONG_ERROR / 16.0);
                (&(&off * &off) - &(&bound * &bound)).sign() != Ordering::Greater
            };
            let one = Dyadic::from(1.0);
            assert!(close(a + b, &(&exact(a) + &exact(b)), &one), "{a:?} + {b:?}");
            assert!(close(a * b, &(&exact(a) * &exact(b)), &one), "{a:?} * {b:?}");
            assert!(close(a / b, &exact(a), &exact(b)), "{a:?} / {b:?}");
        }
    }
}
