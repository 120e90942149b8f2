//! Origins and lines of rays in f64, as far as they are known there.

use super::vector::{max_norm, minus, wide};
use crate::rays::Ray;
use bth_format::object::{ObjectBounds, ObjectView};

/// The origin of a ray in f64, as far as it is known there.
pub(crate) trait Origin: Copy {
    fn point(self) -> [f64; 3];
    /// Adds to bounds of the errors of weights, for a direction whose max |component| is 1, and of
    /// the volume what the error of the ray adds. No edge of the triangle has a component larger
    /// than `edge`, and its first corner lies within `distance` of the origin along each axis.
    fn enlarge(self, error: [f64; 2], edge: f64, distance: f64) -> [f64; 2];
}

/// An origin that f64 holds exactly, of a ray whose direction it holds exactly, too.
impl Origin for [f64; 3] {
    #[inline(always)]
    fn point(self) -> [f64; 3] {
        self
    }
    #[inline(always)]
    fn enlarge(self, error: [f64; 2], _edge: f64, _distance: f64) -> [f64; 2] {
        error
    }
}

/// An origin that was rounded to f64, and a bound of the error of its coordinates. The direction is
/// exact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedOrigin(pub(crate) [f64; 3], pub(crate) f64);

impl Origin for RoundedOrigin {
    #[inline(always)]
    fn point(self) -> [f64; 3] {
        self.0
    }
    /// An error e of each coordinate changes a weight of the second or the third corner, a
    /// determinant of the direction, an edge and the origin, by at most 6Dme; the weight of the
    /// first by the sum of both changes, 12Dme; and the volume by 6m²e.
    #[inline(always)]
    fn enlarge(self, [weight, volume]: [f64; 2], edge: f64, _distance: f64) -> [f64; 2] {
        [weight + self.1 * (16.0 * edge), volume + self.1 * (8.0 * (edge * edge))]
    }
}

/// A line that was rounded to f64: in world space, or in the space of an object's source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundedLine {
    pub(crate) origin: RoundedOrigin,
    pub(crate) direction: [f64; 3],
    /// Bound of the error of the direction's components, relative to the largest |component|.
    pub(crate) direction_error: f64,
}

impl Origin for RoundedLine {
    #[inline(always)]
    fn point(self) -> [f64; 3] {
        self.origin.0
    }
    /// An error of δD of each component of the direction changes the determinant by at most 6δDm²,
    /// the weights of the second and the third corner by 6δDmr and the weight of the first by
    /// 12δDm(m+r), where r is the distance from the true origin.
    #[inline(always)]
    fn enlarge(self, error: [f64; 2], edge: f64, distance: f64) -> [f64; 2] {
        let [weight, volume] = self.origin.enlarge(error, edge, distance);
        let reach = edge + distance + self.origin.1;
        [weight + self.direction_error * (16.0 * edge * reach), volume]
    }
}

/// Components beyond this range could make products overflow or underflow in f64.
const SAFE: std::ops::Range<f64> = 1.0 / POWER..POWER;
/// 2^300.
const POWER: f64 = f64::from_bits((1023 + 300) << 52);

/// 2^-24: the relative rounding of a number to f32.
pub(crate) const ROUNDED_TO_F32: f64 = 1.0 / (1u64 << 24) as f64;

impl RoundedLine {
    /// The line of a ray of f32.
    #[inline(always)]
    pub(crate) fn of_ray(ray: &Ray) -> RoundedLine {
        RoundedLine {
            origin: RoundedOrigin(wide(ray.origin), 0.0),
            direction: wide(ray.direction),
            direction_error: 0.0,
        }
    }

    /// The same line with a direction that is a power of two times as long.
    pub(crate) fn with_direction_times(mut self, factor: f64) -> RoundedLine {
        self.direction = self.direction.map(|x| x * factor);
        self
    }

    /// The same line with the error that a range of t rounded to f32 has.
    pub(crate) fn with_rounded_range(mut self) -> RoundedLine {
        self.direction_error += ROUNDED_TO_F32;
        self
    }

    /// The bounds for which the ray of f32 is prepared that approximates this line in the space of
    /// an object.
    #[inline(always)]
    pub(crate) fn bounds(&self, object: &ObjectView<'_>) -> ObjectBounds {
        let farthest = max_norm(self.relative_to(object.anchor));
        object.bounds.for_lines(farthest as f32, self.origin.1 as f32, self.direction_error as f32)
    }

    /// The origin relative to the origin of an object's space in the space of its source.
    #[inline(always)]
    pub(crate) fn relative_to(&self, anchor: [f64; 3]) -> [f64; 3] {
        minus(self.origin.0, anchor)
    }

    /// The same line; f64 decides nothing about it where products could leave its range.
    #[inline(always)]
    pub(crate) fn or_unknown(mut self) -> RoundedLine {
        let is_safe = max_norm(self.origin.0) < POWER && SAFE.contains(&max_norm(self.direction));
        self.origin.1 = if is_safe { self.origin.1 } else { f64::INFINITY };
        self
    }
}
