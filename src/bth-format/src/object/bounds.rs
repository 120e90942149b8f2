//! The bounds of an object in the shape that vector loads need.

use crate::layout::{Object, WIDENED_BOXES};

/// An axis-aligned box in object space, padded so that each corner is one load of four lanes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub struct ObjectBounds {
    /// Min x, y and z; the fourth number is 0.
    pub lower: [f32; 4],
    /// Max x, y and z; the fourth number is 0.
    pub upper: [f32; 4],
    /// Max absolute value of a coordinate of either corner.
    pub greatest: f32,
    /// How [`far_away`] the object is from the origin of its space; 0 where it is near.
    pub away: f32,
    /// What pads of boxes allow for besides the origin of a ray: the max |coordinate| of the
    /// object, or its size and a quarter of `away` where it is far away, or next to nothing where
    /// the file's boxes are widened.
    pub padded_in_f64: f32,
    /// The same when f32 prepares the ray: not less than `max` where that is not below
    /// [`GREATEST_IN_F32`].
    pub padded: f32,
    /// Upper bound of the distance (maximum norm) from a ray's f32 origin to the exact point at
    /// which it starts: 0 for rays whose origin is exact.
    pub origin_error: f32,
    /// What the reach of a ray grows by, so that bounds of rounding errors hold `origin_error` too.
    pub origin_reach: f32,
    /// Upper bound of how far corners in leaves are off along an axis, above 0: next to nothing
    /// but where they are rounded.
    pub corner_error: f32,
}

/// Half a unit in the last place of f32, relative.
const U: f32 = f32::EPSILON / 2.0;

/// Objects with widened boxes have max |coordinates| in this range, in which neither pads
/// underflow nor products of planes overflow.
pub const WIDENED_RANGE: std::ops::Range<f32> =
    1.0 / (1u64 << 60) as f32..(1u64 << 49) as f32 * (1u64 << 49) as f32;
/// From this max |coordinate| on, products of three coordinates could overflow f32, which then
/// prepares no rays.
pub const GREATEST_IN_F32: f32 = (1u64 << 40) as f32;
/// A box that is more than this many times its size away from the origin is far away.
const FAR: f32 = 8.0;
/// What pads of widened boxes allow for besides the origin of a ray. No rounding needs it; it keeps
/// pads far from denormal numbers, for rays from the origin of the object's space, too.
const LEAST_PADDED: f32 = 1.0 / ((1u64 << 50) as f32 * (1u64 << 50) as f32);

impl ObjectBounds {
    /// The bounds of an object, from its OBJECT row.
    pub fn new(object: &Object) -> ObjectBounds {
        let ([x, y, z], [to_x, to_y, to_z]) = (object.lower, object.upper);
        let greatest = greatest_of(&object.lower).max(greatest_of(&object.upper));
        let (mut away, mut padded_in_f64) = (0.0, greatest);
        if object.coordinates & WIDENED_BOXES != 0 && WIDENED_RANGE.contains(&greatest) {
            padded_in_f64 = LEAST_PADDED;
        } else if let Some(distance) = far_away(&object.lower, &object.upper) {
            away = distance;
            padded_in_f64 = size(&object.lower, &object.upper) + away / 4.0;
        }
        ObjectBounds {
            lower: [x, y, z, 0.0],
            upper: [to_x, to_y, to_z, 0.0],
            greatest,
            away,
            padded_in_f64,
            padded: if greatest < GREATEST_IN_F32 { padded_in_f64 } else { greatest },
            origin_error: 0.0,
            origin_reach: 0.0,
            corner_error: f32::MIN_POSITIVE,
        }
    }

    /// The bounds of an object whose corners in leaves are rounded to f32.
    pub(crate) fn with_rounded_corners(self) -> ObjectBounds {
        ObjectBounds { corner_error: self.greatest * (U * 1.01) + f32::MIN_POSITIVE, ..self }
    }

    /// The bounds for rays that start on the object's triangles, at points that are rounded to f32.
    ///
    /// A point lies within `max`, so rounding moves each coordinate by at most u·`max` (u
    /// = 2^-24), and by 2^-150 where it is denormal; its computation in f64 adds less than 2^-48 of
    /// that. Pads of boxes are 16u of what they allow for: an eighth of `max` covers it.
    /// Projected coordinates are off by 8u of the reach for their roundings; a moved origin moves
    /// them by twice `origin_error`, since slopes are at most 1: three tenths of `max` cover
    /// that.
    #[inline(always)]
    pub fn for_starts(&self) -> ObjectBounds {
        ObjectBounds {
            padded: self.padded + self.greatest / 8.0,
            padded_in_f64: self.padded_in_f64 + self.greatest / 8.0,
            origin_error: self.greatest * (U * 1.01) + 4.0 * f32::MIN_POSITIVE,
            origin_reach: self.greatest * 0.3,
            ..*self
        }
    }

    /// The bounds for rays of f32 that approximate lines: origins of max |coordinate| `farthest`
    /// and directions are rounded from numbers that are off by `origin_error` and, relative to the
    /// max |component| of the direction, by `direction_error`.
    ///
    /// No point of the object is farther than r = `farthest` + `max` from the origin along an axis.
    /// Let u = 2^-24. The origin is off by u·`farthest`. The reciprocals of the direction's
    /// components are off by 2u, which moves the planes of boxes by 2ur: with the origin, by 16u of
    /// three sixteenths of `farthest` and an eighth of `max`. Slopes are off by 2u: projected
    /// coordinates by 2ur, and by twice the error of the origin, together 8u of a half of
    /// `farthest` and a quarter of `max`. Depths are off by ur, because t is multiplied by the
    /// rounded direction, and by the error of the origin.
    #[inline(always)]
    pub fn for_lines(&self, farthest: f32, origin_error: f32, direction_error: f32) -> ObjectBounds {
        // An error of the direction moves points by at most r times as much; one of a corner is an
        // error of the origin for this corner.
        let off = origin_error + self.corner_error + direction_error * (farthest + self.greatest);
        let (of_u, greatest) = ((off * (1.01 / U)).min(f32::MAX / 16.0), self.greatest);
        let pad = 0.19 * farthest + 0.13 * greatest + 0.25 * of_u;
        ObjectBounds {
            padded: self.padded + pad,
            padded_in_f64: self.padded_in_f64 + pad,
            origin_error: (2.0 * farthest + greatest + 2.0 * of_u) * (U * 1.01) + 4.0 * f32::MIN_POSITIVE,
            origin_reach: 0.51 * farthest + 0.26 * greatest + 0.6 * of_u,
            ..*self
        }
    }

    /// The bounds for lines whose origins are near and whose errors are at most the rounding of a
    /// direction to f32. They hold most lines, and need not be computed for each.
    pub fn for_near_lines(&self) -> ObjectBounds {
        self.for_lines(self.near(), 0.0, U)
    }

    /// Twice the object's max |coordinate|: nearer origins are near.
    #[inline(always)]
    fn near(&self) -> f32 {
        2.0 * self.greatest
    }

    /// [`Self::for_lines`], or `None` where [`Self::for_near_lines`] hold for the lines.
    #[inline(always)]
    pub fn for_far_lines(
        &self,
        farthest: f32,
        origin_error: f32,
        direction_error: f32,
    ) -> Option<ObjectBounds> {
        let off = origin_error + direction_error * (farthest + self.greatest);
        let are_near = (farthest <= self.near()) & (off <= U * (self.near() + self.greatest));
        (!are_near).then(|| self.for_lines(farthest, origin_error, direction_error))
    }

    /// The cube around the origin that holds all points with coordinates of at most `max` in
    /// absolute value.
    pub fn around(greatest: f32) -> ObjectBounds {
        let [lower, upper] = [-greatest, greatest].map(|x| [x, x, x, 0.0]);
        ObjectBounds {
            lower,
            upper,
            greatest,
            padded_in_f64: greatest,
            padded: greatest,
            corner_error: f32::MIN_POSITIVE,
            ..ObjectBounds::default()
        }
    }

    /// Length of the longest side, rounded to `f32`.
    #[inline(always)]
    pub fn size(&self) -> f32 {
        size(&self.lower, &self.upper)
    }
}

/// How far away a box is from the origin, if that is much for its size: the max |coordinate|
/// of its point that is nearest to the origin. Distances from that point are then small next to
/// coordinates.
pub fn far_away(lower: &[f32; 3], upper: &[f32; 3]) -> Option<f32> {
    let nearest = |lower: f32, upper: f32| if lower > 0.0 { lower } else { upper.min(0.0) };
    let distance = greatest_of(&[0, 1, 2].map(|k| nearest(lower[k], upper[k])));
    (size(lower, upper) < distance / FAR && distance < GREATEST_IN_F32).then_some(distance)
}

/// Length of the longest side of a box, rounded to `f32`.
#[inline(always)]
fn size(lower: &[f32], upper: &[f32]) -> f32 {
    (0..3).fold(0.0, |size: f32, k| size.max(upper[k] - lower[k]))
}

/// Max absolute value of a coordinate.
fn greatest_of(point: &[f32; 3]) -> f32 {
    point.iter().fold(0.0, |greatest: f32, x| if x.abs() > greatest { x.abs() } else { greatest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerocopy::FromZeros;

    #[test]
    fn boxes_more_than_eight_times_their_size_away_are_far_away() {
        assert_eq!(far_away(&[9.0, -0.5, -0.5], &[10.0, 0.5, 0.5]), Some(9.0));
        assert_eq!(far_away(&[-10.0, 8.5, 0.0], &[-9.0, 9.5, 0.5]), Some(9.0));
        assert_eq!(far_away(&[8.0, 0.0, 0.0], &[9.0, 1.0, 1.0]), None);
        assert_eq!(far_away(&[-1.0; 3], &[1.0; 3]), None);
        assert_eq!(far_away(&[0.0; 3], &[0.0; 3]), None);
        assert_eq!(far_away(&[1e-40; 3], &[1e-40; 3]), Some(1e-40));
        assert_eq!(far_away(&[GREATEST_IN_F32; 3], &[GREATEST_IN_F32; 3]), None);
    }

    #[test]
    fn pads_of_far_objects_allow_for_their_size_and_a_quarter_of_their_distance() {
        let mut object =
            Object { lower: [96.0, -0.5, -0.5], upper: [97.0, 0.5, 0.5], ..Object::new_zeroed() };
        let bounds = ObjectBounds::new(&object);
        assert_eq!((bounds.padded, bounds.padded_in_f64, bounds.away), (25.0, 25.0, 96.0));
        object.coordinates = WIDENED_BOXES;
        let bounds = ObjectBounds::new(&object);
        assert_eq!((bounds.padded, bounds.padded_in_f64, bounds.away), (LEAST_PADDED, LEAST_PADDED, 0.0));
        let near = Object { lower: [-1.0; 3], upper: [2.0; 3], ..Object::new_zeroed() };
        let bounds = ObjectBounds::new(&near);
        assert_eq!((bounds.padded, bounds.padded_in_f64, bounds.away), (2.0, 2.0, 0.0));
    }
}
