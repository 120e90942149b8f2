//! Exact arithmetic on any finite `f64`: numbers ±m · 2^e with natural m of any size. It has no
//! limits; [`super::Expansion`] is faster, for values of `f32` precision.

use super::natural::Natural;
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// A number ±m · 2^e.
#[derive(Clone, Debug)]
pub struct Dyadic {
    /// False where m is 0.
    is_negative: bool,
    mantissa: Natural,
    exponent: i64,
}

/// A vector of exact numbers.
pub type DyadicVector = [Dyadic; 3];

impl From<f64> for Dyadic {
    /// The exact value of a number.
    ///
    /// # Panics
    /// If it is not finite.
    fn from(x: f64) -> Dyadic {
        assert!(x.is_finite(), "a finite number");
        let bits = x.to_bits();
        let (fraction, biased) = (bits & ((1 << 52) - 1), (bits >> 52 & 0x7ff) as i64);
        let magnitude = if biased == 0 { fraction } else { fraction | 1 << 52 };
        // Numbers of f32 keep their 24 bits.
        let zeros = magnitude.trailing_zeros() % 64;
        let exponent = biased.max(1) - 1075 + i64::from(zeros);
        Dyadic { is_negative: x < 0.0, mantissa: Natural::from(magnitude >> zeros), exponent }
    }
}

impl Dyadic {
    /// Compares with 0.
    pub fn sign(&self) -> Ordering {
        match self.is_negative {
            true => Ordering::Less,
            false if self.mantissa.is_zero() => Ordering::Equal,
            false => Ordering::Greater,
        }
    }

    /// The nearest `f64`; ties go to the even one. Infinite beyond the range of `f64`.
    pub fn to_f64(&self) -> f64 {
        self.ratio(&Dyadic::from(1.0))
    }

    /// The quotient, rounded to the nearest `f64` (below the range of normal numbers twice). NaN
    /// where the divisor is 0.
    pub fn ratio(&self, divisor: &Dyadic) -> f64 {
        if divisor.mantissa.is_zero() {
            return f64::NAN;
        }
        if self.mantissa.is_zero() {
            return 0.0;
        }
        let (quotient, exponent) = self.mantissa.quotient(&divisor.mantissa);
        let value = scaled(quotient as f64, self.exponent - divisor.exponent + exponent);
        if self.is_negative == divisor.is_negative { value } else { -value }
    }

    /// self + other, or self - other.
    fn combined(&self, other: &Dyadic, is_difference: bool) -> Dyadic {
        // The exponent of 0 says nothing about the digits that a sum needs.
        if other.mantissa.is_zero() {
            return self.clone();
        }
        if self.mantissa.is_zero() {
            return if is_difference { -other } else { other.clone() };
        }
        let exponent = self.exponent.min(other.exponent);
        let [a, b] = [self, other].map(|x| x.mantissa.shifted((x.exponent - exponent) as u64));
        let of_other = other.is_negative != is_difference;
        let (is_negative, mantissa) = match () {
            () if self.is_negative == of_other => (of_other, a.plus(&b)),
            () if a >= b => (self.is_negative, a.minus(&b)),
            () => (of_other, b.minus(&a)),
        };
        Dyadic { is_negative: is_negative && !mantissa.is_zero(), mantissa, exponent }
    }
}

/// x · 2^exponent, in steps that only the last of may round.
fn scaled(mut x: f64, exponent: i64) -> f64 {
    let power = |e: i64| f64::from_bits(((1023 + e) as u64) << 52);
    let mut rest = exponent.clamp(-3000, 3000);
    while rest < -900 && x.abs() > power(-100) {
        (x, rest) = (x * power(-100), rest + 100);
    }
    while rest > 900 && x.is_finite() {
        (x, rest) = (x * power(900), rest - 900);
    }
    // What is still left is far below the smallest number.
    x * power(rest.clamp(-1022, 1023))
}

impl Add for &Dyadic {
    type Output = Dyadic;
    fn add(self, other: &Dyadic) -> Dyadic {
        self.combined(other, false)
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, other: &Dyadic) -> Dyadic {
        self.combined(other, true)
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic { is_negative: !self.is_negative && !self.mantissa.is_zero(), ..self.clone() }
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, other: &Dyadic) -> Dyadic {
        let mantissa = self.mantissa.times(&other.mantissa);
        let is_negative = self.is_negative != other.is_negative && !mantissa.is_zero();
        Dyadic { is_negative, mantissa, exponent: self.exponent + other.exponent }
    }
}

/// The vector of exact values.
pub fn dyadic_vector(v: [f64; 3]) -> DyadicVector {
    v.map(Dyadic::from)
}

/// a - b.
pub fn dyadic_difference(a: &DyadicVector, b: &DyadicVector) -> DyadicVector {
    [0, 1, 2].map(|k| &a[k] - &b[k])
}

/// a × b.
pub fn dyadic_cross(a: &DyadicVector, b: &DyadicVector) -> DyadicVector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &(&a[i] * &b[j]) - &(&a[j] * &b[i]))
}

/// a · b.
pub fn dyadic_dot(a: &DyadicVector, b: &DyadicVector) -> Dyadic {
    &(&(&a[0] * &b[0]) + &(&a[1] * &b[1])) + &(&a[2] * &b[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;

    const ROUNDS: usize = if cfg!(miri) { 20 } else { 5_000 };

    #[test]
    fn sums_and_products_are_exact_where_integers_can_tell() {
        let mut rng = Rng::new(3);
        for _ in 0..ROUNDS {
            let mut draw = || rng.below(1 << 40) as i128 - (1 << 39);
            let [a, b, c] = [draw(), draw(), draw()];
            let [x, y, z] = [a, b, c].map(|n| Dyadic::from(n as f64));
            let sum = &(&x * &y) - &(&y * &z);
            assert_eq!(sum.sign(), (a * b - b * c).cmp(&0));
            assert_eq!(sum.to_f64(), (a * b - b * c) as f64);
            assert_eq!((&x + &z).to_f64(), (a + c) as f64);
        }
    }

    #[test]
    fn quotients_are_rounded_to_the_nearest_number() {
        let mut rng = Rng::new(5);
        for _ in 0..ROUNDS {
            let mut draw = || f64::from_bits(rng.below(1 << 52) | (900 + rng.below(200)) << 52);
            let (a, b) = (draw(), draw());
            assert_eq!(Dyadic::from(a).ratio(&Dyadic::from(b)), a / b, "{a} / {b}");
            assert_eq!(Dyadic::from(-a).ratio(&Dyadic::from(b)), -a / b);
        }
        let [largest, least] = [f64::MAX, f64::from_bits(1)].map(Dyadic::from);
        assert_eq!([largest.to_f64(), least.to_f64()], [f64::MAX, f64::from_bits(1)]);
        assert_eq!(largest.ratio(&least), f64::INFINITY);
        assert_eq!(least.ratio(&largest), 0.0);
        assert_eq!((&largest * &least).ratio(&largest), f64::from_bits(1));
        assert!(least.ratio(&Dyadic::from(0.0)).is_nan());
    }

    #[test]
    fn signs_of_sums_that_rounding_loses_are_exact() {
        let [one, tiny] = [1.0, f64::from_bits(1)].map(Dyadic::from);
        let above = &one + &tiny;
        assert_eq!((above.to_f64(), (&above - &one).sign()), (1.0, Ordering::Greater));
        assert_eq!((&(&above - &one) - &tiny).sign(), Ordering::Equal);
    }
}
