//! Exact arithmetic on any finite `f64`: numbers m · 2^e with integers m of any length. It is slow
//! and has no limits; [`super::Expansion`] is faster, for values of `f32` precision.

use num_bigint::{BigInt, BigUint, Sign};
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// A number m · 2^e.
#[derive(Clone, Debug)]
pub struct Dyadic {
    mantissa: BigInt,
    exponent: i64,
}

/// A vector of exact numbers.
pub type DyadicVector = [Dyadic; 3];

/// Digits of a quotient before it is rounded to the 53 of `f64`; a further bit holds whether
/// there is a remainder.
const QUOTIENT_BITS: u64 = 66;

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
        let mantissa = BigInt::from(magnitude);
        Dyadic { mantissa: if x < 0.0 { -mantissa } else { mantissa }, exponent: biased.max(1) - 1075 }
    }
}

impl Dyadic {
    /// Compares with 0.
    pub fn sign(&self) -> Ordering {
        match self.mantissa.sign() {
            Sign::Minus => Ordering::Less,
            Sign::NoSign => Ordering::Equal,
            Sign::Plus => Ordering::Greater,
        }
    }

    /// The number in units of 2^exponent, a smaller one than its own.
    fn digits(&self, exponent: i64) -> BigInt {
        &self.mantissa << (self.exponent - exponent) as u64
    }

    /// The nearest `f64`; ties go to the even one. Infinite beyond the range of `f64`.
    pub fn to_f64(&self) -> f64 {
        self.ratio(&Dyadic::from(1.0))
    }

    /// The quotient, rounded to the nearest `f64` (below the range of normal numbers twice). NaN
    /// where the divisor is 0.
    pub fn ratio(&self, divisor: &Dyadic) -> f64 {
        let ((sign, n), (other, d)) = (parts(&self.mantissa), parts(&divisor.mantissa));
        if other == Sign::NoSign {
            return f64::NAN;
        }
        if sign == Sign::NoSign {
            return 0.0;
        }
        let shift = QUOTIENT_BITS as i64 + d.bits() as i64 - n.bits() as i64;
        let (n, d) = if shift >= 0 { (n << shift as u64, d) } else { (n, d << shift.unsigned_abs()) };
        let quotient = &n / &d;
        let has_rest = &quotient * &d != n;
        // At most 67 bits.
        let digits = quotient.iter_u64_digits().rev().fold(0u128, |sum, digit| sum << 64 | u128::from(digit));
        let rounded = (digits << 1 | u128::from(has_rest)) as f64;
        let value = scaled(rounded, self.exponent - divisor.exponent - shift - 1);
        if sign == other { value } else { -value }
    }
}

fn parts(x: &BigInt) -> (Sign, BigUint) {
    (x.sign(), x.magnitude().clone())
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
        let exponent = self.exponent.min(other.exponent);
        Dyadic { mantissa: self.digits(exponent) + other.digits(exponent), exponent }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, other: &Dyadic) -> Dyadic {
        self + &-other
    }
}

impl Neg for &Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic { mantissa: -&self.mantissa, exponent: self.exponent }
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, other: &Dyadic) -> Dyadic {
        Dyadic { mantissa: &self.mantissa * &other.mantissa, exponent: self.exponent + other.exponent }
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
