//! The opacity of a triangle at a point.

use super::view::ObjectView;
use crate::layout::{Opacity, opacity_at};

impl ObjectView<'_> {
    /// The opacity of a triangle at barycentric coordinates (weights of its second and third
    /// corner). Opaque for what the file says nothing about.
    #[inline]
    pub fn opacity_at(&self, triangle: u32, u: f32, v: f32) -> Opacity {
        opacity_at(self.opacity, self.opacity_micro, triangle, u, v)
    }
}
