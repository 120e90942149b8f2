//! Rays that start on surfaces: at a point of a triangle of an instance, not at an origin.
//!
//! [`mod@crate::intersect::start`] defines the exact point and decides exactly. [`locate`] finds the triangle in the leaves of its
//! object, [`triangles`] the triangles of sixteen rays. [`free`] looks up what they certainly do not meet, by the side on which they leave
//! the triangle and the bin of their direction ([`leaving`]). [`prepare`] makes rays of the object of a batch. [`placed`] places a ray in
//! the world; [`trace`] traces rays and batches; [`queries`] tells the kinds of rays apart.
//! [`visible`] decides whether two points see each other.

mod free;
#[cfg(test)]
mod free_tests;
mod leaving;
pub(crate) mod locate;
pub(crate) mod placed;
pub(crate) mod prepare;
mod queries;
mod trace;
mod triangles;
mod visible;

pub use queries::TraceRay;
pub use visible::SegmentEnd;
