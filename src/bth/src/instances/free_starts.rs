//! Rays that certainly do not meet the instance on which they start: they leave it in a direction that is free for its object.

use super::scene_batch::SceneBatch;
use bth_format::layout::NONE;
use std::ops::Range;

/// For each ray of a chunk the instance that it does not meet. A thread keeps this memory from one batch to the next.
#[derive(Default)]
pub(super) struct FreeStarts {
    /// By index in the chunk that instance; `NONE` if the ray may meet all. Empty if that is so for all rays.
    not_met: Vec<u32>,
}

impl FreeStarts {
    /// Looks at the starts of the rays of a chunk.
    pub(super) fn find(&mut self, batch: &SceneBatch<'_>, chunk: Range<usize>) {
        self.not_met.clear();
        let Some(starts) = batch.starts.get(chunk) else { return };
        if starts.iter().any(|start| start.is_free) {
            self.not_met.extend(starts.iter().map(|start| if start.is_free { start.instance } else { NONE }));
        }
    }

    /// The instance that a ray of the chunk does not meet, or `NONE`.
    #[inline(always)]
    pub(super) fn not_met(&self, index: usize) -> u32 {
        self.not_met.get(index).copied().unwrap_or(NONE)
    }

    /// Of some rays, a bit each from the index `first` on, those that may meet an instance.
    #[inline(always)]
    pub(super) fn that_may_meet(&self, instance: u32, first: usize, rays: u64) -> u64 {
        if self.not_met.is_empty() {
            return rays;
        }
        let (mut rest, mut may_meet) = (rays, rays);
        while rest != 0 {
            let bit = rest & rest.wrapping_neg();
            rest ^= bit;
            if self.not_met[first + bit.trailing_zeros() as usize] == instance {
                may_meet ^= bit;
            }
        }
        may_meet
    }
}
