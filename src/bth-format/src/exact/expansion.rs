//! Exact sums of products of `f32` values, for the few decisions that rounding in `f64` leaves
//! open.
//!
//! Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates"
//! (1997): a sum is kept as non-overlapping parts of growing size. Products of three f32 values lie
//! between 2^-447 and 2^384, products of four between 2^-596 and 2^512, so nothing here over- or
//! underflows.

pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

/// Exact product as a rounded value and its error (Dekker's splitting: no fused
/// multiply-add, which not every target has in hardware).
pub(super) fn two_product(a: f64, b: f64) -> (f64, f64) {
    fn split(x: f64) -> (f64, f64) {
        let c = 134_217_729.0 * x;
        let high = c - (c - x);
        (high, x - high)
    }
    let product = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    (product, al * bl - (((product - ah * bh) - al * bh) - ah * bl))
}

/// Parts that [`Expansion::add_edge`] needs at most: it adds 18 products of two numbers each, and
/// each addition makes at most one part more.
pub const EDGE_PARTS: usize = 36;
/// Parts that [`Expansion::add_volume`] needs at most: it adds 24 products of two numbers each.
pub const VOLUME_PARTS: usize = 48;

/// An exact sum, as up to `PARTS` numbers that do not overlap, in ascending order of size.
/// Additions beyond that panic.
pub struct Expansion<const PARTS: usize> {
    part: [f64; PARTS],
    len: usize,
}

/// `p - o` where `f64` holds it exactly, which it does unless coordinates differ by a factor of
/// about 2^29.
fn exact_difference(o: [f64; 3], p: [f64; 3]) -> Option<[f64; 3]> {
    let differences = [0, 1, 2].map(|k| two_sum(p[k], -o[k]));
    differences.iter().all(|(_, error)| *error == 0.0).then(|| differences.map(|(difference, _)| difference))
}

/// det[a-o, b-o, c-o] for numbers of `f64`, with a relative error of a few units in the last place:
/// its sign is exact. `None` where that takes more than a short sum.
pub fn wide_volume(o: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> Option<f64> {
    /// Products of three numbers in this range, to the last bit, are far from the limits of `f64`.
    const RANGE: std::ops::Range<f64> = 1.0 / (1u128 << 127) as f64..(1u128 << 127) as f64;
    // A plane along two axes holds all four points.
    if (0..3).any(|k| [a[k], b[k], c[k]] == [o[k]; 3]) {
        return Some(0.0);
    }
    let [a, b, c] = [exact_difference(o, a)?, exact_difference(o, b)?, exact_difference(o, c)?];
    if [a, b, c].iter().flatten().any(|x| *x != 0.0 && !RANGE.contains(&x.abs())) {
        return None;
    }
    let mut volume = Expansion::<VOLUME_PARTS>::new();
    volume.add_long_determinant(a, b, c);
    Some(volume.value())
}

impl<const PARTS: usize> Default for Expansion<PARTS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const PARTS: usize> Expansion<PARTS> {
    /// The sum of no numbers: 0.
    pub fn new() -> Self {
        Expansion { part: [0.0; PARTS], len: 0 }
    }

    /// Adds one number.
    pub fn add(&mut self, x: f64) {
        if x == 0.0 {
            return;
        }
        let (mut carry, mut kept) = (x, 0);
        for i in 0..self.len {
            let (sum, error) = two_sum(carry, self.part[i]);
            carry = sum;
            if error != 0.0 {
                self.part[kept] = error;
                kept += 1;
            }
        }
        if carry != 0.0 {
            self.part[kept] = carry;
            kept += 1;
        }
        self.len = kept;
    }

    /// Adds a·b·c for values of f32 precision (a·b is then exact in f64).
    pub(super) fn add_product(&mut self, a: f64, b: f64, c: f64) {
        let (product, error) = two_product(a * b, c);
        self.add(error);
        self.add(product);
    }

    /// Adds a·b·c for values of `f64` whose products neither over- nor underflow.
    fn add_long_product(&mut self, a: f64, b: f64, c: f64) {
        let (product, error) = two_product(a, b);
        for part in [error, product] {
            if part != 0.0 {
                let (product, error) = two_product(part, c);
                self.add(error);
                self.add(product);
            }
        }
    }

    /// Adds det[a, b, c] for values of `f64` precision.
    fn add_long_determinant(&mut self, a: [f64; 3], b: [f64; 3], c: [f64; 3]) {
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            self.add_long_product(a[i], b[j], c[k]);
            self.add_long_product(-a[i], b[k], c[j]);
        }
    }

    /// Adds sign · det[a, b, c] for values of `f32` precision.
    fn add_determinant(&mut self, sign: f64, a: [f64; 3], b: [f64; 3], c: [f64; 3]) {
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            self.add_product(sign * a[i], b[j], c[k]);
            self.add_product(-sign * a[i], b[k], c[j]);
        }
    }

    /// Adds another sum.
    pub fn add_sum<const OTHER: usize>(&mut self, other: &Expansion<OTHER>) {
        other.part[..other.len].iter().for_each(|&part| self.add(part));
    }

    /// Adds another sum times a value of `f32` precision.
    pub fn add_scaled<const OTHER: usize>(&mut self, other: &Expansion<OTHER>, factor: f64) {
        for &part in &other.part[..other.len] {
            let (product, error) = two_product(part, factor);
            self.add(error);
            self.add(product);
        }
    }

    /// Adds det[d, a-o, b-o]. Where `f64` does not hold the differences, the determinant is
    /// expanded into products of three inputs.
    pub fn add_edge(&mut self, o: [f64; 3], d: [f64; 3], a: [f64; 3], b: [f64; 3]) {
        if let (Some(a), Some(b)) = (exact_difference(o, a), exact_difference(o, b)) {
            return self.add_long_determinant(d, a, b);
        }
        self.add_determinant(1.0, d, a, b);
        self.add_determinant(-1.0, d, o, b);
        self.add_determinant(-1.0, d, a, o);
    }

    /// Adds det[a-o, b-o, c-o]; as [`Self::add_edge`].
    pub fn add_volume(&mut self, o: [f64; 3], a: [f64; 3], b: [f64; 3], c: [f64; 3]) {
        if let (Some(a), Some(b), Some(c)) =
            (exact_difference(o, a), exact_difference(o, b), exact_difference(o, c))
        {
            return self.add_long_determinant(a, b, c);
        }
        self.add_determinant(1.0, a, b, c);
        self.add_determinant(-1.0, o, b, c);
        self.add_determinant(-1.0, a, o, c);
        self.add_determinant(-1.0, a, b, o);
    }

    /// Adds the product of two other sums. The parts of each, multiplied with one another, must
    /// neither over- nor underflow, as is true of sums of products of two `f32` values.
    pub fn add_product_of<const A: usize, const B: usize>(&mut self, a: &Expansion<A>, b: &Expansion<B>) {
        for &x in &a.part[..a.len] {
            for &y in &b.part[..b.len] {
                let (product, error) = two_product(x, y);
                self.add(error);
                self.add(product);
            }
        }
    }

    /// The sum, rounded; its sign is exact.
    pub fn value(&self) -> f64 {
        self.part[..self.len].iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::{dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
    use bth_random::Rng;

    /// Miri takes a thousand times as long.
    const ROUNDS: u32 = if cfg!(miri) { 200 } else { 20_000 };

    fn wide(v: [f32; 3]) -> [f64; 3] {
        v.map(f64::from)
    }

    #[test]
    fn products_are_exact_where_integers_can_tell() {
        let mut rng = Rng::new(7);
        for _ in 0..ROUNDS / 2 {
            let [a, b, c] = [(); 3].map(|()| rng.below(1 << 24) as f64 - (1 << 23) as f64);
            let mut e = Expansion::<2>::new();
            e.add_product(a, b, c);
            let want = a as i128 * b as i128 * c as i128;
            let got: i128 = e.part[..e.len].iter().map(|&x| x as i128).sum();
            assert_eq!(got, want);
        }
    }

    #[test]
    fn volumes_of_f64_have_exact_signs() {
        let (mut rng, mut found) = (Rng::new(19), [0; 4]);
        for round in 0..ROUNDS {
            let step = [1.0, 1.1, 1e-9][round as usize % 3];
            let mut point = || [(); 3].map(|()| (rng.below(9) as f64 - 4.0) * step);
            let (o, mut corners) = (point(), [point(), point(), point()]);
            if round % 5 == 0 {
                corners = corners.map(|[x, y, _]| [x * 1.1, y, o[2]]);
            }
            let Some(volume) = wide_volume(o, corners) else {
                found[3] += 1;
                continue;
            };
            let [a, b, c] = corners.map(|p| dyadic_difference(&dyadic_vector(p), &dyadic_vector(o)));
            let exact = dyadic_dot(&dyadic_cross(&a, &b), &c);
            assert_eq!(volume.partial_cmp(&0.0), Some(exact.sign()), "{o:?} {corners:?}");
            assert!((volume - exact.to_f64()).abs() <= 8.0 * f64::EPSILON * volume.abs());
            found[(exact.sign() as i8 + 1) as usize] += 1;
        }
        assert!(found.iter().all(|n| *n > ROUNDS / 50), "{found:?}");
    }

    #[test]
    fn products_of_sums_are_exact_where_integers_can_tell() {
        let mut rng = Rng::new(9);
        for _ in 0..ROUNDS / 2 {
            let mut draw = || {
                let (mut sum, mut want) = (Expansion::<2>::new(), 0);
                for shift in [0, 30] {
                    let x = (rng.below(1 << 24) as i128 - (1 << 23)) << shift;
                    want += x;
                    sum.add(x as f64);
                }
                (sum, want)
            };
            let ((a, x), (b, y)) = (draw(), draw());
            let mut product = Expansion::<8>::new();
            product.add_product_of(&a, &b);
            let got: i128 = product.part[..product.len].iter().map(|&x| x as i128).sum();
            assert_eq!(got, x * y);
        }
    }

    #[test]
    fn edge_signs_agree_with_integer_arithmetic() {
        let mut rng = Rng::new(11);
        let mut zeros = 0;
        for round in 0..ROUNDS {
            let range = if round % 2 == 0 { 5 } else { 1 << 22 };
            let mut draw = || [(); 3].map(|()| rng.below(2 * range) as i64 as f32 - range as f32);
            let [o, d, a, b] = [draw(), draw(), draw(), draw()];
            let int = |v: [f32; 3]| v.map(|x| x as i128);
            let sub = |p: [i128; 3], q: [i128; 3]| [0, 1, 2].map(|k| p[k] - q[k]);
            let (p, q, d1) = (sub(int(a), int(o)), sub(int(b), int(o)), int(d));
            let want: i128 = (0..3)
                .map(|i| {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    d1[i] * (p[j] * q[k] - p[k] * q[j])
                })
                .sum();
            let mut e = Expansion::<EDGE_PARTS>::new();
            e.add_edge(wide(o), wide(d), wide(a), wide(b));
            assert_eq!(e.value().partial_cmp(&0.0), Some(want.cmp(&0)));
            zeros += (want == 0) as u32;
        }
        assert!(zeros > ROUNDS / 200, "the degenerate case must be among the tests");
    }

    #[test]
    fn volume_signs_agree_with_orient3d() {
        let mut rng = Rng::new(13);
        for round in 0..ROUNDS {
            let range = if round % 2 == 0 { 3 } else { 1 << 24 };
            let mut draw = || [(); 3].map(|()| (rng.below(2 * range) as i64 - range as i64) as f32);
            let [o, a, b, c] = [draw(), draw(), draw(), draw()];
            let mut e = Expansion::<VOLUME_PARTS>::new();
            e.add_volume(wide(o), wide(a), wide(b), wide(c));
            let p = |v: [f32; 3]| robust::Coord3D { x: v[0], y: v[1], z: v[2] };
            // robust's orient3d(a, b, c, o) is det[a-o, b-o, c-o].
            assert_eq!(
                e.value().partial_cmp(&0.0),
                robust::orient3d(p(a), p(b), p(c), p(o)).partial_cmp(&0.0)
            );
        }
    }

    /// Coordinates of every size, so that differences are exact for some and not for others: the
    /// two ways of adding up agree on the sum.
    #[test]
    fn differences_and_products_of_inputs_add_up_alike() {
        let mut rng = Rng::new(17);
        let mut ways = [0; 2];
        for _ in 0..ROUNDS {
            let spread = rng.below(60) + 1;
            let mut draw = || {
                [(); 3].map(|()| {
                    let bits = rng.below(1 << 24) as f64 - (1 << 23) as f64;
                    // A power of two, without the error that powi may have.
                    bits * f64::from_bits((993 + rng.below(spread)) << 52)
                })
            };
            let [o, d, a, b, c] = [draw(), draw(), draw(), draw(), draw()];
            ways[usize::from(exact_difference(o, a).is_some() && exact_difference(o, b).is_some())] += 1;
            let mut edge = Expansion::<{ 2 * EDGE_PARTS }>::new();
            edge.add_edge(o, d, a, b);
            edge.add_determinant(-1.0, d, a, b);
            edge.add_determinant(1.0, d, o, b);
            edge.add_determinant(1.0, d, a, o);
            assert_eq!(edge.len, 0);
            let mut volume = Expansion::<{ 2 * VOLUME_PARTS }>::new();
            volume.add_volume(o, a, b, c);
            volume.add_determinant(-1.0, a, b, c);
            volume.add_determinant(1.0, o, b, c);
            volume.add_determinant(1.0, a, o, c);
            volume.add_determinant(1.0, a, b, o);
            assert_eq!(volume.len, 0);
        }
        assert!(ways.iter().all(|&n| n > ROUNDS / 20), "{ways:?}");
    }
}
