//! What a commit has made, which rays are traced through.
#![allow(unsafe_code)] // Holds a handle of the other library.

use crate::abi::{Bounds, Handle};
use crate::geometry::Geometry;
use crate::handles::Shared;
use crate::mesh::Mesh;
use crate::world::World;
use std::sync::Arc;

/// Most masks that are compared with the mask of a ray before it is traced.
pub(crate) const MAX_MASKS: usize = 16;

/// Ids from here on, which programs choose, are looked up in another way.
pub(crate) const MAX_TABLE: u32 = 1 << 20;

/// What a commit has made.
#[derive(Debug)]
pub(crate) struct Committed {
    /// The scene's own triangles.
    pub(crate) own: Arc<Mesh>,
    /// The instances, if there are any that can be hit.
    pub(crate) world: Option<World>,
    /// The scene of the other library with what bth does not hold; null if there is nothing.
    pub(crate) rest: Rest,
    pub(crate) is_robust: bool,
    /// Where filters may apply.
    pub(crate) filters: Filters,
    /// The masks of geometries and instances, without repetitions; `None` if there are too many.
    pub(crate) masks: Option<Vec<u32>>,
    pub(crate) bounds: Bounds,
    /// The bounds of what does not move.
    pub(crate) still_bounds: Bounds,
    /// The enabled geometries, by id.
    pub(crate) geometries: Vec<Option<Arc<Shared<Geometry>>>>,
}

/// A scene of the other library, or null.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rest(pub(crate) Handle);

/// Where filters may apply.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Filters {
    pub(crate) intersect: bool,
    pub(crate) occluded: bool,
    pub(crate) takes_argument: bool,
    /// True if a scene of some triangles allows filters in arguments.
    pub(crate) allows_argument: bool,
}

impl Committed {
    /// Bytes that tracing reads.
    pub(crate) fn bytes(&self) -> usize {
        self.own.scene.as_ref().map_or(0, |scene| scene.resident_bytes() as usize)
    }

    /// A geometry by its id.
    pub(crate) fn geometry(&self, id: u32) -> Option<&Arc<Shared<Geometry>>> {
        self.geometries.get(id as usize)?.as_ref()
    }

    /// Returns true if a ray with this mask can hit every geometry and instance.
    #[inline(always)]
    pub(crate) fn all_meet(&self, mask: u32) -> bool {
        self.masks.as_ref().is_some_and(|masks| masks.iter().all(|known| known & mask != 0))
    }
}

// SAFETY: scenes of the other library may be used from any thread.
unsafe impl Send for Rest {}
// SAFETY: as above.
unsafe impl Sync for Rest {}
