//! Intersection of rays with boxes and triangles, in object space.
//!
//! The f32 tests [`boxes`] and [`filter`], by the [`edge_functions`] of triangles, are
//! conservative: they exclude only boxes and triangles that are certainly missed. The remaining
//! triangles are decided in f64, and in exact arithmetic where the error bounds of f64 leave a sign
//! or a digit uncertain: [`exact`] computes one ray and triangle, [`exact_lanes`] sixteen pairs at
//! a time with the same bits, and [`crossing`] decides whether a ray passes through a surface, so
//! that shared edges count once. [`mod@line`] projects points along a ray in f64, and [`prepare`]
//! computes the per-ray constants of the box test and of the filter.
//!
//! Rays through instances are lines in world space, which f32 and f64 only approximate in the space
//! of an object: [`exact_ray`] names where a line is known, [`origin`] bounds what f64 knows of it,
//! [`mod@long`] has twice the digits, and [`exact_line`] decides in world space.
//!
//! The distance of a point to boxes and triangles is bounded in f32 in the same way
//! ([`point_lanes`]) and decided in f64 ([`point_triangle`]) or exactly ([`point_exact`]).
//! [`triangle_box`] decides if triangles and boxes overlap. Points, boxes and corners that are no
//! f32 numbers, and the images of triangles under transforms, are decided as real numbers, too
//! ([`wide_triangle`], [`wide_distance`], [`wide_box`], [`wide_side`]).

pub(crate) mod boxes;
pub(crate) mod crossing;
pub(crate) mod edge_functions;
pub(crate) mod exact;
pub(crate) mod exact_lanes;
pub(crate) mod exact_line;
pub(crate) mod exact_quad;
pub(crate) mod exact_ray;
pub(crate) mod filter;
pub(crate) mod line;
pub(crate) mod long;
pub(crate) mod origin;
mod pairs;
pub(crate) mod point_exact;
pub(crate) mod point_lanes;
pub(crate) mod point_triangle;
pub(crate) mod prepare;
pub(crate) mod region_box;
pub(crate) mod start;
pub(crate) mod start_point;
pub(crate) mod triangle_box;
pub(crate) mod vector;
pub(crate) mod wide_box;
pub(crate) mod wide_distance;
pub(crate) mod wide_side;
pub(crate) mod wide_triangle;
