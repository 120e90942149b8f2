//! The exact intersection of a line and a triangle whose coordinates are f64.

use crate::intersection::{Intersection, Point, certainly_missed, determinant, intersect_exactly, sub};
use num_bigint::BigInt;
use num_traits::Zero;

/// Where a line hits a closed triangle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LineHit {
    /// Nowhere.
    Missed,
    /// The line lies in the plane of the triangle, or the triangle has no area.
    InPlane,
    /// At one point.
    At(Intersection),
}

/// Returns where the whole line through `origin` along `direction`, which is not zero, hits a
/// triangle. All coordinates must be finite.
pub fn line_hit(origin: [f64; 3], direction: [f64; 3], corners: [[f64; 3]; 3]) -> LineHit {
    let from = corners.map(|p| [0, 1, 2].map(|k| p[k] - origin[k]));
    // A difference has one rounding, which is within the bound.
    if certainly_missed(direction, from, 0.0) {
        return LineHit::Missed;
    }
    let all = || origin.iter().chain(&direction).chain(corners.as_flattened());
    let unit = all().filter(|x| **x != 0.0).map(|x| digits(*x).1).min().unwrap_or(0);
    let exact = |p: [f64; 3]| -> Point {
        p.map(|x| {
            let (digits, exponent) = digits(x);
            if digits == 0 { BigInt::zero() } else { BigInt::from(digits) << (exponent - unit) }
        })
    };
    let (origin, direction, corners) = (exact(origin), exact(direction), corners.map(exact));
    match intersect_exactly(&origin, &direction, &corners) {
        Some(at) => LineHit::At(at),
        None => {
            let [a, b, c] = [0, 1, 2].map(|i| sub(&corners[i], &origin));
            let sides = [[&a, &b], [&b, &c], [&c, &a]].map(|[p, q]| determinant(&direction, p, q));
            if sides.iter().all(Zero::is_zero) { LineHit::InPlane } else { LineHit::Missed }
        }
    }
}

/// A finite number as an odd integer, or zero, times a power of two.
fn digits(x: f64) -> (i64, i32) {
    assert!(x.is_finite());
    let (exponent, fraction) = ((x.to_bits() >> 52 & 0x7ff) as i32, (x.to_bits() & ((1 << 52) - 1)) as i64);
    let (digits, exponent) = match exponent {
        0 => (fraction, -1074),
        e => (fraction | 1 << 52, e - 1075),
    };
    let zeros = if digits == 0 { 0 } else { digits.trailing_zeros() };
    let digits = digits >> zeros;
    (if x < 0.0 { -digits } else { digits }, exponent + zeros as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersection::{intersection, to_f64};
    use bth::rays::Ray;
    use proptest::prelude::*;

    #[test]
    fn digits_and_exponents_are_the_numbers() {
        let cases = [(0.0, (0, -1074)), (1.0, (1, 0)), (-6.0, (-3, 1)), (f64::from_bits(4), (1, -1072))];
        assert!(cases.iter().all(|(x, expected)| digits(*x) == *expected));
        assert_eq!(digits(1.0 + f64::EPSILON), ((1 << 52) + 1, -52));
    }

    #[test]
    fn a_step_of_f64_decides_at_large_coordinates() {
        let far = [5.5e6, 4.2e5, 300.0];
        let at = |x: f64, y: f64, z: f64| [far[0] + x, far[1] + y, far[2] + z];
        let corners = [at(0.0, 0.0, 0.0), at(4.0, 0.0, 0.0), at(0.0, 4.0, 0.0)];
        let step = 2f64.powi(-30);
        let LineHit::At(found) = line_hit(at(0.0, 1.0, 8.0), [0.0, 0.0, -1.0], corners) else {
            panic!("the edge belongs to the triangle")
        };
        assert_eq!((to_f64(&found.t), to_f64(&found.v)), (8.0, 0.25));
        assert_eq!(line_hit(at(-step, 1.0, 8.0), [0.0, 0.0, -1.0], corners), LineHit::Missed);
        assert_eq!(line_hit(at(0.0, 1.0, 0.0), [1.0, 0.0, 0.0], corners), LineHit::InPlane);
    }

    proptest! {
        /// The same as for f32.
        #[test]
        fn small_numbers_are_hit_as_in_f32(numbers in prop::array::uniform15(-4i32..5)) {
            let f = |i: usize| [0, 1, 2].map(|k| numbers[3 * i + k] as f32);
            prop_assume!(f(1) != [0.0; 3]);
            let wide = |i: usize| f(i).map(f64::from);
            let found = line_hit(wide(0), wide(1), [wide(2), wide(3), wide(4)]);
            let expected = intersection(&Ray::new(f(0), f(1)), [f(2), f(3), f(4)]);
            match found {
                LineHit::At(at) => prop_assert_eq!(Some(at), expected),
                _ => prop_assert_eq!(None, expected),
            }
        }
    }
}
