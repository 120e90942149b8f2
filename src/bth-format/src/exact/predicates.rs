//! Geometric predicates with exact signs: a floating-point filter in `f64`, and exact sums where it
//! does not decide.

use super::dyadic::{dyadic_cross, dyadic_difference, dyadic_dot, dyadic_vector};
use super::expansion::{Expansion, VOLUME_PARTS, two_product};
use std::cmp::Ordering;

/// Bounds the error of a volume relative to the sum of its products' sizes: each of the six has at
/// most 7 roundings (3 differences, 2 products, 2 sums) of half an epsilon.
const VOLUME_ERROR: f64 = 16.0 * f64::EPSILON;
/// The same for an area: each of the two products has three roundings, the difference one more.
const AREA_ERROR: f64 = 8.0 * f64::EPSILON;

/// On which side of the plane through a, b and c the point d lies: `Greater` where (b-a)x(c-a)
/// points to, `Equal` on the plane. Exact for finite points.
pub fn side(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> Ordering {
    let [a, b, c, d] = [a, b, c, d].map(|p| p.map(f64::from));
    certain_side([a, b, c], d).unwrap_or_else(|| side_by_volume([a, b, c], d))
}

/// The side for coordinates of f32 precision.
fn side_by_volume([a, b, c]: [[f64; 3]; 3], d: [f64; 3]) -> Ordering {
    let mut volume = Expansion::<VOLUME_PARTS>::new();
    volume.add_volume(d, a, b, c);
    // det[a-d, b-d, c-d] is positive behind the plane.
    0.0f64.total_cmp(&(volume.value() + 0.0))
}

/// [`side`] of the plane of a triangle, for coordinates that are 0 or in
/// [`EXACT_RANGE`](crate::object::EXACT_RANGE).
pub fn wide_side(triangle: [[f64; 3]; 3], d: [f64; 3]) -> Ordering {
    if triangle.contains(&d) {
        return Ordering::Equal;
    }
    let has_f32_precision = |p: &[f64; 3]| p.iter().all(|x| f64::from(*x as f32) == *x);
    certain_side(triangle, d).unwrap_or_else(|| {
        if triangle.iter().chain([&d]).all(has_f32_precision) {
            return side_by_volume(triangle, d);
        }
        let [a, b, c, d] = [triangle[0], triangle[1], triangle[2], d].map(dyadic_vector);
        let [u, v, w] = [b, c, d].map(|p| dyadic_difference(&p, &a));
        dyadic_dot(&dyadic_cross(&u, &v), &w).sign()
    })
}

/// The side, if f64 is certain of it.
fn certain_side([a, b, c]: [[f64; 3]; 3], d: [f64; 3]) -> Option<Ordering> {
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let minors = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| (u[i] * v[j], u[j] * v[i]));
    let det: f64 = (0..3).map(|k| (minors[k].0 - minors[k].1) * w[k]).sum();
    let size: f64 = (0..3).map(|k| (minors[k].0.abs() + minors[k].1.abs()) * w[k].abs()).sum();
    (det.abs() > VOLUME_ERROR * size).then(|| det.total_cmp(&0.0))
}

/// Returns true if a triangle has exactly zero area: whether its projections along the three axes
/// all have. Exact for finite corners in f32, and for corners in f64 whose coordinates are in
/// [`EXACT_RANGE`](crate::object::EXACT_RANGE) or 0.
pub fn is_zero_area<T: Into<f64> + Copy>(corners: [[T; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.map(T::into));
    [[0, 1], [1, 2], [2, 0]].into_iter().all(|[i, j]| {
        let (p, q) = ((b[i] - a[i]) * (c[j] - a[j]), (b[j] - a[j]) * (c[i] - a[i]));
        if (p - q).abs() > AREA_ERROR * (p.abs() + q.abs()) {
            return false;
        }
        let mut sum = Expansion::<12>::new();
        for [p, q] in [[a, b], [b, c], [c, a]] {
            for (product, error) in [two_product(p[i], q[j]), two_product(-p[j], q[i])] {
                sum.add(error);
                sum.add(product);
            }
        }
        sum.value() == 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn robust_side(corners: [[f64; 3]; 4]) -> Ordering {
        let [a, b, c, d] = corners.map(|[x, y, z]| robust::Coord3D { x, y, z });
        // Shewchuk's sign is positive where d lies below the plane.
        0.0f64.total_cmp(&(robust::orient3d(a, b, c, d) + 0.0))
    }

    /// Compares sides of these points, and of points that need more digits than f32 has.
    fn assert_sides([a, b, c, d]: [[f32; 3]; 4]) {
        let wide = |scale: f64| [a, b, c, d].map(|p| p.map(|x| f64::from(x) * scale));
        assert_eq!(side(a, b, c, d), robust_side(wide(1.0)));
        for [a, b, c, d] in [wide(1.0), wide(1.0 + f64::EPSILON * 4096.0)] {
            assert_eq!(wide_side([a, b, c], d), robust_side([a, b, c, d]));
        }
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
            assert_sides([a, b, c, d]);
        }

        #[test]
        fn side_of_nearly_coplanar_points_agrees_with_shewchuk(a in point(), b in point(), c in point(), s in 0f32..1.0, t in 0f32..1.0) {
            let d = [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * s + (c[k] - a[k]) * t);
            assert_sides([a, b, c, d]);
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
