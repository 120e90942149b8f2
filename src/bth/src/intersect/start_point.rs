//! Where rays start: data that traversals pass on. [`super::start`] decides about them.

use super::origin::RoundedOrigin;
use super::vector::wide;
use bth_format::layout::NONE;

/// Where a ray of a batch starts, in the space of the object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StartPoint {
    /// The point, rounded, and a bound of its error.
    pub(crate) origin: RoundedOrigin,
    /// Child code of the leaf that holds the triangle; [`NONE`] if the ray starts on no triangle of
    /// the object, and `origin` is exact.
    pub(crate) leaf: u32,
    /// Slot of the triangle in the leaf.
    pub(crate) slot: u32,
    /// Weights of the second and the third corner.
    pub(crate) u: f32,
    pub(crate) v: f32,
}

impl StartPoint {
    /// For a ray that starts at its f32 origin, on no triangle of the object.
    pub(crate) fn beside(origin: [f32; 3]) -> StartPoint {
        let origin = RoundedOrigin(wide(origin), 0.0);
        StartPoint { origin, leaf: NONE, slot: 0, u: 0.0, v: 0.0 }
    }

    /// Returns true if the ray starts on a triangle of the object.
    #[inline(always)]
    pub(crate) fn is_on_triangle(&self) -> bool {
        self.leaf != NONE
    }

    /// The point, rounded to f32.
    #[inline(always)]
    pub(crate) fn rounded(&self) -> [f32; 3] {
        let RoundedOrigin([x, y, z], _) = self.origin;
        [x as f32, y as f32, z as f32]
    }
}
