//! Triangles that rays of a packet certainly hit, each nearer than all before: kept once for all rays that start at one point.
//!
//! f64 then does for a triangle what does not depend on the direction ([`crate::intersect::exact::OriginTerms`]), and for a ray only the rest.

use super::leaf_mesh::Leaf;
use crate::bvh::candidate::Candidate;
use crate::intersect::exact_lanes::{F32Lanes, OriginTermsLanes};
use crate::intersect::filter::TriangleBlock;
use crate::simd::{LANES, Simd};

/// Triangles that are kept.
pub(crate) const MOST: usize = LANES;
/// In place of the number of a triangle that is not: it is kept for each ray that hits it.
pub(crate) const UNCACHED: u32 = MOST as u32;

/// The triangles of a packet.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct HitCache {
    /// `[corner][axis]`.
    pub(crate) corner: [[F32Lanes; 3]; 3],
    /// In leaf order.
    pub(crate) place: [u32; MOST],
    /// As they are reported.
    pub(crate) id: [u32; MOST],
    leaf: [u32; MOST],
    triangle: [u32; MOST],
    /// How many there are, kept or not.
    count: usize,
    /// How many are kept: none, if the rays do not start at one point, or if there were too many the last time.
    buffers: usize,
    /// Whether they have been looked at ([`CachedHits`]).
    is_seen: bool,
}

impl HitCache {
    pub(crate) const NONE: HitCache = HitCache {
        corner: [[[0.0; MOST]; 3]; 3],
        place: [0; MOST],
        id: [0; MOST],
        leaf: [0; MOST],
        triangle: [0; MOST],
        count: 0,
        buffers: 0,
        is_seen: false,
    };

    /// Begins anew.
    #[inline(always)]
    pub(crate) fn clear<S: Simd>(&mut self, _: S, from_point: bool) {
        self.buffers = if S::HAS_FAST_F64_LOOKUP && from_point && self.count <= MOST { MOST } else { 0 };
        self.count = 0;
        self.is_seen = false;
    }

    /// How many are kept.
    #[inline(always)]
    pub(crate) fn kept(&self) -> usize {
        self.count.min(self.buffers)
    }

    /// Whether the first half of the room was enough.
    #[inline(always)]
    pub(crate) fn are_few(&self) -> bool {
        self.count <= MOST / 2
    }

    /// Takes in a triangle of a leaf, and returns its number: [`UNCACHED`] if there is no room.
    #[inline(always)]
    pub(crate) fn add<B: TriangleBlock>(&mut self, leaf: &Leaf<'_, B>, triangle: u32) -> u32 {
        let at = self.count;
        self.count += 1;
        if at >= self.buffers.min(MOST) {
            return UNCACHED;
        }
        for c in 0..3 {
            for k in 0..3 {
                self.corner[c][k][at] = leaf.block.coordinate(triangle as usize, c, k);
            }
        }
        self.place[at] = leaf.block.first() + triangle;
        (self.leaf[at], self.triangle[at]) = (leaf.code, triangle);
        at as u32
    }

    /// A triangle as what is still to be decided.
    #[inline(always)]
    pub(crate) fn candidate(&self, number: u32) -> Candidate {
        let at = number as usize % MOST;
        Candidate { leaf: self.leaf[at], triangle: self.triangle[at] }
    }
}

/// The triangles of a packet, and how they look from the point at which its rays start.
pub(crate) struct CachedHits<'a> {
    pub(crate) origin: [f32; 3],
    /// In leaf order.
    pub(crate) ids: &'a [u32],
    pub(crate) hit_cache: &'a mut HitCache,
    pub(crate) seen: &'a mut OriginTermsLanes,
}

impl CachedHits<'_> {
    /// CachedHits at all of them, the first time.
    #[inline(always)]
    pub(crate) fn compute(&mut self) {
        if self.hit_cache.is_seen {
            return;
        }
        self.hit_cache.is_seen = true;
        for i in 0..self.hit_cache.kept().min(MOST) {
            self.hit_cache.id[i] = self.ids[self.hit_cache.place[i] as usize];
        }
        self.seen.compute(self.origin, &self.hit_cache.corner, self.hit_cache.kept());
    }
}
