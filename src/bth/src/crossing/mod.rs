//! Crossings of surfaces: how often a ray passes through the triangles of a scene, and whether points lie inside of closed meshes.
//!
//! The rule that decides is [`crate::intersect::crossing`].

/// Passages of a ray through triangles, counted by the crossing rule: each passage of a closed surface counts once, also where the
/// ray passes an edge, a vertex or along a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Crossings {
    /// Number of crossings in the ray's range.
    pub count: u32,
    /// Crossings from the back of a triangle to its front minus those from the front to the back.
    pub winding: i32,
}
