//! The rows of the two sections that tell of rays that start on triangles.

use super::starts::Starts;
use bth_format::layout::{FreeBins, FreeDirections, FreeDistances};

/// Bit of the last word of bins.
const BACK: u32 = (FreeBins::BACK >> 96) as u32;

/// A row of one of the sections.
pub(super) trait Row {
    /// Whether it tells free bins.
    const HAS_BINS: bool;
    /// Where the triangle lies.
    fn place(&self) -> u32;
    /// Copies what the row tells to a column.
    fn copy(&self, starts: &mut Starts, column: usize);
}

impl Row for FreeDirections {
    const HAS_BINS: bool = true;

    #[inline(always)]
    fn place(&self) -> u32 {
        self.place
    }

    #[inline(always)]
    fn copy(&self, starts: &mut Starts, column: usize) {
        for word in 0..4 {
            starts.bins[word][column] = self.bins[word];
        }
        let back = if self.bins[3] & BACK != 0 { u32::MAX } else { 0 };
        starts.sectors[0][column] = self.sectors & !back;
        starts.sectors[1][column] = self.sectors & back;
    }
}

impl Row for FreeDistances {
    const HAS_BINS: bool = false;

    #[inline(always)]
    fn place(&self) -> u32 {
        self.place
    }

    #[inline(always)]
    fn copy(&self, starts: &mut Starts, column: usize) {
        starts.sectors[0][column] = self.sectors[0];
        starts.sectors[1][column] = self.sectors[1];
    }
}
