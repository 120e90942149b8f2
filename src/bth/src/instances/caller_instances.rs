//! The instances of a scene builder, as its caller has placed them in the last commit.

use super::placement::{PartBoxes, Placement, PlacementError};
use crate::nodes::affine::Affine;
use std::sync::OnceLock;

/// An instance: its object, its node, and its transform to world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceRow {
    /// Index of the object; `NONE` if the instance was removed.
    pub(crate) object: u32,
    /// Index of the node in the file of the object, or `NONE`.
    pub(crate) node: u32,
    pub(crate) to_world: Affine,
}

/// The instances as the caller has placed them in the last commit.
#[derive(Debug, Default)]
pub(super) struct CallerInstances {
    pub(super) rows: Vec<InstanceRow>,
    /// Number of visible instances.
    pub(super) visible: usize,
    /// For each object the boxes from which the world boxes of its instances are computed, once they were needed.
    pub(super) parts: Vec<OnceLock<Box<PartBoxes>>>,
    /// Memory for the placements of a commit.
    pub(super) placed: Vec<Result<Option<Placement>, PlacementError>>,
}

impl CallerInstances {
    /// Forgets the boxes of an object, which has got others.
    pub(super) fn forget_parts(&mut self, object: u32) {
        self.parts[object as usize].take();
    }

    pub(super) fn add_objects(&mut self, count: u32) {
        self.parts.resize_with(count as usize, OnceLock::new);
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let parts = self.parts.iter().filter(|parts| parts.get().is_some()).count();
        self.rows.capacity() * size_of::<InstanceRow>()
            + self.placed.capacity() * size_of::<Result<Option<Placement>, PlacementError>>()
            + self.parts.capacity() * size_of::<OnceLock<Box<PartBoxes>>>()
            + parts * size_of::<PartBoxes>()
    }
}
