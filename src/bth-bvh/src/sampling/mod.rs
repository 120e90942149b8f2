//! Sample rays, which represent the rays of a renderer, and what they hit in a binary BVH.
//!
//! [`visits()`] says how probable it is that such a ray enters each node, by which the wide tree is
//! chosen; the costs of tetrahedra and the worth of free directions are judged by the same rays.

mod known;
mod rays;
mod visits;
mod walk;

pub use known::KnownRays;
pub use rays::{SampleRay, along, from_surface, outside, within};
pub use visits::visits;
pub use walk::{Traced, affordable, crosses, walk};
