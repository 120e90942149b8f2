//! The reference for ray queries, with which tests, fuzzers, `bthc trace --exact` and the accuracy
//! benchmarks compare: every triangle is tested against the ray in exact arithmetic, slowly and
//! simply.
//!
//! For finite rays, vertices and transforms of any magnitude, in f32 or f64, these are exact:
//! whether the line of a ray hits a triangle, the order of the intersections along the
//! ray, and t, u and v as quotients. Triangles are closed: edges and vertices belong to them. A
//! line in the plane of a triangle misses it. All numbers are integers times powers of two, and
//! signs come from determinants. Only t is rounded, as the runtime reports it, before it is
//! compared with the range of the ray. The triangles of an instance are their images under its
//! matrix as real numbers ([`World`]), and rays may start at real points of triangles
//! ([`RayOrigin`]).
//!
//! Of the runtime only the ray types and the reader of compiled files are used, nothing of its
//! traversal or intersection. A filter in f64 skips triangles that the line misses by far more than
//! its rounding error, and decides nothing else.
#![warn(missing_docs)]

mod closest;
mod crossing;
mod geometry;
mod intersection;
mod nearest;
mod number;
mod orientation;
mod overlap;
mod ray;
pub mod starts;
mod world;

pub use closest::{is_root_within, squared_distance};
pub use crossing::{crossings, winding};
pub use geometry::{Triangle, exact_triangles, triangles};
pub use intersection::{Intersection, LineHit, Rows, line_hit, to_f64};
pub use nearest::{ExactHit, all_hits, any, nearest};
pub use number::Coordinate;
pub use orientation::orientation;
pub use overlap::overlaps_box;
pub use ray::{ExactRay, Precision, RayOrigin, intersection, is_front};
pub use world::World;
