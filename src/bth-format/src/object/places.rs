//! Where triangles lie in the leaves.

use super::ObjectView;
use crate::layout::TrianglePlace;

impl ObjectView<'_> {
    /// The place of a source triangle in the triangle leaves. `None` if it has none, if the file
    /// has no places, or if there is no such triangle.
    #[inline(always)]
    pub fn place(&self, triangle: u32) -> Option<TrianglePlace> {
        TrianglePlace::from_code(*self.places.get(triangle as usize)?)
    }
}
