//! The bounds of an object in the shape that vector loads need.

use crate::layout::{Object, WIDENED_BOXES};

/// An axis-aligned box in object space, padded so that each corner is one load of four lanes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub struct ObjectBounds {
    /// Least x, y and z; the fourth number is 0.
    pub lower: [f32; 4],
    /// Greatest x, y and z; the fourth number is 0.
    pub upper: [f32; 4],
    /// Greatest absolute value of a coordinate of either corner.
    pub greatest: f32,
    /// What pads of boxes allow for besides the origin of a ray when f32 prepares it: `greatest`, or [`Self::padded_in_f64`] where that is below
    /// [`GREATEST_IN_F32`].
    pub padded: f32,
}

/// Objects with widened boxes have greatest |coordinates| in this range, in which neither pads underflow nor products of planes overflow.
pub const WIDENED_RANGE: std::ops::Range<f32> =
    1.0 / (1u64 << 60) as f32..(1u64 << 49) as f32 * (1u64 << 49) as f32;
/// From this greatest |coordinate| on, products of three coordinates could overflow f32, which then prepares no rays.
pub const GREATEST_IN_F32: f32 = (1u64 << 40) as f32;
/// What pads of widened boxes allow for besides the origin of a ray. No rounding needs it; it keeps pads far from denormal numbers, for rays
/// from the origin of the object's space, too.
const LEAST_PADDED: f32 = 1.0 / ((1u64 << 50) as f32 * (1u64 << 50) as f32);

impl ObjectBounds {
    /// The bounds of an object, from its OBJECT row.
    pub fn new(object: &Object) -> ObjectBounds {
        let ([x, y, z], [to_x, to_y, to_z]) = (object.lower, object.upper);
        let greatest = greatest_coordinate(object);
        let padded = if greatest < GREATEST_IN_F32 { padded(object, greatest) } else { greatest };
        ObjectBounds { lower: [x, y, z, 0.0], upper: [to_x, to_y, to_z, 0.0], greatest, padded }
    }

    /// What pads of boxes allow for besides the origin of a ray: the greatest |coordinate| of the object, or next to nothing where the file's
    /// boxes are widened.
    pub fn padded_in_f64(object: &Object) -> f32 {
        padded(object, greatest_coordinate(object))
    }

    /// The cube around the origin that holds all points with coordinates of at most `greatest` in absolute value.
    pub fn around(greatest: f32) -> ObjectBounds {
        let [lower, upper] = [-greatest, greatest].map(|x| [x, x, x, 0.0]);
        ObjectBounds { lower, upper, greatest, padded: greatest }
    }

    /// Length of the longest side, rounded to `f32`.
    #[inline(always)]
    pub fn size(&self) -> f32 {
        (0..3).fold(0.0, |m: f32, k| m.max(self.upper[k] - self.lower[k]))
    }
}

/// [`ObjectBounds::padded_in_f64`], given the greatest |coordinate|.
fn padded(object: &Object, greatest: f32) -> f32 {
    let is_widened = object.coordinates & WIDENED_BOXES != 0 && WIDENED_RANGE.contains(&greatest);
    if is_widened { LEAST_PADDED } else { greatest }
}

/// Greatest absolute value of a coordinate of either corner of an object's bounds.
fn greatest_coordinate(object: &Object) -> f32 {
    let corners = object.lower.iter().chain(&object.upper);
    corners.fold(0.0, |greatest: f32, x| if x.abs() > greatest { x.abs() } else { greatest })
}
