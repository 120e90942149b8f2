//! Closest points on the surface of a scene.
//!
//! [`search`] holds the best triangle so far and decides between triangles; [`walk`] walks the BVH of an object, nearest boxes
//! first; [`placed`] bounds distances in the space of an instance's object; [`scene`] goes through the instances of a scene. [`overlap`] finds the
//! triangles that overlap a box or a ball.

mod order;
mod overlap;
mod placed;
mod scene;
mod search;
mod walk;

pub use crate::intersect::point_triangle::Feature;

use crate::rays::PrimitiveRef;

/// The closest point of a scene to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Distance in world space. It differs from the exact distance to the reported triangle by at most 0.55 units in the last
    /// place; infinite where it exceeds the range of f32.
    pub distance: f32,
    /// The closest point, in world space. On a corner it is the corner.
    pub point: [f32; 3],
    /// Barycentric weight of the triangle's second vertex, from 0 to 1.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex, from 0 to 1.
    pub v: f32,
    /// The triangle.
    pub primitive: PrimitiveRef,
    /// The part of the triangle on which the closest point lies.
    pub feature: Feature,
}
