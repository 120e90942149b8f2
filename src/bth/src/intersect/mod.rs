//! Rays against boxes and triangles.
//!
//! f32 lanes are conservative: [`boxes`] and [`filter`] leave out what is certainly missed. What remains is decided in f64, and
//! exactly where its error bounds leave a sign or a digit open: [`exact`] for one ray and triangle, [`exact_lanes`] for
//! sixteen, to the same bits. [`line`] is the projection along a ray that both use, and [`prepare`] makes of rays what boxes
//! and filter need.

pub(crate) mod boxes;
pub(crate) mod exact;
pub(crate) mod exact_lanes;
pub(crate) mod filter;
pub(crate) mod line;
pub(crate) mod prepare;
