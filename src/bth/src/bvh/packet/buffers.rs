//! Memory of packets, kept from one batch to the next.

use super::entry::{GROUPS, StackEntry};
use super::hit_cache::HitCache;
use super::points::{ProjectedPoints, RelativePoints};
use super::ray_group::RayGroup;
use super::single_rays::SingleRays;
use crate::intersect::exact_lanes::{Intersections, OriginTermsLanes, Pairs};
use crate::simd::{LANES, Simd};
use bth_format::layout::{NONE, WIDTH};
use bth_format::limits::MAX_DEPTH;
use bth_format::object::ObjectView;
use std::any::Any;

/// Memory of packets, kept from one batch to the next.
#[derive(Debug)]
pub(crate) struct PacketBuffers {
    pub(super) stack: Vec<StackEntry>,
    pub(super) points: ProjectedPoints,
    pub(super) relative: RelativePoints,
    pub(super) single_rays: SingleRays,
    pub(crate) hit_cache: HitCache,
    /// Terms of the cached triangles for the packet's origin.
    pub(super) origin_terms: OriginTermsLanes,
    /// Rays and triangles of the hits that are computed. They are kept, because clearing them takes
    /// longer than the computation.
    pub(super) pairs: Pairs,
    pub(super) intersections: [Intersections; GROUPS],
    /// For each ray that starts on a triangle the child code of its leaf, and its slot there.
    pub(super) own: [[[u32; LANES]; 2]; GROUPS],
}

impl PacketBuffers {
    /// Makes the stack as long as packets through an object may need.
    pub(super) fn reserve(&mut self, object: &ObjectView<'_>) {
        // At every level all children but the entered one are stacked.
        let entries = (object.header.depth as usize).min(MAX_DEPTH) * (WIDTH - 1) + 1 + WIDTH;
        if self.stack.len() < entries {
            self.stack.resize(entries, StackEntry::default());
        }
    }
}

impl Default for PacketBuffers {
    fn default() -> Self {
        PacketBuffers {
            stack: Vec::new(),
            points: ProjectedPoints::NONE,
            relative: RelativePoints::NONE,
            single_rays: SingleRays::NONE,
            hit_cache: HitCache::NONE,
            origin_terms: OriginTermsLanes::NONE,
            pairs: Pairs::NONE,
            intersections: [Intersections::NONE; GROUPS],
            own: [[[NONE; LANES]; 2]; GROUPS],
        }
    }
}

/// Groups for the instruction set that was used last. They are kept, because initializing them for
/// every batch would take as long as tracing a few rays.
#[derive(Debug, Default)]
pub(crate) struct GroupStorage(Option<Box<dyn Any>>);

impl GroupStorage {
    /// The groups for an instruction set.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(&mut self, s: S) -> &mut [RayGroup<S>; GROUPS] {
        if !self.0.as_ref().is_some_and(|groups| groups.is::<[RayGroup<S>; GROUPS]>()) {
            self.0 = Some(Box::new([RayGroup::vacant(s); GROUPS]));
        }
        self.0.as_mut().and_then(|groups| groups.downcast_mut()).expect("the groups have just been made")
    }
}
