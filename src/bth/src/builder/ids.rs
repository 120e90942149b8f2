//! Ids that stay the same until what they name is removed.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Ids that are free again. An id is reused only after the commit in which what it named
/// disappeared, the lowest first, so that hits of the scene as it was rendered never name something
/// else.
#[derive(Debug, Default)]
pub(super) struct FreeIds {
    free: BinaryHeap<Reverse<u32>>,
    /// Ids that are free after the next commit.
    released: Vec<u32>,
}

impl FreeIds {
    /// A free id, if there is one.
    pub(super) fn take(&mut self) -> Option<u32> {
        self.free.pop().map(|Reverse(id)| id)
    }

    /// Number of free ids.
    pub(super) fn len(&self) -> usize {
        self.free.len()
    }

    /// Makes an id free after the next commit.
    pub(super) fn release(&mut self, id: u32) {
        self.released.push(id);
    }

    /// Makes the released ids free, and returns them.
    pub(super) fn commit(&mut self) -> Vec<u32> {
        let released = std::mem::take(&mut self.released);
        self.free.extend(released.iter().map(|id| Reverse(*id)));
        released
    }
}
