//! The line of a ray, and the side of it on which points and edges lie: the predicates of walks
//! from cell to cell.
//!
//! Points are projected along the ray by the axis shear of Woop, Benthin and Wald ("Watertight
//! Ray/Triangle Intersection", JCGT 2013), in f64: the line becomes the origin of a plane. A sign
//! that rounding errors might change is reported as [`Sign::Uncertain`]. The intersection of lines
//! with triangles is decided exactly in [`super::exact`]; a line in the plane of a triangle misses
//! it.

use super::origin::{RoundedLine, RoundedOrigin};
use crate::rays::Ray;

/// Error up to which f64 values are taken: 2^-28, an eighth of the rounding of f32, relative to 1
/// for u and v and to itself for t. Where the error may be greater, t, u and v are computed from
/// exact sums.
pub(crate) const RATIO_ERROR: f64 = 1.0 / (1u64 << 28) as f64;

/// Upper bound of all t that cannot be distinguished from `t`: t is rounded to f32 before it is
/// compared with the ray's range, and it has a relative error of 2^-28 ([`RATIO_ERROR`]), so one of
/// two equal hits may appear nearer.
pub(crate) fn widened(t: f64) -> f64 {
    const SLACK: f64 = 1.0 / (1 << 23) as f64;
    const LEAST: f64 = f32::from_bits(1) as f64;
    t + (t.abs() * SLACK + LEAST)
}

/// 8u with u = 2^-53: bounds the error of a projected coordinate relative to the largest
/// |coordinate| of the point relative to the ray's origin; see [`Line::project`].
pub(crate) const F64_PROJECTION_ERROR: f64 = 1.0 / (1u64 << 50) as f64;

/// The line of a ray in the ray's space, with the constants of its projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) origin: [f64; 3],
    pub(crate) direction: [f64; 3],
    /// The two axes of the plane of projection, and the axis of the direction's largest
    /// |component|.
    pub(crate) axis: [usize; 3],
    /// Change of the plane's coordinates along the line per unit of depth.
    pub(crate) shear: [f64; 2],
    /// `1 / direction[axis[2]]`, the factor from depth to t.
    pub(crate) inverse_depth: f64,
    /// Bounds of the errors of `origin` and `direction`, as in [`RoundedLine`]; 0 where a ray of
    /// f32 holds the line.
    origin_error: f64,
    direction_error: f64,
}

/// A point projected along the line.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projected {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Coordinate along the third axis, relative to the ray's origin.
    pub(crate) depth: f64,
}

impl Projected {
    /// |x| + |y|.
    fn size(&self) -> f64 {
        self.x.abs() + self.y.abs()
    }
}

/// The sign of a value with rounding errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sign {
    Negative,
    /// The value lies within its error bound of 0.
    Uncertain,
    Positive,
}

/// Twice the signed area of the triangle (origin, p, q) in the plane of projection. Antisymmetric
/// in its arguments bit for bit, so two triangles get opposite signs for their shared edge.
fn cross(p: &Projected, q: &Projected) -> f64 {
    p.x * q.y - p.y * q.x
}

impl Line {
    /// None if the ray has no line, because a component is not finite or the direction is zero.
    pub(crate) fn new(ray: &Ray) -> Option<Line> {
        Line::of(&RoundedLine::of_ray(ray))
    }

    /// The line of a ray as f64 knows it; `None` as for [`Self::new`].
    pub(crate) fn of(line: &RoundedLine) -> Option<Line> {
        let &RoundedLine { origin: RoundedOrigin(origin, origin_error), direction, direction_error } = line;
        let finite = origin.iter().chain(&direction).all(|x| x.is_finite());
        let size = direction.map(f64::abs);
        let z = if size[0] > size[1] && size[0] > size[2] {
            0
        } else if size[1] > size[2] {
            1
        } else {
            2
        };
        if !finite || size[z] == 0.0 {
            return None;
        }
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            // Keeps the orientation: faces whose normal points along the ray are counterclockwise.
            std::mem::swap(&mut x, &mut y);
        }
        let inverse_depth = 1.0 / direction[z];
        Some(Line {
            origin,
            direction,
            axis: [x, y, z],
            shear: [direction[x] * inverse_depth, direction[y] * inverse_depth],
            inverse_depth,
            origin_error,
            direction_error,
        })
    }

    /// By how much a t, or a t no farther from 0, may be off because of the errors of the line.
    #[inline(always)]
    fn t_error(&self, t: f64) -> f64 {
        self.origin_error * self.inverse_depth.abs() + 4.0 * self.direction_error * t.abs()
    }

    /// The origin, rounded, and a bound of its error.
    pub(crate) fn rounded_origin(&self) -> RoundedOrigin {
        RoundedOrigin(self.origin, self.origin_error)
    }

    /// Projects a point. Let u = 2^-53 and R the largest |coordinate| of point - origin. The
    /// differences are off by uR, the shear by a factor of 1±2u, its product with the depth by one
    /// more rounding and by the depth's own uR, and |shear| <= 1: x and y are off by less than uR +
    /// 4uR + 2uR < 8uR.
    #[inline(always)]
    pub(crate) fn project(&self, point: [f32; 3]) -> Projected {
        let [x, y, z] = self.axis.map(|k| f64::from(point[k]) - self.origin[k]);
        Projected { x: x - self.shear[0] * z, y: y - self.shear[1] * z, depth: z }
    }

    /// Bound on the error of x and y of [`Self::project`] for a line without errors, for points
    /// whose distance from the origin in the maximum norm does not exceed `reach`.
    #[inline(always)]
    pub(crate) fn projection_error(reach: f64) -> f64 {
        F64_PROJECTION_ERROR * reach
    }

    /// The same for this line. An error of the origin moves x and y by at most twice that much,
    /// since slopes are at most 1; one of the direction changes slopes by at most three times as
    /// much.
    pub(crate) fn own_projection_error(&self, reach: f64) -> f64 {
        let reach = reach + self.origin_error;
        Line::projection_error(reach) + 2.0 * self.origin_error + 4.0 * self.direction_error * reach
    }

    /// Largest |coordinate| of any point of a box relative to the origin.
    pub(crate) fn reach_of_box(&self, lower: [f32; 3], upper: [f32; 3]) -> f64 {
        (0..3).fold(0.0, |reach: f64, k| {
            let (lo, hi) = (f64::from(lower[k]) - self.origin[k], f64::from(upper[k]) - self.origin[k]);
            reach.max(lo.abs()).max(hi.abs())
        })
    }

    /// Side of the line on which the edge p→q passes, given the error of the coordinates. The
    /// products are off by error·(sizes + error) because of the coordinates, and by less than the
    /// same amount because of the roundings of the products.
    #[inline(always)]
    pub(crate) fn side(p: &Projected, q: &Projected, error: f64) -> Sign {
        let value = cross(p, q);
        let bound = 2.0 * error * (p.size() + q.size() + error);
        if value > bound {
            Sign::Positive
        } else if value < -bound {
            Sign::Negative
        } else {
            Sign::Uncertain
        }
    }

    /// Smallest and largest t at which the line can cross a triangle with these corners.
    #[inline(always)]
    pub(crate) fn t_range(&self, corners: [&Projected; 3]) -> (f64, f64) {
        let t = corners.map(|p| p.depth * self.inverse_depth);
        let (least, greatest) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
        let off = self.t_error(least.abs().max(greatest.abs()));
        (least - off, greatest + off)
    }

    /// Returns true if the corners of a triangle that the line certainly crosses are clockwise
    /// about it.
    pub(crate) fn turns_clockwise([a, b, c]: [&Projected; 3]) -> bool {
        cross(b, c) + cross(c, a) + cross(a, b) < 0.0
    }

    /// Lower bound of the t at which the line crosses a triangle that it certainly crosses, given
    /// the error of the projected coordinates.
    pub(crate) fn t_before(&self, corners: [&Projected; 3], error: f64) -> f64 {
        let (depth, shift) = Self::depth_of_crossing(corners, error);
        let t = depth * self.inverse_depth;
        t - shift * self.inverse_depth.abs() - self.t_error(t)
    }

    /// The depth at which the line crosses a triangle that it certainly crosses, and a bound of its
    /// error.
    fn depth_of_crossing([a, b, c]: [&Projected; 3], error: f64) -> (f64, f64) {
        let weight = [cross(b, c), cross(c, a), cross(a, b)];
        let bound = 4.0 * error * (a.size() + b.size() + c.size() + error);
        let sum = weight[0] + weight[1] + weight[2];
        let depth = (weight[0] * a.depth + weight[1] * b.depth + weight[2] * c.depth) / sum;
        let farthest = a.depth.abs().max(b.depth.abs()).max(c.depth.abs());
        // The errors of the weights shift the depth within the range of depths. The roundings of
        // the sum above shift it by less than 2^-48 of the largest |depth|.
        let shift =
            2.0 * farthest * (4.0 * bound / (sum.abs() - 4.0 * bound).max(0.0)) + farthest * RATIO_ERROR;
        (depth, shift)
    }
}
