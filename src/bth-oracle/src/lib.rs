//! The reference for ray queries, with which tests, fuzzers, `bthc trace --exact` and the accuracy
//! benchmarks compare: every triangle is tested against the ray in exact arithmetic, slowly and
//! simply.
//!
//! For finite rays and vertices of any magnitude three things are exact: the decision whether the
//! line of a ray hits a triangle, the order of the intersections along the ray, and t, u and v as
//! quotients. Triangles are closed: edges and vertices belong to them. A line in the plane of a
//! triangle misses it. Coordinates are integers in units of the smallest positive f32, and signs
//! come from integer determinants. Only t is rounded, to f32, as the runtime reports it, before it
//! is compared with the range of the ray. The vertices of an instance are transformed exactly by
//! its f64 matrix, whereas the runtime rounds the ray into the space of the object; see [`World`].
//!
//! Rays that start on triangles ([`mod@starts`]) have exact rational starts.
//!
//! Of the runtime only the ray types and the reader of compiled files are used, nothing of its
//! traversal or intersection. A filter in f64 skips triangles that the line misses by far more than
//! its rounding error, and decides nothing else.
#![warn(missing_docs)]

mod closest;
mod crossing;
mod double;
mod geometry;
mod intersection;
mod nearest;
mod orientation;
mod overlap;
pub mod starts;
mod world;

pub use closest::{is_root_within, squared_distance};
pub use crossing::{crossings, winding};
pub use double::{LineHit, line_hit};
pub use geometry::{Triangle, triangles};
pub use intersection::{Intersection, intersection, is_front, to_f64};
pub use nearest::{ExactHit, any, nearest};
pub use orientation::orientation;
pub use overlap::overlaps_box;
pub use world::World;
