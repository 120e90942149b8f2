//! Coordinates in fewer bits. Vertices move to the points of a grid once, before anything is built
//! from them. Triangles that share a vertex continue to share it, closed surfaces stay closed, and
//! all later stages are exact for the vertices as they are stored.

mod choose;
mod pack;

pub use choose::{CoordinateOptions, CoordinateReport, MaxError};
pub(crate) use choose::{OnGrid, place};
pub use pack::pack;
