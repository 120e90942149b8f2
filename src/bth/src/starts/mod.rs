//! Rays that start on surfaces, in the space of an object: at a point of a triangle, not at an
//! origin.
//!
//! [`mod@crate::intersect::start`] defines the exact point and decides exactly. [`locate`] finds
//! the triangle in the leaves of its object, [`triangles`] the triangles of sixteen rays.
//! [`prepare`] makes rays of the object of a batch. [`world_ray`] holds a ray in world space that
//! may start on a triangle of an instance.

pub(crate) mod locate;
pub(crate) mod prepare;
mod triangles;
pub(crate) mod world_ray;
