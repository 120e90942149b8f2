//! The bounds of an object in the shape that vector loads need.

use crate::layout::{BOX_MARGIN, Object, WIDENED_BOXES};

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
    /// What pads of boxes allow for besides the origin of a ray: `greatest`, or a small part of it where the file's boxes are widened.
    pub padded: f32,
}

/// Objects with widened boxes have greatest |coordinates| in this range, in which neither pads underflow nor products overflow.
pub const WIDENED_RANGE: std::ops::Range<f32> = 1.0 / (1u64 << 60) as f32..(1u64 << 40) as f32;

impl ObjectBounds {
    /// The bounds of an object, from its OBJECT row.
    pub fn new(object: &Object) -> ObjectBounds {
        let ([x, y, z], [to_x, to_y, to_z]) = (object.lower, object.upper);
        let corners = object.lower.iter().chain(&object.upper);
        let greatest = corners.fold(0.0, |m: f32, x| if x.abs() > m { x.abs() } else { m });
        let is_widened = object.coordinates & WIDENED_BOXES != 0 && WIDENED_RANGE.contains(&greatest);
        // What remains keeps pads far from denormal numbers, for rays from the origin of the object's space, too.
        let padded = if is_widened { greatest * BOX_MARGIN as f32 } else { greatest };
        ObjectBounds { lower: [x, y, z, 0.0], upper: [to_x, to_y, to_z, 0.0], greatest, padded }
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
