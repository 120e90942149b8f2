//! The packet hit cache: triangles that rays of a packet certainly hit, nearer than all before, each stored once for all rays if
//! these start at one point.
//!
//! The f64 terms of a triangle that do not depend on the direction ([`crate::intersect::exact::OriginTerms`]) are then computed once,
//! and only the others for each ray.

use super::leaf_mesh::Leaf;
use crate::bvh::candidate::Candidate;
use crate::intersect::exact_lanes::{F32Lanes, OriginTermsLanes};
use crate::intersect::filter::TriangleBlock;
use crate::simd::{LANES, Simd};

/// Number of slots.
pub(crate) const SLOTS: usize = LANES;
/// Stands for the slot of a triangle that is not cached and is stored for each ray that hits it.
pub(crate) const UNCACHED: u32 = SLOTS as u32;

/// Triangles that rays of a packet hit.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct HitCache {
    /// `[corner][axis][slot]`, object space.
    pub(crate) corner: [[F32Lanes; 3]; 3],
    /// Indices in the object's leaf order.
    pub(crate) index: [u32; SLOTS],
    /// Ids; set by [`CachedHits::compute_terms`].
    pub(crate) id: [u32; SLOTS],
    /// Child codes of the leaves.
    leaf: [u32; SLOTS],
    /// Indices in the leaves.
    triangle: [u32; SLOTS],
    /// Number of triangles of the packet, whether cached or not.
    count: usize,
    /// Number of slots in use: 0 if the rays do not start at one point, or if the packet before had too many triangles.
    capacity: usize,
    /// Whether [`CachedHits::compute_terms`] has been called for the packet.
    has_terms: bool,
}

impl HitCache {
    pub(crate) const NONE: HitCache = HitCache {
        corner: [[[0.0; SLOTS]; 3]; 3],
        index: [0; SLOTS],
        id: [0; SLOTS],
        leaf: [0; SLOTS],
        triangle: [0; SLOTS],
        count: 0,
        capacity: 0,
        has_terms: false,
    };

    /// Empties the cache for the next packet. `common_origin` is whether the rays of the packet start at one point.
    #[inline(always)]
    pub(crate) fn reset<S: Simd>(&mut self, _: S, common_origin: bool) {
        self.capacity =
            if S::HAS_FAST_F64_LOOKUP && common_origin && self.count <= SLOTS { SLOTS } else { 0 };
        self.count = 0;
        self.has_terms = false;
    }

    /// Number of cached triangles.
    #[inline(always)]
    pub(crate) fn cached(&self) -> usize {
        self.count.min(self.capacity)
    }

    /// Whether all triangles of the packet have slots of the first half.
    #[inline(always)]
    pub(crate) fn fits_first_half(&self) -> bool {
        self.count <= SLOTS / 2
    }

    /// Adds a triangle of a leaf, and returns its slot, or [`UNCACHED`] if the cache is full.
    #[inline(always)]
    pub(crate) fn add<B: TriangleBlock>(&mut self, leaf: &Leaf<'_, B>, triangle: u32) -> u32 {
        let slot = self.count;
        self.count += 1;
        if slot >= self.capacity.min(SLOTS) {
            return UNCACHED;
        }
        for c in 0..3 {
            for k in 0..3 {
                self.corner[c][k][slot] = leaf.block.coordinate(triangle as usize, c, k);
            }
        }
        self.index[slot] = leaf.block.first() + triangle;
        (self.leaf[slot], self.triangle[slot]) = (leaf.code, triangle);
        slot as u32
    }

    /// The triangle in a slot, as a candidate.
    #[inline(always)]
    pub(crate) fn candidate(&self, slot: u32) -> Candidate {
        let slot = slot as usize % SLOTS;
        Candidate { leaf: self.leaf[slot], triangle: self.triangle[slot] }
    }
}

/// The hit cache of a packet, with the terms that its triangles share for all rays.
pub(crate) struct CachedHits<'a> {
    /// The common origin of the rays, object space.
    pub(crate) origin: [f32; 3],
    /// Ids of the object's triangles, in leaf order.
    pub(crate) ids: &'a [u32],
    pub(crate) hit_cache: &'a mut HitCache,
    /// Terms of the cached triangles for `origin`; valid after [`Self::compute_terms`].
    pub(crate) terms: &'a mut OriginTermsLanes,
}

impl CachedHits<'_> {
    /// Computes terms and reads ids of the cached triangles, once for each packet.
    #[inline(always)]
    pub(crate) fn compute_terms(&mut self) {
        if self.hit_cache.has_terms {
            return;
        }
        self.hit_cache.has_terms = true;
        for i in 0..self.hit_cache.cached().min(SLOTS) {
            self.hit_cache.id[i] = self.ids[self.hit_cache.index[i] as usize];
        }
        self.terms.compute(self.origin, &self.hit_cache.corner, self.hit_cache.cached());
    }
}
