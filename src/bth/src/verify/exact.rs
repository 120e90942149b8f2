//! Signs that are right whatever the rounding.
//!
//! Determinants of points of `f32` are sums of products of three `f32`. Such a product is two `f64`
//! without error, and exponents stay far from the ends of `f64`, so the sum can be taken exactly by
//! Shewchuk's expansions (Adaptive Precision Floating-Point Arithmetic, 1997, GROW-EXPANSION).

use std::cmp::Ordering;

/// An exact sum of `f64`: components that do not overlap, ascending in magnitude.
#[derive(Default)]
struct Sum(Vec<f64>);

impl Sum {
    fn add(&mut self, value: f64) {
        let mut carry = value;
        let mut kept = 0;
        for i in 0..self.0.len() {
            let part = self.0[i];
            let sum = carry + part;
            let virtual_part = sum - carry;
            let error = (carry - (sum - virtual_part)) + (part - virtual_part);
            carry = sum;
            if error != 0.0 {
                self.0[kept] = error;
                kept += 1;
            }
        }
        self.0.truncate(kept);
        if carry != 0.0 {
            self.0.push(carry);
        }
    }
    /// Adds `sign * a * b * c` exactly: `a * b` has 48 bits, the product's rounding error is another `f64`.
    fn add_product(&mut self, sign: f64, a: f32, b: f32, c: f32) {
        let (ab, c) = (sign * a as f64 * b as f64, c as f64);
        let product = ab * c;
        self.add(ab.mul_add(c, -product));
        self.add(product);
    }
    fn sign(&self) -> Ordering {
        self.0.last().map_or(Ordering::Equal, |x| x.total_cmp(&0.0))
    }
}

/// On which side of the plane through a, b, c the point d lies: `Greater` where (b-a)x(c-a) points to,
/// `Equal` on the plane. Exact for finite points.
pub(crate) fn side(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> Ordering {
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] as f64 - a[k] as f64));
    let minors = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| (u[i] * v[j], u[j] * v[i]));
    let det: f64 = (0..3).map(|k| (minors[k].0 - minors[k].1) * w[k]).sum();
    let size: f64 = (0..3).map(|k| (minors[k].0.abs() + minors[k].1.abs()) * w[k].abs()).sum();
    // Each of the six products has at most 7 roundings (3 differences, 2 products, 2 sums); 16 is ample.
    if det.abs() > 16.0 * f64::EPSILON * size {
        return det.total_cmp(&0.0);
    }
    // The determinant of the rows (p, 1), expanded along the last column.
    let mut sum = Sum::default();
    for (sign, [p, q, r]) in [(1.0, [a, c, b]), (1.0, [a, b, d]), (-1.0, [a, c, d]), (1.0, [b, c, d])] {
        for (sign, [i, j, k]) in [
            (sign, [0, 1, 2]),
            (sign, [1, 2, 0]),
            (sign, [2, 0, 1]),
            (-sign, [0, 2, 1]),
            (-sign, [2, 1, 0]),
            (-sign, [1, 0, 2]),
        ] {
            sum.add_product(sign, p[i], q[j], r[k]);
        }
    }
    sum.sign()
}

/// Whether a triangle has exactly zero area: its projections along the axes all have.
pub(crate) fn is_zero_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].into_iter().all(|[i, j]| {
        let mut sum = Sum::default();
        for [p, q] in [[a, b], [b, c], [c, a]] {
            sum.add_product(1.0, p[i], q[j], 1.0);
            sum.add_product(-1.0, p[j], q[i], 1.0);
        }
        sum.sign() == Ordering::Equal
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn robust_side(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> Ordering {
        let [a, b, c, d] =
            [a, b, c, d].map(|p| robust::Coord3D { x: p[0] as f64, y: p[1] as f64, z: p[2] as f64 });
        // Shewchuk's sign is positive where d lies below the plane.
        0.0f64.total_cmp(&(robust::orient3d(a, b, c, d) + 0.0))
    }

    fn point() -> impl Strategy<Value = [f32; 3]> {
        let any = prop_oneof![
            -1e6f32..1e6,
            (-4i32..4).prop_map(|x| x as f32),
            -1e-20f32..1e-20,
            Just(0.1),
            Just(-0.0)
        ];
        [any.clone(), any.clone(), any]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn side_agrees_with_shewchuk(a in point(), b in point(), c in point(), d in point()) {
            prop_assert_eq!(side(a, b, c, d), robust_side(a, b, c, d));
        }

        #[test]
        fn side_of_nearly_coplanar_points_agrees_with_shewchuk(a in point(), b in point(), c in point(), s in 0f32..1.0, t in 0f32..1.0) {
            let d = [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * s + (c[k] - a[k]) * t);
            prop_assert_eq!(side(a, b, c, d), robust_side(a, b, c, d));
        }
    }

    #[test]
    fn ends_of_the_range_are_exact() {
        let (tiny, huge) = (f32::from_bits(1), f32::MAX);
        let o = [0.0; 3];
        assert_eq!(side(o, [huge, 0.0, 0.0], [0.0, huge, 0.0], [0.0, 0.0, huge]), Ordering::Greater);
        assert_eq!(side(o, [tiny, 0.0, 0.0], [0.0, tiny, 0.0], [0.0, 0.0, -tiny]), Ordering::Less);
        assert_eq!(side([huge; 3], [-huge; 3], [huge, -huge, huge], [tiny, tiny, tiny]), Ordering::Equal);
        assert_eq!(
            side([huge; 3], [-huge; 3], [huge, -huge, huge], [tiny, 0.0, 0.0]),
            side([1.0; 3], [-1.0; 3], [1.0, -1.0, 1.0], [1e-3, 0.0, 0.0])
        );
    }

    #[test]
    fn zero_area_is_exact() {
        assert!(is_zero_area([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [0.4, 0.4, 0.4]]));
        assert!(is_zero_area([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0], [4.0, 5.0, 7.0]]));
        assert!(!is_zero_area([[0.0; 3], [1.0, 3.0, 0.0], [1.0 / 3.0, 1.0, 0.0]]), "a third is not an f32");
        assert!(!is_zero_area([[0.0; 3], [f32::from_bits(1), 0.0, 0.0], [0.0, f32::from_bits(1), 0.0]]));
    }
}
