//! Queries of rays that start on surfaces, through all instances of a scene, and the kinds of rays that queries take.
//!
//! [`place`] places a start in the world, [`trace`] traces rays and batches, [`visible`] decides whether two points see each other, and
//! [`kinds`] tells rays with an origin and rays from starts apart.

mod kinds;
mod place;
mod trace;
mod visible;

pub use kinds::TraceRay;
pub use visible::SegmentEnd;
