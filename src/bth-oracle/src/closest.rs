//! The exact squared distance of a point to a closed triangle, by testing every part of it.

use crate::intersection::{Point, integer, sub};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::Signed;

fn dot(a: &Point, b: &Point) -> BigInt {
    (0..3).map(|k| &a[k] * &b[k]).sum()
}

fn cross(a: &Point, b: &Point) -> Point {
    let minor = |i: usize, j: usize| &a[i] * &b[j] - &a[j] * &b[i];
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// The squared distance of a point to a closed triangle. A triangle without area is the segment or
/// the point that it covers.
///
/// It is the smallest of the distances to the corners, to the edges for which the foot of the
/// perpendicular lies within the edge, and to the plane if the foot of the perpendicular lies
/// within the triangle. All coordinates must be finite.
pub fn squared_distance(point: [f32; 3], corners: [[f32; 3]; 3]) -> BigRational {
    let point = point.map(integer);
    // The corners relative to the point, in units of the smallest positive f32.
    let corners = corners.map(|p| sub(&p.map(integer), &point));
    let normal = cross(&sub(&corners[1], &corners[0]), &sub(&corners[2], &corners[0]));
    let mut candidates: Vec<BigRational> = corners.iter().map(|p| dot(p, p).into()).collect();
    let mut inside = normal.iter().any(|x| x.is_positive() || x.is_negative());
    for (p, q) in [(0, 1), (1, 2), (2, 0)] {
        let (p, q) = (&corners[p], &corners[q]);
        let (edge, area) = (sub(q, p), cross(p, q));
        if !dot(&edge, p).is_positive() && !dot(&edge, q).is_negative() && p != q {
            candidates.push(BigRational::new(dot(&area, &area), dot(&edge, &edge)));
        }
        inside &= !dot(&normal, &area).is_negative();
    }
    if inside {
        let volume = dot(&normal, &corners[0]);
        candidates.push(BigRational::new(&volume * &volume, dot(&normal, &normal)));
    }
    let unit: BigInt = BigInt::from(1) << 298;
    candidates.into_iter().min().expect("three corners") / BigRational::from(unit)
}

/// Returns true if a distance differs from the square root of `squared` by at most `units` units in
/// the last place of the distance.
pub fn is_root_within(squared: &BigRational, distance: f32, units: (u32, u32)) -> bool {
    let exact = |x: f32| BigRational::new(integer(x), BigInt::from(1) << 149);
    let unit =
        exact(f32::from_bits(1) * 2f32.powi((distance.to_bits() >> 23).saturating_sub(1).min(100) as i32));
    // The unit of numbers above 2^-49 exceeds the range of the product above.
    let unit =
        unit * BigRational::from(BigInt::from(1) << (distance.to_bits() >> 23).saturating_sub(101) as usize);
    let slack = unit * BigRational::new(units.0.into(), units.1.into());
    let (low, high) = (exact(distance) - &slack, exact(distance) + &slack);
    (low.is_negative() || &low * &low <= *squared) && *squared <= &high * &high
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_traits::ToPrimitive;

    #[test]
    fn distances_of_a_right_triangle_are_known() {
        let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        for (point, squared) in [
            ([1.0, 1.0, 3.0], 9.0),
            ([1.0, 1.0, 0.0], 0.0),
            ([-1.0, -2.0, 2.0], 9.0),
            ([1.0, -2.0, 1.0], 5.0),
            ([4.0, 4.0, 0.0], 8.0),
            ([7.0, 0.0, 4.0], 25.0),
            ([0.0, 9.0, 0.0], 25.0),
        ] {
            assert_eq!(squared_distance(point, corners).to_f64(), Some(squared), "{point:?}");
        }
        assert_eq!(
            squared_distance([2.0, 3.0, 0.0], [[0.0; 3], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0]]).to_f64(),
            Some(9.0)
        );
        assert_eq!(squared_distance([2.0, 3.0, 0.0], [[2.0, 0.0, 0.0]; 3]).to_f64(), Some(9.0));
    }

    #[test]
    fn roots_are_compared_in_units_in_the_last_place() {
        for x in [3.0f32, 1e-45, 1e-38, 1.5e-39, 1e30, f32::MAX] {
            let exact = BigRational::new(integer(x), BigInt::from(1) << 149);
            let squared = &exact * &exact;
            assert!(is_root_within(&squared, x, (0, 1)));
            assert!(is_root_within(&squared, x.next_down(), (1, 1)), "{x}");
            assert!(!is_root_within(&squared, x.next_down(), (99, 100)), "{x}");
        }
    }
}
