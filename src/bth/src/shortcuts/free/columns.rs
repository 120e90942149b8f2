//! What the file knows of the triangles on which sixteen rays start.

use crate::simd::{LANES, Simd};
use bth_format::layout::{FreeBins, FreeDirections, FreeDistances};

/// Bit of the last word of bins.
pub(super) const BACK: u32 = (FreeBins::BACK >> 96) as u32;

/// A row of what is known of a triangle.
pub(crate) trait FreeRow {
    /// True if it tells anything.
    const TELLS: bool;
    /// True if it tells free bins.
    const HAS_BINS: bool;
    /// Copies what the row tells to a column.
    fn copy(&self, columns: &mut FreeColumns, column: usize);
}

/// Nothing is known.
pub(crate) struct NoRow;

impl FreeRow for NoRow {
    const TELLS: bool = false;
    const HAS_BINS: bool = false;
    fn copy(&self, _: &mut FreeColumns, _: usize) {}
}

impl FreeRow for FreeDirections {
    const TELLS: bool = true;
    const HAS_BINS: bool = true;

    #[inline(always)]
    fn copy(&self, columns: &mut FreeColumns, column: usize) {
        for word in 0..4 {
            columns.bins[word][column] = self.bins[word];
        }
        let back = if self.bins[3] & BACK != 0 { u32::MAX } else { 0 };
        columns.sectors[0][column] = self.sectors & !back;
        columns.sectors[1][column] = self.sectors & back;
    }
}

impl FreeRow for FreeDistances {
    const TELLS: bool = true;
    const HAS_BINS: bool = false;

    #[inline(always)]
    fn copy(&self, columns: &mut FreeColumns, column: usize) {
        columns.sectors[0][column] = self.sectors[0];
        columns.sectors[1][column] = self.sectors[1];
    }
}

/// What the file knows of sixteen triangles.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct FreeColumns {
    /// The words of their bins.
    pub(super) bins: [[u32; LANES]; 4],
    /// The sectors of their fronts and backs.
    pub(super) sectors: [[u32; LANES]; 2],
}

impl FreeColumns {
    pub(crate) const NONE: FreeColumns = FreeColumns { bins: [[0; LANES]; 4], sectors: [[0; LANES]; 2] };

    /// Replaces each lane by another one.
    #[inline(always)]
    pub(crate) fn expand<S: Simd, R: FreeRow>(&mut self, s: S, lane: S::U) {
        for row in if R::HAS_BINS { &mut self.bins[..] } else { &mut [] } {
            s.store_u(s.lookup_u(s.load_u(row), lane), row);
        }
        for row in if R::TELLS { &mut self.sectors[..] } else { &mut [] } {
            s.store_u(s.lookup_u(s.load_u(row), lane), row);
        }
    }
}
