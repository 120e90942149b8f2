//! Coordinates and boxes in fewer bits. Vertices move to the points of a grid, once and before anything is built from them:
//! what shares a vertex goes on sharing it, closed surfaces stay closed, and all that comes after is exact for the vertices
//! as they are stored. Boxes of nodes are rounded outwards and change no answer.

mod boxes;
mod choose;
mod pack;

pub use choose::{Boxes, MaxError, Options, Report};
pub(crate) use choose::{OnGrid, place};
pub use pack::pack;
