//! The slow and obvious truth: every triangle against the ray, in exact arithmetic, at any scale of finite input.
//!
//! Triangles are closed; a ray that lies in the plane of a triangle misses it; t is the exact quotient. Nothing of the
//! runtime's tracing is used: points become integers (in units of the least positive f32), signs are signs of integer
//! determinants. A filter in f64 only skips triangles that the line misses by far more than rounding.
#![warn(missing_docs)]

mod crossing;
mod geometry;
mod nearest;
mod world;

pub use crossing::{Crossing, crossing, to_f64};
pub use geometry::{Triangle, triangles};
pub use nearest::{Truth, any, nearest};
pub use world::World;
