//! Cache of the triangles of a packet's pending hits, for rays that have the same origin.
//!
//! The terms of an intersection that do not depend on the direction
//! ([`crate::intersect::exact::OriginTerms`]) are then computed in f64 once for each triangle, and
//! only the others for each ray.

use super::leaf_mesh::LeafPoints;
use crate::bvh::candidate::Candidate;
use crate::intersect::exact_lanes::{ExactCorners, F32Lanes, OriginTermsLanes, Pairs};
use crate::intersect::exact_ray::{LineLanes, Lines};
use crate::intersect::origin::Origin;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::object::ExactPositions;

/// Largest number of cached triangles.
pub(crate) const CACHED_TRIANGLES: usize = LANES;
/// Instead of the index of a triangle that is not in the cache; each ray that hits it stores it.
pub(crate) const UNCACHED: u32 = CACHED_TRIANGLES as u32;

/// The cached triangles of a packet.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct HitCache {
    /// Corners of the triangles: `[corner][axis]`.
    pub(crate) corner: [[F32Lanes; 3]; 3],
    /// Indices of the triangles in leaf order.
    pub(crate) index: [u32; CACHED_TRIANGLES],
    /// Ids of the triangles.
    pub(crate) id: [u32; CACHED_TRIANGLES],
    /// Child codes of their leaves.
    leaf: [u32; CACHED_TRIANGLES],
    /// Indices of the triangles in their leaves.
    triangle: [u32; CACHED_TRIANGLES],
    /// Number of triangles of pending hits, cached or not.
    count: usize,
    /// Number of triangles that may be cached: 0 if the rays have different origins, or if the
    /// previous packet had too many.
    capacity: usize,
    /// True if ids and terms of the triangles have been computed ([`CachedHits::compute`]).
    is_computed: bool,
}

impl HitCache {
    pub(crate) const NONE: HitCache = HitCache {
        corner: [[[0.0; CACHED_TRIANGLES]; 3]; 3],
        index: [0; CACHED_TRIANGLES],
        id: [0; CACHED_TRIANGLES],
        leaf: [0; CACHED_TRIANGLES],
        triangle: [0; CACHED_TRIANGLES],
        count: 0,
        capacity: 0,
        is_computed: false,
    };

    /// Empties the cache.
    #[inline(always)]
    pub(crate) fn clear<S: Simd>(&mut self, _: S, from_point: bool) {
        self.capacity = if S::HAS_FAST_F64_LOOKUP && from_point && self.count <= CACHED_TRIANGLES {
            CACHED_TRIANGLES
        } else {
            0
        };
        self.count = 0;
        self.is_computed = false;
    }

    /// Number of cached triangles.
    #[inline(always)]
    pub(crate) fn kept(&self) -> usize {
        self.count.min(self.capacity)
    }

    /// Returns true if the triangles fill at most half of the cache.
    #[inline(always)]
    pub(crate) fn is_at_most_half_full(&self) -> bool {
        self.count <= CACHED_TRIANGLES / 2
    }

    /// Adds a triangle of a leaf; returns its index, or [`UNCACHED`] if the cache is full.
    #[inline(always)]
    pub(crate) fn add(&mut self, leaf: &LeafPoints<'_>, triangle: u32) -> u32 {
        let at = self.count;
        self.count += 1;
        if at >= self.capacity.min(CACHED_TRIANGLES) {
            return UNCACHED;
        }
        for (corner, point) in self.corner.iter_mut().zip(leaf.points_of(triangle as usize)) {
            let point = leaf.point(point);
            for k in 0..3 {
                corner[k][at] = point[k];
            }
        }
        self.index[at] = leaf.first + triangle;
        (self.leaf[at], self.triangle[at]) = (leaf.code, triangle);
        at as u32
    }

    /// A cached triangle as a candidate.
    #[inline(always)]
    pub(crate) fn candidate(&self, index: u32) -> Candidate {
        let at = index as usize % CACHED_TRIANGLES;
        Candidate { leaf: self.leaf[at], triangle: self.triangle[at] }
    }
}

/// The cached triangles of a packet, and their terms for the common origin of its rays.
pub(crate) struct CachedHits<'a> {
    pub(crate) origin: [f32; 3],
    /// Ids of the object's triangles, in leaf order.
    pub(crate) ids: &'a [u32],
    /// Their corners in the source, where those in leaves are rounded.
    pub(crate) exact: ExactPositions<'a>,
    pub(crate) hit_cache: &'a mut HitCache,
    pub(crate) origin_terms: &'a mut OriginTermsLanes,
    /// Overwritten by each group.
    pub(crate) pairs: &'a mut Pairs,
    /// The rays of the packet, and their lines.
    pub(crate) rays: &'a [Ray],
    pub(crate) lines: Lines<'a>,
    /// False once the lines are known to have no common origin.
    pub(crate) has_common_origin: bool,
}

impl CachedHits<'_> {
    /// The lines of the rays of a group.
    pub(crate) fn lines_of(&self, at: usize, of_lanes: &mut LineLanes) {
        let first = at * LANES;
        let rays: [u32; LANES] = std::array::from_fn(|lane| (first + lane) as u32);
        let count = (self.rays.len() - first).min(LANES);
        self.lines.lanes(&rays[..count], self.rays, of_lanes);
    }

    /// Computes ids and terms of the cached triangles for the common origin of the rays, at the
    /// first call for a packet.
    #[inline(always)]
    pub(crate) fn compute(&mut self, origin: impl Origin) {
        if self.hit_cache.is_computed {
            return;
        }
        self.hit_cache.is_computed = true;
        for i in 0..self.hit_cache.kept().min(CACHED_TRIANGLES) {
            self.hit_cache.id[i] = self.ids[self.hit_cache.index[i] as usize];
        }
        let kept = self.hit_cache.kept();
        if self.exact.is_empty() {
            return self.origin_terms.compute(origin, &self.hit_cache.corner, kept);
        }
        let lanes = ((1u64 << kept.min(LANES)) - 1) as u32;
        self.origin_terms.compute(origin, &ExactCorners::of(&self.exact, &self.hit_cache.id, lanes), kept);
    }

    /// Like [`Self::compute`], for lines. Returns false if they have no common origin, though the
    /// rays of f32 have one.
    #[inline(always)]
    pub(crate) fn compute_for_lines(&mut self) -> bool {
        if !self.hit_cache.is_computed && self.has_common_origin {
            let line = match self.lines {
                Lines::World(lines, first) => lines.common_origin(first, self.rays.len()),
                Lines::Rays | Lines::Starts(_) => None,
            };
            self.has_common_origin = line.is_some();
            if let Some(line) = line {
                self.compute(line);
            }
        }
        self.has_common_origin
    }
}
