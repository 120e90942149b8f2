//! Coordinates and boxes in fewer bits. Vertices move to the points of a grid once, before anything is built from them.
//! Triangles that share a vertex continue to share it, closed surfaces stay closed, and all later stages are exact for the
//! vertices as they are stored. Boxes of nodes are rounded outwards, which changes no answer.

mod boxes;
mod choose;
mod pack;

pub use choose::{Boxes, CoordinateOptions, CoordinateReport, MaxError};
pub(crate) use choose::{OnGrid, place};
pub use pack::pack;
