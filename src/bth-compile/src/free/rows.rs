//! The rows of the sections of free directions.

use super::Free;
use bth_format::layout::{FreeDirections, FreeDistances, FreeLevels, NONE};

/// The contents of the sections of free directions.
#[derive(Clone, Debug)]
pub(crate) struct FreeRows {
    pub(crate) directions: Vec<FreeDirections>,
    pub(crate) distances: Vec<FreeDistances>,
    pub(crate) levels: [FreeLevels; 1],
}

impl FreeRows {
    /// The rows of all triangles. Triangles without a place get rows of zeros.
    pub(crate) fn new(free: Free, places: &[u32]) -> Self {
        let Free { levels, mut directions, mut distances } = free;
        for (row, place) in directions.iter_mut().zip(places) {
            if *place == NONE {
                *row = FreeDirections::UNKNOWN;
            }
        }
        for (row, place) in distances.iter_mut().zip(places) {
            if *place == NONE {
                *row = FreeDistances::UNKNOWN;
            }
        }
        FreeRows { directions, distances, levels: [FreeLevels { distance: levels, reserved: 0 }] }
    }
}
