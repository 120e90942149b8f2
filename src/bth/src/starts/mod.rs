//! Rays that start on surfaces, in the space of an object: at a point of a triangle, not at an
//! origin.
//!
//! [`mod@crate::intersect::start`] defines the exact point and decides exactly. [`locate`] finds
//! the triangle in the leaves of its object, [`triangles`] the triangles of sixteen rays. [`free`]
//! looks up what they certainly do not hit, by the side on which they leave the triangle and the
//! bin of their direction ([`leaving`]). [`prepare`] makes rays of the object of a batch.
//! [`world_ray`] holds a ray in world space that may start on a triangle of an instance.

pub(crate) mod free;
#[cfg(test)]
mod free_tests;
mod leaving;
pub(crate) mod locate;
pub(crate) mod prepare;
mod triangles;
pub(crate) mod world_ray;
