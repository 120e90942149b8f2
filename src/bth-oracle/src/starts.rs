//! Rays that start on triangles: their exact starts, hits and crossings, by testing every triangle.
//!
//! The start with weights u and v of the corners a, b and c is a + u(b - a) + v(c - a), or (ub +
//! vc) / (u + v) where u + v is above 1. It is held as integers over one positive integer, the
//! scale. Multiplying all coordinates by the scale changes neither t nor weights.

use crate::intersection::{
    Intersection, Point, certainly_missed, determinant, integer, intersect_exactly, sub, to_f64,
};
use crate::nearest::{ExactHit, nearest_of};
use bth::Crossings;
use bth::SegmentEnd;
use bth::rays::{Ray, Start, StartRay};
use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, Zero};

/// The weights of a hit, rounded to f32, have a sum of at most this.
const GREATEST_SUM: f32 = 1.0 + 1.0 / (1 << 22) as f32;

/// A start: a point whose coordinates are these integers divided by `scale`, in the unit of the
/// corners.
#[derive(Clone, Debug)]
pub(crate) struct ExactStart {
    point: Point,
    scale: BigInt,
}

impl ExactStart {
    /// Returns `None` if the weights are outside the triangle, or the triangle has no area.
    pub(crate) fn new([a, b, c]: &[Point; 3], u: f32, v: f32) -> Option<ExactStart> {
        // Comparisons with NaN are false.
        if !(u >= 0.0 && v >= 0.0 && u + v <= GREATEST_SUM) {
            return None;
        }
        let (p, q) = (sub(b, a), sub(c, a));
        if (0..3).all(|i| (&p[i] * &q[(i + 1) % 3] - &p[(i + 1) % 3] * &q[i]).is_zero()) {
            return None;
        }
        let (one, u, v) = (BigInt::from(1) << 149u32, integer(u), integer(v));
        let first: BigInt = &one - &u - &v;
        if first.is_negative() {
            let point = [0, 1, 2].map(|k| &u * &b[k] + &v * &c[k]);
            return Some(ExactStart { point, scale: u + v });
        }
        let point = [0, 1, 2].map(|k| &first * &a[k] + &u * &b[k] + &v * &c[k]);
        Some(ExactStart { point, scale: one })
    }

    /// The coordinates, rounded to f64, given how many of their units are 1.
    pub(crate) fn rounded(&self, one: &BigInt) -> [f64; 3] {
        [0, 1, 2].map(|k| to_f64(&BigRational::new(self.point[k].clone(), &self.scale * one)))
    }

    /// The intersection at t > 0 of the ray in a direction with a closed triangle, all in one unit.
    pub(crate) fn intersection(&self, direction: &Point, corners: &[Point; 3]) -> Option<Intersection> {
        let scaled = |p: &Point| -> Point { [0, 1, 2].map(|k| &p[k] * &self.scale) };
        let corners = [0, 1, 2].map(|i| scaled(&corners[i]));
        intersect_exactly(&self.point, &scaled(direction), &corners).filter(|at| at.t.is_positive())
    }
}

/// Returns true if a ray has a direction.
pub(crate) fn has_direction(ray: &StartRay) -> bool {
    ray.direction.iter().all(|x| x.is_finite()) && ray.direction != [0.0; 3]
}

/// The range of a ray from a start: what t may be once it is rounded.
pub(crate) fn range(ray: &StartRay) -> Ray {
    Ray::new([0.0; 3], ray.direction).with_range(0.0, ray.tmax)
}

/// A ray from a point of a triangle of a list.
struct FromStart<'a> {
    corners: &'a [[[f32; 3]; 3]],
    direction: [f32; 3],
    start: ExactStart,
    /// The start in f64, and the max absolute coordinate of its triangle.
    rounded: [f64; 3],
    greatest: f64,
}

impl<'a> FromStart<'a> {
    /// `None` if the ray has no direction, or no start on any of the triangles.
    fn new(corners: &'a [[[f32; 3]; 3]], ray: &StartRay) -> Option<FromStart<'a>> {
        let of = corners.get(ray.start.primitive.triangle as usize)?;
        let start = ExactStart::new(&of.map(|p| p.map(integer)), ray.start.u, ray.start.v)?;
        let rounded = start.rounded(&(BigInt::from(1) << 149u32));
        let greatest = of.iter().flatten().fold(0.0, |most: f64, x| most.max(f64::from(x.abs())));
        has_direction(ray).then_some(FromStart {
            corners,
            direction: ray.direction,
            start,
            rounded,
            greatest,
        })
    }

    /// The intersection with a triangle at t > 0.
    fn intersection(&self, triangle: usize) -> Option<Intersection> {
        let corners = self.corners[triangle];
        let from = corners.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - self.rounded[k]));
        if certainly_missed(self.direction.map(f64::from), from, 2.0 * self.greatest) {
            return None;
        }
        self.start.intersection(&self.direction.map(integer), &corners.map(|p| p.map(integer)))
    }

    fn intersections(&self) -> impl Iterator<Item = (u32, Intersection)> + '_ {
        (0..self.corners.len()).filter_map(|id| Some((id as u32, self.intersection(id)?)))
    }
}

/// The intersection of a ray from a start with a triangle, a row of `corners`, at t > 0 and
/// whatever its end.
pub fn intersection(corners: &[[[f32; 3]; 3]], ray: &StartRay, triangle: u32) -> Option<Intersection> {
    FromStart::new(corners, ray)?.intersection(triangle as usize)
}

/// The nearest exact hit at t > 0 whose t, rounded to f32 as it is reported, is not above the ray's
/// end. Triangles are rows of `corners`, also the triangle of the start.
pub fn nearest(corners: &[[[f32; 3]; 3]], ray: &StartRay) -> Option<ExactHit> {
    nearest_of(&range(ray), FromStart::new(corners, ray)?.intersections())
}

/// An end of a segment, exactly; a point has the scale 1.
fn end(corners: &[[[f32; 3]; 3]], end: SegmentEnd) -> Option<ExactStart> {
    match end {
        SegmentEnd::Point(point) => Some(ExactStart { point: point.map(integer), scale: BigInt::from(1) }),
        SegmentEnd::Start(Start { primitive, u, v }) => {
            let of = corners.get(primitive.triangle as usize)?;
            ExactStart::new(&of.map(|p| p.map(integer)), u, v)
        }
    }
}

/// Returns true if no triangle crosses the open segment between two points. Both must exist.
pub fn visible(corners: &[[[f32; 3]; 3]], a: SegmentEnd, b: SegmentEnd) -> bool {
    let (Some(a), Some(b)) = (end(corners, a), end(corners, b)) else { return false };
    let scaled = |p: &Point, by: &BigInt| -> Point { [0, 1, 2].map(|k| &p[k] * by) };
    let (from, to, both) = (scaled(&a.point, &b.scale), scaled(&b.point, &a.scale), &a.scale * &b.scale);
    let direction = sub(&to, &from);
    let one = BigRational::from(BigInt::from(1));
    !corners.iter().any(|of| {
        let of = of.map(|p| scaled(&p.map(integer), &both));
        let at = intersect_exactly(&from, &direction, &of);
        at.is_some_and(|at| at.t.is_positive() && at.t < one)
    })
}

/// Returns true if any triangle is hit.
pub fn any(corners: &[[[f32; 3]; 3]], ray: &StartRay) -> bool {
    let Some(from) = FromStart::new(corners, ray) else { return false };
    from.intersections().any(|found| nearest_of(&range(ray), std::iter::once(found)).is_some())
}

/// All hits, by ascending t and then triangle.
pub fn all_hits(corners: &[[[f32; 3]; 3]], ray: &StartRay) -> Vec<(u32, Intersection)> {
    let Some(from) = FromStart::new(corners, ray) else { return Vec::new() };
    let in_range =
        |found: &(u32, Intersection)| nearest_of(&range(ray), std::iter::once(found.clone())).is_some();
    let mut hits: Vec<_> = from.intersections().filter(in_range).collect();
    hits.sort_by(|(a, at_a), (b, at_b)| at_a.t.cmp(&at_b.t).then(a.cmp(b)));
    hits
}

/// Binary digits by which the three components of the movement of an origin differ, for coordinates
/// that are multiplied by a scale below 2^151; see [`mod@crate::crossing`].
const BITS: u32 = 1400;

/// The crossings of triangles by a ray from a start, by the rule of the runtime: the moved line
/// crosses the triangle, and the line through the start itself crosses its plane at t > 0.
pub fn crossings(corners: &[[[f32; 3]; 3]], ray: &StartRay) -> Crossings {
    let mut found = Crossings::default();
    let Some(from) = FromStart::new(corners, ray) else { return found };
    if ray.tmax.is_nan() {
        return found;
    }
    let ExactStart { point, scale } = &from.start;
    let mut moved: Point = [0, 1, 2].map(|k| &point[k] << (3 * BITS));
    for (k, x) in moved.iter_mut().enumerate() {
        *x += BigInt::from(1) << ((2 - k as u32) * BITS);
    }
    let direction = from.direction.map(integer);
    for triangle in corners {
        let relative = triangle.map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - from.rounded[k]));
        if certainly_missed(from.direction.map(f64::from), relative, 2.0 * from.greatest) {
            continue;
        }
        let scaled = triangle.map(|p| -> Point { p.map(|x| integer(x) * scale) });
        let [a, b, c] = [0, 1, 2].map(|i| {
            let fine: Point = [0, 1, 2].map(|k| &scaled[i][k] << (3 * BITS));
            sub(&fine, &moved)
        });
        let sides = [
            determinant(&direction, &b, &c),
            determinant(&direction, &c, &a),
            determinant(&direction, &a, &b),
        ];
        let sign = match () {
            () if sides.iter().all(BigInt::is_positive) => 1,
            () if sides.iter().all(BigInt::is_negative) => -1,
            () => continue,
        };
        let [p, q, r] = [0, 1, 2].map(|i| sub(&scaled[i], point));
        let ahead: BigInt = determinant(&p, &q, &r) * sign;
        // t = volume / whole, in units of 2^-3BITS / scale.
        let (volume, whole): (BigInt, BigInt) = (determinant(&a, &b, &c), sides.iter().sum());
        let is_beyond = match ray.tmax.is_infinite() {
            true => ray.tmax < 0.0,
            false => {
                let end: BigInt = (integer(ray.tmax) * whole * scale) << (3 * BITS);
                let difference: BigInt = ((volume << 149u32) - end) * sign;
                difference.is_positive()
            }
        };
        if ahead.is_positive() && !is_beyond {
            found.count += 1;
            found.winding += sign;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth::rays::{PrimitiveRef, Start};

    fn ray(triangle: u32, [u, v]: [f32; 2], direction: [f32; 3]) -> StartRay {
        Start { primitive: PrimitiveRef { instance: 0, triangle }, u, v }.ray(direction)
    }

    const FLOOR: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    fn above(height: f32) -> [[f32; 3]; 3] {
        FLOOR.map(|[x, y, z]| [x, y, z + height])
    }

    #[test]
    fn the_start_is_the_exact_point_and_is_not_hit() {
        let corners = [FLOOR, above(f32::from_bits(1)), FLOOR];
        let third = 1.0f32 / 3.0;
        let hit = nearest(&corners, &ray(0, [third, third], [0.0, 0.0, 0.5])).unwrap();
        assert_eq!(hit.triangles, [1]);
        assert_eq!(hit.at.t, BigRational::new(BigInt::from(1), BigInt::from(1) << 148u32));
        assert_eq!(hit.at.u, BigRational::new(integer(third), BigInt::from(1) << 149u32));
        assert!(!any(&corners, &ray(0, [third, third], [0.0, 0.0, -1.0])));
        assert_eq!(crossings(&corners, &ray(2, [0.0, 0.5], [0.0, 0.0, 1.0])).count, 1);
        assert_eq!(all_hits(&corners, &ray(1, [0.0, 0.0], [0.0, 0.0, -1.0])).len(), 2);
    }

    #[test]
    fn starts_with_weights_above_one_lie_on_the_edge() {
        let wall = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [3.0, 3.0, 0.0]];
        // The line from the edge's point, about (1, 2, 0), towards (-1, -2, 0).
        let u = (1.0f32 / 3.0).next_up();
        let corners = [FLOOR, wall];
        let hit = nearest(&corners, &ray(0, [u, 1.0 - u], [-1.0, -1.0, 0.0]));
        let over = nearest(&corners, &ray(0, [u, (1.0 - u).next_up()], [-1.0, 1.0, 0.0]));
        assert!(hit.is_none());
        assert!(over.is_some_and(|hit| hit.at.t.is_positive()) || u < 0.5);
        let start = ExactStart::new(&FLOOR.map(|p| p.map(integer)), u, (1.0 - u).next_up()).unwrap();
        let three: BigInt = integer(3.0) * &start.scale;
        assert_eq!(&start.point[0] + &start.point[1], three);
    }

    #[test]
    fn what_is_no_start_hits_nothing() {
        let corners = [FLOOR, above(1.0), [[0.0; 3], [1.0; 3], [2.0; 3]]];
        let up = [0.0, 0.0, 1.0];
        assert!(any(&corners, &ray(0, [0.25, 0.25], up)));
        for bad in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
            assert!(!any(&corners, &ray(0, [bad, 0.0], up)) && !any(&corners, &ray(0, [0.0, bad], up)));
        }
        assert!(!any(&corners, &ray(2, [0.25, 0.25], up)) && !any(&corners, &ray(3, [0.25, 0.25], up)));
        assert!(!any(&corners, &ray(0, [0.25, 0.25], up).with_tmax(0.5)));
        assert!(!any(&corners, &ray(0, [0.25, 0.25], up).with_tmax(f32::NAN)));
        assert!(!any(&corners, &ray(0, [0.25, 0.25], [0.0; 3])));
    }
}
