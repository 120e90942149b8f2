//! Rays as real numbers.

use crate::intersection::{IDENTITY, Intersection, Line, Placed, to_f64};
use crate::number::{Coordinate, Number, Point, cross, dot, exact, sub};
use bth::rays::{PrimitiveRef, Ray, Ray64, StartRay};
use num_rational::BigRational;
use num_traits::Signed;

/// The weights of a hit, rounded to f32, have a sum of at most this.
const MAX_SUM: f32 = 1.0 + 1.0 / (1 << 22) as f32;

/// A ray of any precision: every f32 is an f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactRay {
    /// Where it begins.
    pub origin: RayOrigin,
    /// Its direction, in world space.
    pub direction: [f64; 3],
    /// The smallest and the largest t of a hit, as it is reported.
    pub range: [f64; 2],
    /// The precision of reported t.
    pub precision: Precision,
}

/// Where a ray begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayOrigin {
    /// A point of world space.
    Point([f64; 3]),
    /// The point of a triangle with these weights of its second and third corner. The ray hits what
    /// lies at t > 0.
    Start(PrimitiveRef, [f64; 2]),
}

/// The precision of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// f32, rounded from f64.
    Single,
    /// f64.
    Double,
}

impl From<Ray> for ExactRay {
    fn from(ray: Ray) -> ExactRay {
        let range = [ray.tmin, ray.tmax].map(f64::from);
        let origin = RayOrigin::Point(ray.origin.map(f64::from));
        ExactRay { origin, direction: ray.direction.map(f64::from), range, precision: Precision::Single }
    }
}

impl From<Ray64> for ExactRay {
    fn from(ray: Ray64) -> ExactRay {
        let Ray64 { origin, tmin, direction, tmax } = ray;
        let origin = RayOrigin::Point(origin);
        ExactRay { origin, direction, range: [tmin, tmax], precision: Precision::Double }
    }
}

impl From<StartRay> for ExactRay {
    fn from(ray: StartRay) -> ExactRay {
        let origin = RayOrigin::Start(ray.start.primitive, [ray.start.u, ray.start.v].map(f64::from));
        let range = [0.0, f64::from(ray.tmax)];
        ExactRay { origin, direction: ray.direction.map(f64::from), range, precision: Precision::Single }
    }
}

impl<'a, R: Copy + Into<ExactRay>> From<&'a R> for ExactRay {
    fn from(ray: &'a R) -> ExactRay {
        (*ray).into()
    }
}

impl ExactRay {
    /// A ray in f64 from a point, without an end.
    pub fn double(origin: [f64; 3], direction: [f64; 3]) -> ExactRay {
        let (origin, range) = (RayOrigin::Point(origin), [0.0, f64::INFINITY]);
        ExactRay { origin, direction, range, precision: Precision::Double }
    }

    /// The line of the ray, given its triangle if it begins on one. `None` if it has none: a number
    /// is not finite, the direction is zero, or it begins on no point of a triangle.
    pub(crate) fn line<'a>(&self, find: impl FnOnce(PrimitiveRef) -> Option<Placed<'a>>) -> Option<Line> {
        if !self.direction.iter().all(|x| x.is_finite()) || self.direction == [0.0; 3] {
            return None;
        }
        match self.origin {
            RayOrigin::Point(p) => p.iter().all(|x| x.is_finite()).then(|| Line::through(p, self.direction)),
            RayOrigin::Start(primitive, weights) => {
                Some(Line::new(start(&find(primitive)?.exact(), weights)?, self.direction))
            }
        }
    }

    /// Returns true if a hit counts: t, rounded as it is reported, lies within the range, and after
    /// a start.
    pub(crate) fn accepts(&self, t: &BigRational) -> bool {
        let wide = to_f64(t);
        let reported = match self.precision {
            Precision::Single => f64::from(wide as f32),
            Precision::Double => wide,
        };
        let [tmin, tmax] = self.range;
        tmin <= reported
            && reported <= tmax
            && reported.is_finite()
            && (!self.is_from_start() || t.is_positive())
    }

    pub(crate) fn is_from_start(&self) -> bool {
        matches!(self.origin, RayOrigin::Start(..))
    }
}

/// The point with the weights u and v of the corners a, b and c: a + u(b - a) + v(c - a), or (ub +
/// vc) / (u + v) where u + v is above 1. It is given as its product with a positive scale.
/// `None` if the weights are outside the triangle, or the triangle has no area.
pub(crate) fn start([a, b, c]: &[Point; 3], [u, v]: [f64; 2]) -> Option<(Point, Number)> {
    // Comparisons with NaN are false.
    if !(u >= 0.0 && v >= 0.0 && (u + v) as f32 <= MAX_SUM) {
        return None;
    }
    if cross(&sub(b, a), &sub(c, a)).iter().all(Number::is_zero) {
        return None;
    }
    let [one, u, v] = [1.0, u, v].map(Number::from);
    let sum = &u + &v;
    let first = &one - &sum;
    let (first, scale) = if first.is_negative() { (Number::from(0.0), sum) } else { (first, one) };
    let weigh = |k: usize| [(&first, &a[k]), (&u, &b[k]), (&v, &c[k])].map(|(w, x)| w * x).into_iter().sum();
    Some(([0, 1, 2].map(weigh), scale))
}

/// The intersection of the whole line of a ray from a point, in both directions and whatever its
/// range, with a closed triangle.
pub fn intersection<T: Coordinate>(ray: impl Into<ExactRay>, corners: [[T; 3]; 3]) -> Option<Intersection> {
    ray.into().line(|_| None)?.hit(&Placed::new(corners, &IDENTITY)).at()
}

/// Returns true if the direction of a ray and the normal (b-a)×(c-a) of a triangle point to
/// opposite sides, so that the ray comes from the side from which the corners appear
/// counter-clockwise. False if they are perpendicular.
pub fn is_front<T: Coordinate>(ray: impl Into<ExactRay>, corners: [[T; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(exact);
    dot(&exact(ray.into().direction), &cross(&sub(&b, &a), &sub(&c, &a))).is_negative()
}
