//! Rays and segments between points of triangles, which are given as rows of a list.

use crate::intersection::{Intersection, hit};
use crate::nearest::row;
use crate::number::{Coordinate, Number, Point, exact, sub};
use crate::ray::{ExactRay, start};
use bth::SegmentEnd;
use num_rational::BigRational;
use num_traits::Signed;

/// The intersection of a ray from a start with a triangle, a row of `corners`, at t > 0 and
/// whatever its end.
pub fn intersection<T: Coordinate>(
    corners: &[[[T; 3]; 3]],
    ray: impl Into<ExactRay>,
    triangle: u32,
) -> Option<Intersection> {
    let line = ray.into().line(|primitive| row(corners, primitive.triangle))?;
    line.hit(&row(corners, triangle)?).at().filter(|at| at.t.is_positive())
}

/// An end of a segment times a positive scale.
fn end<T: Coordinate>(corners: &[[[T; 3]; 3]], end: SegmentEnd) -> Option<(Point, Number)> {
    match end {
        SegmentEnd::Point(point) => Some((exact(point), Number::from(1.0))),
        SegmentEnd::Start(of) => {
            start(&row(corners, of.primitive.triangle)?.exact(), [of.u, of.v].map(f64::from))
        }
    }
}

/// Returns true if no triangle crosses the open segment between two points. Both must exist.
pub fn visible<T: Coordinate>(corners: &[[[T; 3]; 3]], a: SegmentEnd, b: SegmentEnd) -> bool {
    let (Some((a, of_a)), Some((b, of_b))) = (end(corners, a), end(corners, b)) else { return false };
    let scaled = |p: &Point, by: &Number| p.each_ref().map(|x| x * by);
    let (from, to, both) = (scaled(&a, &of_b), scaled(&b, &of_a), &of_a * &of_b);
    let (direction, one) = (sub(&to, &from), BigRational::from_integer(1.into()));
    !corners.iter().any(|of| {
        let of = of.map(|p| sub(&scaled(&exact(p), &both), &from));
        hit(&of, &direction, &Number::from(1.0)).at().is_some_and(|at| at.t.is_positive() && at.t < one)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersection::to_f64;
    use crate::nearest::{all_hits, any, nearest};
    use crate::ray::{Precision, RayOrigin};
    use crate::{crossings, number::Number};
    use bth::rays::{PrimitiveRef, Start, StartRay};

    fn of(triangle: u32) -> PrimitiveRef {
        PrimitiveRef { instance: 0, triangle }
    }

    fn ray(triangle: u32, [u, v]: [f32; 2], direction: [f32; 3]) -> StartRay {
        Start { primitive: of(triangle), u, v }.ray(direction)
    }

    const FLOOR: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    fn above(height: f32) -> [[f32; 3]; 3] {
        FLOOR.map(|[x, y, z]| [x, y, z + height])
    }

    #[test]
    fn the_start_is_the_exact_point_and_is_not_hit() {
        let corners = [FLOOR, above(f32::from_bits(1)), FLOOR];
        let third = 1.0f32 / 3.0;
        let hit = nearest(&corners, ray(0, [third, third], [0.0, 0.0, 0.5])).unwrap();
        assert_eq!(hit.triangles, [1]);
        assert_eq!(hit.at.t, Number::power_of_two(-148).over(&Number::from(1.0)));
        assert_eq!(hit.at.u, BigRational::from_float(third).unwrap());
        assert!(!any(&corners, ray(0, [third, third], [0.0, 0.0, -1.0])));
        assert_eq!(crossings(&corners, ray(2, [0.0, 0.5], [0.0, 0.0, 1.0])).count, 1);
        assert_eq!(all_hits(&corners, ray(1, [0.0, 0.0], [0.0, 0.0, -1.0])).len(), 2);
    }

    #[test]
    fn starts_and_triangles_in_f64_are_not_rounded_to_f32() {
        let far = |height: f64| FLOOR.map(|[x, y, _]| [5.5e6 + f64::from(x), f64::from(y), 300.0 + height]);
        let corners = [far(0.0), far(2f64.powi(-40))];
        let direction = [0.0, 0.0, 1.0];
        let weights = [1.0 / 3.0, 0.1];
        let up =
            ExactRay { origin: RayOrigin::Start(of(0), weights), ..ExactRay::double([0.0; 3], direction) };
        let hit = nearest(&corners, up).unwrap();
        assert_eq!((hit.t_f64(), hit.triangles), (2f64.powi(-40), vec![1]));
        assert_eq!([&hit.at.u, &hit.at.v].map(to_f64), weights);
        let third = hit.at.u;
        assert_eq!(third, BigRational::from_float(1.0 / 3.0f64).unwrap());
        assert!(!any(&corners, ExactRay { range: [0.0, 2f64.powi(-41)], ..up }));
        // f32 has no number between 1 and 1 + 2^-23.
        let beyond = ExactRay { range: [0.0, 1.0], ..ExactRay::double([5.5e6, 1.0, 299.0], direction) };
        assert_eq!(all_hits(&corners, beyond).len(), 1);
        assert_eq!(all_hits(&corners, ExactRay { precision: Precision::Single, ..beyond }).len(), 2);
        // On the edge from b to c.
        let over = RayOrigin::Start(of(0), [1.0, f64::from_bits(1)]);
        assert!(any(&corners, ExactRay { origin: over, ..up }));
    }

    #[test]
    fn starts_with_weights_above_one_lie_on_the_edge() {
        let wall = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [3.0, 3.0, 0.0]];
        // The line from the edge's point, about (1, 2, 0), towards (-1, -2, 0).
        let u = (1.0f32 / 3.0).next_up();
        let corners = [FLOOR, wall];
        let hit = nearest(&corners, ray(0, [u, 1.0 - u], [-1.0, -1.0, 0.0]));
        let over = nearest(&corners, ray(0, [u, (1.0 - u).next_up()], [-1.0, 1.0, 0.0]));
        assert!(hit.is_none());
        assert!(over.is_some_and(|hit| hit.at.t.is_positive()) || u < 0.5);
        let weights = [u, (1.0 - u).next_up()].map(f64::from);
        let (point, scale) = start(&FLOOR.map(exact), weights).unwrap();
        assert!((&(&point[0] + &point[1]) - &(&Number::from(3.0) * &scale)).is_zero());
    }

    #[test]
    fn what_is_no_start_hits_nothing() {
        let corners = [FLOOR, above(1.0), [[0.0; 3], [1.0; 3], [2.0; 3]]];
        let up = [0.0, 0.0, 1.0];
        assert!(any(&corners, ray(0, [0.25, 0.25], up)));
        for bad in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
            assert!(!any(&corners, ray(0, [bad, 0.0], up)) && !any(&corners, ray(0, [0.0, bad], up)));
        }
        assert!(!any(&corners, ray(2, [0.25, 0.25], up)) && !any(&corners, ray(3, [0.25, 0.25], up)));
        assert!(!any(&corners, ray(0, [0.25, 0.25], up).with_tmax(0.5)));
        assert!(!any(&corners, ray(0, [0.25, 0.25], up).with_tmax(f32::NAN)));
        assert!(!any(&corners, ray(0, [0.25, 0.25], [0.0; 3])));
    }
}
