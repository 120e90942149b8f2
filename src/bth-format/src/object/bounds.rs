//! The bounds of an object in the shape that vector loads need.

use crate::layout::Object;

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
}

impl ObjectBounds {
    /// The bounds of an object, from its OBJECT row.
    pub fn new(object: &Object) -> ObjectBounds {
        let ([x, y, z], [to_x, to_y, to_z]) = (object.lower, object.upper);
        let corners = object.lower.iter().chain(&object.upper);
        let greatest = corners.fold(0.0, |m: f32, x| if x.abs() > m { x.abs() } else { m });
        ObjectBounds { lower: [x, y, z, 0.0], upper: [to_x, to_y, to_z, 0.0], greatest }
    }

    /// The cube around the origin that holds all points with coordinates of at most `greatest` in absolute value.
    pub fn around(greatest: f32) -> ObjectBounds {
        let [lower, upper] = [-greatest, greatest].map(|x| [x, x, x, 0.0]);
        ObjectBounds { lower, upper, greatest }
    }

    /// Length of the longest side, rounded to `f32`.
    #[inline(always)]
    pub fn size(&self) -> f32 {
        (0..3).fold(0.0, |m: f32, k| m.max(self.upper[k] - self.lower[k]))
    }
}
