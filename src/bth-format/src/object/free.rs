//! What an object knows of rays that start on its triangles, from whichever section it has.

use super::ObjectView;
use crate::layout::{FreeDirections, FreeDistances, KnownFree, kind};

impl ObjectView<'_> {
    /// Returns true if anything is known of rays that start on triangles.
    #[inline(always)]
    pub fn has_free_directions(&self) -> bool {
        !self.free.is_empty() || !self.free_distances.is_empty()
    }

    /// What is known of a triangle; `None` beyond the last row.
    #[inline(always)]
    pub fn known_free(&self, triangle: usize) -> Option<KnownFree> {
        let of_directions = self.free.get(triangle).map(KnownFree::from);
        of_directions.or_else(|| self.free_distances.get(triangle).map(KnownFree::from))
    }

    /// The kind of the section that [`Self::known_free`] reads, and the bytes of its rows.
    pub fn free_kind(&self) -> (u32, usize) {
        if self.free.is_empty() {
            (kind::FREE_DISTANCES, size_of::<FreeDistances>())
        } else {
            (kind::FREE_DIRECTIONS, size_of::<FreeDirections>())
        }
    }
}
