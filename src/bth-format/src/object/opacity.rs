//! The opacity of a triangle at a point.

use super::view::ObjectView;
use crate::layout::{MICRO_PER_WORD, Opacity, TriangleOpacity, micro_triangle};

impl ObjectView<'_> {
    /// Whether triangles of the object let rays pass.
    #[inline(always)]
    pub fn has_opacity(&self) -> bool {
        !self.opacity.is_empty()
    }

    /// The opacity of a triangle at barycentric coordinates (weights of its second and third corner). Opaque for what the file
    /// says nothing about.
    #[inline]
    pub fn opacity_at(&self, triangle: u32, u: f32, v: f32) -> Opacity {
        let Some(row) = self.opacity.get(triangle as usize) else { return Opacity::Opaque };
        match TriangleOpacity::from_code(*row) {
            Some(TriangleOpacity::Whole(state)) => state,
            Some(TriangleOpacity::Micro { level, word }) => {
                let micro = micro_triangle(level, u, v) as usize;
                let word =
                    self.opacity_micro.get(word as usize + micro / MICRO_PER_WORD).copied().unwrap_or(0);
                Opacity::from_code(word >> (2 * (micro % MICRO_PER_WORD)) & 3).unwrap_or(Opacity::Unknown)
            }
            None => Opacity::Opaque,
        }
    }
}
