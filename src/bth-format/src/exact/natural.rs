//! Natural numbers of any size, in digits of 64 bits that need no memory from the heap while there
//! are few. The exact decisions about lines take tens of sums and products of 50 to 700 bits each.

use std::borrow::Cow;
use std::cmp::Ordering;

/// Most decisions about lines through instances stay below this number of digits.
const FEW: usize = 8;

/// A natural number: its digits, the last the most significant. Equal numbers may differ in how
/// they are held.
#[derive(Clone, Debug)]
pub(super) enum Natural {
    /// The digits and their number. The last one is not 0.
    Few([u64; FEW], usize),
    /// The same in memory from the heap; of any length.
    Many(Vec<u64>),
}

impl From<u64> for Natural {
    fn from(x: u64) -> Natural {
        Natural::Few([x, 0, 0, 0, 0, 0, 0, 0], usize::from(x != 0))
    }
}

/// Digits without the zeros at the end.
fn significant(digits: &[u64]) -> usize {
    digits.iter().rposition(|digit| *digit != 0).map_or(0, |last| last + 1)
}

impl Natural {
    /// The number whose digits are set in a list of zeros, which may be longer than needed.
    #[inline(always)]
    fn of_digits(count: usize, set: impl FnOnce(&mut [u64])) -> Natural {
        if count <= FEW {
            let mut digits = [0; FEW];
            set(&mut digits[..count]);
            let count = significant(&digits[..count]);
            return Natural::Few(digits, count);
        }
        let mut digits = vec![0; count];
        set(&mut digits);
        digits.truncate(significant(&digits));
        Natural::Many(digits)
    }

    #[inline(always)]
    fn digits(&self) -> &[u64] {
        match self {
            Natural::Few(digits, count) => &digits[..*count],
            Natural::Many(digits) => digits,
        }
    }

    pub(super) fn is_zero(&self) -> bool {
        self.digits().is_empty()
    }

    /// Bits without leading zeros.
    pub(super) fn bits(&self) -> u64 {
        let digits = self.digits();
        digits.last().map_or(0, |last| digits.len() as u64 * 64 - u64::from(last.leading_zeros()))
    }

    /// The number times 2^bits.
    pub(super) fn shifted(&self, bits: u64) -> Cow<'_, Natural> {
        if bits == 0 || self.is_zero() {
            return Cow::Borrowed(self);
        }
        let ((whole, rest), digits) = (((bits / 64) as usize, bits % 64), self.digits());
        Cow::Owned(Natural::of_digits(digits.len() + whole + 1, |shifted| {
            let mut carry = 0u64;
            for (to, &digit) in shifted[whole..].iter_mut().zip(digits) {
                let wide = u128::from(digit) << rest;
                (*to, carry) = (wide as u64 | carry, (wide >> 64) as u64);
            }
            shifted[whole + digits.len()] = carry;
        }))
    }

    /// The 128 bits from a bit on.
    fn window(&self, from: u64) -> u128 {
        let digit = |i: u64| self.digits().get(i as usize).copied().map_or(0, u128::from);
        let (first, rest) = (from / 64, from % 64);
        let low = digit(first) | digit(first + 1) << 64;
        if rest == 0 { low } else { low >> rest | digit(first + 2) << (128 - rest) }
    }

    pub(super) fn plus(&self, other: &Natural) -> Natural {
        let (mut long, mut short) = (self.digits(), other.digits());
        if long.len() < short.len() {
            (long, short) = (short, long);
        }
        Natural::of_digits(long.len() + 1, |sum| {
            let (low, high) = long.split_at(short.len());
            let mut carry = false;
            for ((to, &a), &b) in sum.iter_mut().zip(low).zip(short) {
                (*to, carry) = a.carrying(b, carry);
            }
            for (to, &a) in sum[short.len()..].iter_mut().zip(high) {
                (*to, carry) = a.carrying(0, carry);
            }
            sum[long.len()] = u64::from(carry);
        })
    }

    /// The difference from a number that is not greater.
    pub(super) fn minus(&self, other: &Natural) -> Natural {
        let (long, short) = (self.digits(), other.digits());
        Natural::of_digits(long.len(), |rest| {
            let (low, high) = long.split_at(short.len());
            let mut borrow = false;
            for ((to, &a), &b) in rest.iter_mut().zip(low).zip(short) {
                (*to, borrow) = a.borrowing(b, borrow);
            }
            for (to, &a) in rest[short.len()..].iter_mut().zip(high) {
                (*to, borrow) = a.borrowing(0, borrow);
            }
            debug_assert!(!borrow);
        })
    }

    pub(super) fn times(&self, other: &Natural) -> Natural {
        let (a, b) = (self.digits(), other.digits());
        Natural::of_digits(a.len() + b.len(), |product| {
            for (i, &a) in a.iter().enumerate() {
                let (mut carry, row) = (0u64, &mut product[i..]);
                for (to, &b) in row.iter_mut().zip(b) {
                    let sum = u128::from(a) * u128::from(b) + u128::from(*to) + u128::from(carry);
                    (*to, carry) = (sum as u64, (sum >> 64) as u64);
                }
                row[b.len()] = carry;
            }
        })
    }

    /// A quotient of 62 or 63 bits q, doubled and odd where it is not exact, and the exponent e
    /// with self / divisor = q · 2^e. Neither number is 0.
    pub(super) fn quotient(&self, divisor: &Natural) -> (u128, i64) {
        // At least 64 digits more than the divisor's leading ones, so that windows are full.
        let shift = divisor.bits() as i64 + 62 - self.bits() as i64;
        let [n, d] = [shift.max(0), (-shift).max(0)].map(|shift| shift as u64 + 64);
        let (n, d) = (self.shifted(n), divisor.shifted(d));
        let from = d.bits() - 63;
        // The divisor is rounded up, so this is too small by at most 4.
        let mut quotient = (n.window(from) / (d.window(from) + 1)) as u64;
        let mut rest = n.minus(&d.times(&Natural::from(quotient)));
        while rest >= *d {
            (quotient, rest) = (quotient + 1, rest.minus(&d));
        }
        (u128::from(quotient) << 1 | u128::from(!rest.is_zero()), -shift - 1)
    }
}

/// Sums and differences of digits.
trait Digit: Sized {
    /// The sum with a carry from before, and to the next digit.
    fn carrying(self, other: Self, carry: bool) -> (Self, bool);
    /// The difference with a borrow from before, and to the next digit.
    fn borrowing(self, other: Self, borrow: bool) -> (Self, bool);
}

impl Digit for u64 {
    #[inline(always)]
    fn carrying(self, other: u64, carry: bool) -> (u64, bool) {
        let (sum, over) = self.overflowing_add(other);
        let (sum, over_again) = sum.overflowing_add(u64::from(carry));
        (sum, over | over_again)
    }
    #[inline(always)]
    fn borrowing(self, other: u64, borrow: bool) -> (u64, bool) {
        let (rest, under) = self.overflowing_sub(other);
        let (rest, under_again) = rest.overflowing_sub(u64::from(borrow));
        (rest, under | under_again)
    }
}

impl Ord for Natural {
    fn cmp(&self, other: &Natural) -> Ordering {
        let (a, b) = (self.digits(), other.digits());
        a.len().cmp(&b.len()).then_with(|| a.iter().rev().cmp(b.iter().rev()))
    }
}

impl PartialOrd for Natural {
    fn partial_cmp(&self, other: &Natural) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Natural {
    fn eq(&self, other: &Natural) -> bool {
        self.digits() == other.digits()
    }
}

impl Eq for Natural {}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_random::Rng;
    use num_bigint::BigUint;

    fn known(x: &Natural) -> BigUint {
        BigUint::from_slice(
            &x.digits().iter().flat_map(|d| [*d as u32, (*d >> 32) as u32]).collect::<Vec<_>>(),
        )
    }

    /// Numbers of up to 20 digits, with many that are 0 or have all bits.
    fn draw(rng: &mut Rng) -> Natural {
        let digit = |rng: &mut Rng| match rng.below(4) {
            0 => 0,
            1 => u64::MAX,
            _ => rng.below(u64::MAX),
        };
        let count = rng.below(21) as usize;
        Natural::of_digits(count, |digits| digits.iter_mut().for_each(|to| *to = digit(rng)))
    }

    #[test]
    fn all_operations_agree_with_another_library() {
        let mut rng = Rng::new(17);
        for _ in 0..if cfg!(miri) { 50 } else { 20_000 } {
            let (a, b) = (draw(&mut rng), draw(&mut rng));
            let (x, y) = (known(&a), known(&b));
            assert_eq!((a.bits(), a.is_zero(), a.cmp(&b)), (x.bits(), x.bits() == 0, x.cmp(&y)));
            assert_eq!(known(&a.plus(&b)), &x + &y);
            assert_eq!(known(&a.times(&b)), &x * &y);
            if a >= b {
                assert_eq!(known(&a.minus(&b)), &x - &y);
            }
            let bits = rng.below(200);
            assert_eq!(known(&a.shifted(bits)), &x << bits);
            if a.is_zero() || b.is_zero() {
                continue;
            }
            let (found, exponent) = a.quotient(&b);
            let (quotient, is_rounded) = (BigUint::from(found >> 1), found & 1 == 1);
            assert!((62..=63).contains(&quotient.bits()), "{a:?} / {b:?}");
            // a = quotient · 2^(exponent + 1) · b + less than one unit of the quotient.
            let scale = (exponent + 1).unsigned_abs();
            let (left, right) = if exponent < -1 { (&x << scale, y) } else { (x, &y << scale) };
            let product = &quotient * &right;
            assert!(product <= left && left < &product + &right, "{a:?} / {b:?}");
            assert_eq!(is_rounded, product != left);
        }
    }
}
