//! Integers times powers of two: sums, differences and products of floating-point numbers without
//! any rounding.

use num_bigint::{BigInt, Sign};
use num_rational::BigRational;
use num_traits::Zero;
use std::iter::Sum;
use std::ops::{Add, Mul, Neg, Sub};

/// A coordinate of a caller: f32 or f64.
pub trait Coordinate: Copy + Into<f64> {}

impl<T: Copy + Into<f64>> Coordinate for T {}

/// The number `digits * 2^exponent`.
#[derive(Clone, Debug)]
pub(crate) struct Number {
    digits: BigInt,
    exponent: i32,
}

/// A point or a vector.
pub(crate) type Point = [Number; 3];

impl<T: Coordinate> From<T> for Number {
    fn from(x: T) -> Number {
        let x: f64 = x.into();
        assert!(x.is_finite());
        let fraction = (x.to_bits() & ((1 << 52) - 1)) as i64;
        let (digits, exponent) = match (x.to_bits() >> 52 & 0x7ff) as i32 {
            0 => (fraction, -1074),
            e => (fraction | 1 << 52, e - 1075),
        };
        let zeros = digits.trailing_zeros() % 64;
        let digits = BigInt::from(if x < 0.0 { -(digits >> zeros) } else { digits >> zeros });
        Number { digits, exponent: exponent + zeros as i32 }
    }
}

impl Number {
    /// 2^exponent.
    pub(crate) fn power_of_two(exponent: i32) -> Number {
        Number { digits: BigInt::from(1), exponent }
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.digits.is_zero()
    }

    pub(crate) fn is_positive(&self) -> bool {
        self.digits.sign() == Sign::Plus
    }

    pub(crate) fn is_negative(&self) -> bool {
        self.digits.sign() == Sign::Minus
    }

    /// Two exponents: the number is a multiple of 2^first, and its absolute value below 2^second.
    pub(crate) fn range(&self) -> [i32; 2] {
        [self.exponent, self.exponent + self.digits.bits() as i32]
    }

    /// The quotient by a number that is not zero.
    pub(crate) fn over(&self, other: &Number) -> BigRational {
        let shift = self.exponent - other.exponent;
        let [up, down] = [shift, -shift].map(|x| x.max(0) as u32);
        BigRational::new(&self.digits << up, &other.digits << down)
    }

    fn sum(&self, other: &Number, is_difference: bool) -> Number {
        let exponent = match (self.is_zero(), other.is_zero()) {
            (true, _) => other.exponent,
            (_, true) => self.exponent,
            _ => self.exponent.min(other.exponent),
        };
        let digits = |x: &Number| {
            if x.is_zero() { BigInt::zero() } else { &x.digits << (x.exponent - exponent) as u32 }
        };
        let (a, b) = (digits(self), digits(other));
        Number { digits: if is_difference { a - b } else { a + b }, exponent }
    }
}

impl Add for &Number {
    type Output = Number;
    fn add(self, other: &Number) -> Number {
        self.sum(other, false)
    }
}

impl Sub for &Number {
    type Output = Number;
    fn sub(self, other: &Number) -> Number {
        self.sum(other, true)
    }
}

impl Mul for &Number {
    type Output = Number;
    fn mul(self, other: &Number) -> Number {
        Number { digits: &self.digits * &other.digits, exponent: self.exponent + other.exponent }
    }
}

impl Neg for Number {
    type Output = Number;
    fn neg(self) -> Number {
        Number { digits: -self.digits, exponent: self.exponent }
    }
}

impl Sum for Number {
    fn sum<I: Iterator<Item = Number>>(numbers: I) -> Number {
        numbers.fold(Number::from(0.0), |sum, x| &sum + &x)
    }
}

pub(crate) fn exact<T: Coordinate>(p: [T; 3]) -> Point {
    p.map(Number::from)
}

pub(crate) fn sub(a: &Point, b: &Point) -> Point {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

pub(crate) fn dot(a: &Point, b: &Point) -> Number {
    (0..3).map(|k| &a[k] * &b[k]).sum()
}

pub(crate) fn cross(a: &Point, b: &Point) -> Point {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &(&a[i] * &b[j]) - &(&a[j] * &b[i]))
}

pub(crate) fn determinant(a: &Point, b: &Point, c: &Point) -> Number {
    dot(a, &cross(b, c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_and_exponents_are_the_numbers() {
        let cases = [(0.0, 0, -1074), (1.0, 1, 0), (-6.0, -3, 1), (f64::from_bits(4), 1, -1072)];
        for (x, digits, exponent) in cases {
            let number = Number::from(x);
            assert_eq!((number.digits, number.exponent), (digits.into(), exponent), "{x}");
        }
        let number = Number::from(1.0 + f64::EPSILON);
        assert_eq!((number.digits, number.exponent), (((1i64 << 52) + 1).into(), -52));
        assert_eq!(Number::from(-f32::MAX).range(), [104, 128]);
    }

    #[test]
    fn nothing_is_rounded() {
        let [large, small, one] = [1e300, -1e-300, 1.0].map(Number::from);
        let sum = &(&large + &small) - &large;
        assert_eq!(sum.over(&one), BigRational::from_float(-1e-300).unwrap());
        assert_eq!((&sum * &large).over(&(&small * &one)), BigRational::from_float(1e300).unwrap());
        assert!((&sum - &small).is_zero() && (-sum).is_positive());
    }
}
