//! The exact squared distance of a point to a closed triangle, by testing every part of it.

use crate::number::{Coordinate, Number, cross, dot, exact, sub};
use num_rational::BigRational;
use num_traits::Signed;

/// The squared distance of a point to a closed triangle. A triangle without area is the segment or
/// the point that it covers.
///
/// It is the smallest of the distances to the corners, to the edges for which the foot of the
/// perpendicular lies within the edge, and to the plane if the foot of the perpendicular lies
/// within the triangle. All coordinates must be finite.
pub fn squared_distance<T: Coordinate>(point: [T; 3], corners: [[T; 3]; 3]) -> BigRational {
    let (point, one) = (exact(point), Number::from(1.0));
    // The corners relative to the point.
    let corners = corners.map(|p| sub(&exact(p), &point));
    let normal = cross(&sub(&corners[1], &corners[0]), &sub(&corners[2], &corners[0]));
    let mut candidates: Vec<BigRational> = corners.iter().map(|p| dot(p, p).over(&one)).collect();
    let mut inside = !normal.iter().all(Number::is_zero);
    for (p, q) in [(0, 1), (1, 2), (2, 0)] {
        let (p, q) = (&corners[p], &corners[q]);
        let (edge, area) = (sub(q, p), cross(p, q));
        if !dot(&edge, p).is_positive() && !dot(&edge, q).is_negative() && !edge.iter().all(Number::is_zero) {
            candidates.push(dot(&area, &area).over(&dot(&edge, &edge)));
        }
        inside &= !dot(&normal, &area).is_negative();
    }
    if inside {
        let volume = dot(&normal, &corners[0]);
        candidates.push((&volume * &volume).over(&dot(&normal, &normal)));
    }
    candidates.into_iter().min().expect("three corners")
}

/// Returns true if a distance differs from the square root of `squared` by at most `units` units in
/// the last place of the distance.
pub fn is_root_within(squared: &BigRational, distance: f32, units: (u32, u32)) -> bool {
    let unit = Number::power_of_two((distance.to_bits() >> 23).max(1) as i32 - 150);
    let slack = unit.over(&Number::from(1.0)) * BigRational::new(units.0.into(), units.1.into());
    let exact = BigRational::from_float(distance).expect("a finite number");
    let (low, high) = (&exact - &slack, &exact + &slack);
    (low.is_negative() || &low * &low <= *squared) && *squared <= &high * &high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::to_f64;

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
            assert_eq!(to_f64(&squared_distance(point, corners)), squared, "{point:?}");
        }
        assert_eq!(
            to_f64(&squared_distance([2.0, 3.0, 0.0], [[0.0; 3], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0]])),
            9.0
        );
        assert_eq!(to_f64(&squared_distance([2.0, 3.0, 0.0], [[2.0, 0.0, 0.0]; 3])), 9.0);
    }

    #[test]
    fn roots_are_compared_in_units_in_the_last_place() {
        for x in [3.0f32, 1e-45, 1e-38, 1.5e-39, 1e30, f32::MAX] {
            let exact = BigRational::from_float(x).unwrap();
            let squared = &exact * &exact;
            assert!(is_root_within(&squared, x, (0, 1)));
            assert!(is_root_within(&squared, x.next_down(), (1, 1)), "{x}");
            assert!(!is_root_within(&squared, x.next_down(), (99, 100)), "{x}");
        }
    }
}
