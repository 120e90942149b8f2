//! Sixteen rays of a packet, one in each lane.
//!
//! [`crate::intersect::boxes`] and [`crate::intersect::filter`] test one ray against sixteen boxes
//! or triangles; here sixteen rays are tested against one box or triangle, by the same operations
//! on the same prepared values ([`crate::intersect::prepare`]), so the same error bounds hold.

use super::bounds::PacketBounds;
use super::hit_cache::{CachedHits, UNCACHED};
use super::leaf_mesh::LeafPoints;
use super::projection::Projection;
use crate::intersect::exact_lanes::{ExactCorners, Intersections, lane};
use crate::intersect::exact_ray::LineLanes;
use crate::intersect::prepare::{self, Axes, CommonAxis, MixedAxes, PreparedLanes};
use crate::intersect::vector::pick3;
use crate::intersect::vector::{max_norm, wide};
use crate::simd::{LANES, Lanewise, Part, Simd};
use bth_format::layout::NONE;
use std::marker::PhantomData;

/// Sixteen rays and their hits so far. Fields whose names occur in [`prepare::PreparedLanes`] have
/// the meaning documented there.
#[derive(Clone, Copy)]
pub(crate) struct RayGroup<S: Simd> {
    pub(crate) origin: [S::F; 3],
    pub(crate) direction: [S::F; 3],
    pub(crate) reciprocal: [S::F; 3],
    pub(super) near_addend: [S::F; 3],
    pub(super) far_addend: [S::F; 3],
    /// For each axis the rays with a negative direction.
    pub(super) negative: [S::M; 3],
    /// Depth of t = 1.
    pub(crate) scale: S::F,
    /// Smallest depth of hits in the ray's range.
    pub(crate) first: S::F,
    /// Upper limit of the depths of hits that can still change the result.
    pub(crate) limit: S::F,
    /// Distance (maximum norm) from the origin to the farthest corner of the object's box.
    pub(crate) reach: S::F,
    /// The axis of each direction's largest |component|.
    pub(crate) mixed: MixedAxes<S>,
    /// That axis, if it is the same for all rays.
    pub(crate) common: Option<CommonAxis>,
    pub(crate) projection: Projection<S>,
    /// Smallest and largest depth between which a hit is certainly in the ray's range.
    pub(crate) certain: [S::F; 2],
    /// Lower bound of the depth of the nearest hit so far.
    pub(crate) nearest: S::F,
    /// The triangle of the pending hit: its index in the [`HitCache`](super::hit_cache::HitCache),
    /// [`UNCACHED`], or `NONE` without one.
    pub(crate) pending: S::U,
    /// For an uncached pending hit the child code of its leaf.
    pub(crate) leaf: S::U,
    /// For an uncached pending hit the index of the triangle in the leaf.
    pub(crate) triangle: S::U,
    /// For an uncached pending hit the triangle's index in leaf order.
    index: S::U,
    /// For an uncached pending hit the corners (`[corner][axis]`).
    corner: [[S::F; 3]; 3],
}

/// Limits of the depths of hits of rays, one in each lane.
pub(crate) struct RayLimits<S: Lanewise> {
    /// Smallest depth of hits in the ray's range.
    pub(crate) first: S::F,
    /// Upper limit of the depths of hits that can still change the result.
    pub(crate) limit: S::F,
    /// Smallest and largest depth between which a hit is certainly in the ray's range.
    pub(crate) certain: [S::F; 2],
}

/// What the box test needs of rays, one in each lane.
pub(crate) struct GroupSlabs<S: Lanewise> {
    reciprocal: [S::F; 3],
    near_addend: [S::F; 3],
    far_addend: [S::F; 3],
    negative: [S::M; 3],
    /// Smallest and largest depth.
    depths: [S::F; 2],
}

impl<S: Lanewise> GroupSlabs<S> {
    /// Those of prepared rays.
    #[inline(always)]
    pub(crate) fn of(lanes: &PreparedLanes<S>) -> Self {
        GroupSlabs {
            reciprocal: lanes.reciprocal,
            near_addend: lanes.near_addend,
            far_addend: lanes.far_addend,
            negative: lanes.negative,
            depths: lanes.depths,
        }
    }

    /// Implements [`RayGroup::may_enter`].
    #[inline(always)]
    pub(crate) fn may_enter(&self, s: S, corners: [[f32; 3]; 2], kind: (bool, bool)) -> u32 {
        s.mask_bits(self.enter(s, corners, kind).1)
    }

    /// The depths at which the rays enter a box, and the rays that may hit it within their range.
    /// Takes the same parameters as [`Self::may_enter`].
    #[inline(always)]
    pub(crate) fn enter(
        &self,
        s: S,
        corners: [[f32; 3]; 2],
        (mixed_octants, common_origin): (bool, bool),
    ) -> (S::F, S::M) {
        let [mut enter, mut leave] = self.depths;
        for k in 0..3 {
            let (mut near, mut far) = (s.splat(corners[0][k]), s.splat(corners[1][k]));
            if mixed_octants {
                (near, far) = (s.select(self.negative[k], far, near), s.select(self.negative[k], near, far));
            }
            (near, far) = if common_origin {
                (s.mul(near, self.reciprocal[k]), s.mul(far, self.reciprocal[k]))
            } else {
                (
                    s.fma(near, self.reciprocal[k], self.near_addend[k]),
                    s.fma(far, self.reciprocal[k], self.far_addend[k]),
                )
            };
            enter = s.max(near, enter);
            leave = s.min(far, leave);
        }
        (enter, s.le(enter, leave))
    }
}

impl<S: Simd> RayGroup<S> {
    /// A group without rays.
    #[inline(always)]
    pub(crate) fn vacant(s: S) -> Self {
        let (zero, none, no) = (s.splat(0.0), s.splat_u(NONE), s.mask(0));
        RayGroup {
            origin: [zero; 3],
            direction: [zero; 3],
            reciprocal: [zero; 3],
            near_addend: [zero; 3],
            far_addend: [zero; 3],
            negative: [no; 3],
            scale: zero,
            first: zero,
            limit: zero,
            reach: zero,
            mixed: MixedAxes { is_x: no, is_y: no },
            common: None,
            projection: Projection { origin: [zero; 2], shear: [zero; 2], forward: zero, start: zero },
            certain: [zero; 2],
            nearest: zero,
            pending: none,
            leaf: none,
            triangle: none,
            index: none,
            corner: [[zero; 3]; 3],
        }
    }

    /// Sets the pending hit of masked lanes to `triangle`, given as for `pending`. `depth` holds
    /// the bounds of its depth.
    #[inline(always)]
    pub(crate) fn accept(&mut self, s: S, m: S::M, depth: [S::F; 2], triangle: u32) {
        self.nearest = s.select(m, depth[0], self.nearest);
        self.limit = s.select(m, depth[1], self.limit);
        self.pending = s.select_u(m, s.splat_u(triangle), self.pending);
    }

    /// Stores an uncached pending hit of lanes.
    #[inline(always)]
    pub(crate) fn store_uncached(&mut self, s: S, m: S::M, leaf: &LeafPoints<'_>, triangle: u32) {
        self.leaf = s.select_u(m, s.splat_u(leaf.code), self.leaf);
        self.triangle = s.select_u(m, s.splat_u(triangle), self.triangle);
        self.index = s.select_u(m, s.splat_u(leaf.first + triangle), self.index);
        for (corner, point) in self.corner.iter_mut().zip(leaf.points_of(triangle as usize)) {
            // Each is loaded directly from the leaf: loading vectors from an array that was just
            // written by words would stall.
            let point = leaf.point(point);
            for k in 0..3 {
                corner[k] = s.select(m, s.splat(point[k]), corner[k]);
            }
        }
    }

    /// The prepared rays of a piece, for groups whose rays do not have the same origin.
    #[inline(always)]
    pub(crate) fn lanes(&self, p: S::Piece) -> prepare::PreparedLanes<S::Piece> {
        let slabs = self.slabs_of_piece(p);
        let projection = self.projection.pick(p);
        prepare::PreparedLanes {
            reciprocal: slabs.reciprocal,
            near_addend: slabs.near_addend,
            far_addend: slabs.far_addend,
            negative: slabs.negative,
            scale: S::pick(p, &self.scale),
            depths: slabs.depths,
            certain: [S::pick(p, &self.certain[0]), S::pick(p, &self.certain[1])],
            axis: self.mixed.pick(p).axes(p),
            origin: projection.origin,
            shear: projection.shear,
            forward: projection.forward,
            start: projection.start,
            reach: S::pick(p, &self.reach),
            usable: p.mask(0xffff),
        }
    }

    /// The limits of the depths of hits.
    #[inline(always)]
    pub(crate) fn limits(&self) -> RayLimits<S> {
        RayLimits { first: self.first, limit: self.limit, certain: self.certain }
    }

    /// Like [`Self::limits`], of the rays of a piece.
    #[inline(always)]
    pub(crate) fn limits_of_piece(&self, p: S::Piece) -> RayLimits<S::Piece> {
        RayLimits {
            first: S::pick(p, &self.first),
            limit: S::pick(p, &self.limit),
            certain: [S::pick(p, &self.certain[0]), S::pick(p, &self.certain[1])],
        }
    }

    /// The rays that may hit a box within their range, one bit per ray. If all directions lie in
    /// one octant ([`PacketBounds::MIXED_OCTANTS`] is false), rays enter the box at the first
    /// corner and leave it at the second. Else these are the lower and the upper corner.
    #[inline(always)]
    pub(crate) fn may_enter<H: PacketBounds<S>>(&self, s: S, corners: [[f32; 3]; 2]) -> u32 {
        let slabs = GroupSlabs {
            reciprocal: self.reciprocal,
            near_addend: self.near_addend,
            far_addend: self.far_addend,
            negative: self.negative,
            depths: [self.first, self.limit],
        };
        slabs.may_enter(s, corners, (H::MIXED_OCTANTS, H::COMMON_ORIGIN))
    }

    /// Like [`Self::may_enter`], for the rays of a piece.
    #[inline(always)]
    pub(crate) fn piece_may_enter<H: PacketBounds<S>>(&self, p: S::Piece, corners: [[f32; 3]; 2]) -> u32 {
        self.slabs_of_piece(p).may_enter(p, corners, (H::MIXED_OCTANTS, H::COMMON_ORIGIN))
    }

    #[inline(always)]
    fn slabs_of_piece(&self, p: S::Piece) -> GroupSlabs<S::Piece> {
        let [x, y, z] = &self.negative;
        GroupSlabs {
            reciprocal: pick3::<S>(p, &self.reciprocal),
            near_addend: pick3::<S>(p, &self.near_addend),
            far_addend: pick3::<S>(p, &self.far_addend),
            negative: [S::pick_mask(p, x), S::pick_mask(p, y), S::pick_mask(p, z)],
            depths: [S::pick(p, &self.first), S::pick(p, &self.limit)],
        }
    }
}

/// Computes the pending hits of a group, as a part of kernels. Without any, only the bit masks of
/// `intersections` are cleared.
pub(crate) struct IntersectGroup<'a, 'c, S: Simd, H> {
    pub(crate) group: &'a RayGroup<S>,
    pub(crate) cached: &'a mut CachedHits<'c>,
    pub(crate) intersections: &'a mut Intersections,
    pub(crate) packet: PhantomData<H>,
}

impl<S: Simd, H: PacketBounds<S>> Part<S> for IntersectGroup<'_, '_, S, H> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let IntersectGroup { group, cached, intersections, .. } = self;
        let Some(lanes) = group.pending_lanes(s, intersections) else { return };
        let uncached = s.eq_u(group.pending, s.splat_u(UNCACHED));
        // For most kernels this is a constant.
        let kept = if H::COMMON_ORIGIN && S::HAS_FAST_F64_LOOKUP { cached.hit_cache.kept() } else { 0 };
        if kept > 0 && s.mask_bits(uncached) == 0 {
            cached.compute(wide(cached.origin));
            let (hit_cache, terms) = (&*cached.hit_cache, &*cached.origin_terms);
            let (mut direction, mut size) = ([[0.0; LANES]; 3], [0.0; LANES]);
            for k in 0..3 {
                s.store(group.direction[k], &mut direction[k]);
            }
            s.store(group.scale, &mut size);
            s.store_u(s.lookup_u(s.load_u(&hit_cache.id), group.pending), &mut intersections.triangle);
            let (pending, of_lane) = (group.pending, |i: usize| (lane(&direction, i), size[i].into()));
            return if hit_cache.is_at_most_half_full() {
                intersections.compute_from_point::<S, true>(s, lanes, of_lane, terms, pending)
            } else {
                intersections.compute_from_point::<S, false>(s, lanes, of_lane, terms, pending)
            };
        }
        for k in 0..3 {
            let origin = if H::COMMON_ORIGIN { s.splat(cached.origin[k]) } else { group.origin[k] };
            s.store(origin, &mut cached.pairs.origin[k]);
            s.store(group.direction[k], &mut cached.pairs.direction[k]);
        }
        group.store_triangles(s, lanes, (uncached, kept), cached, intersections);
        intersections.compute(s, lanes, cached.pairs);
    }
}

impl<S: Simd> RayGroup<S> {
    /// Clears the masks of `intersections`. Returns the lanes with a pending hit, if there are any.
    #[inline(always)]
    fn pending_lanes(&self, s: S, intersections: &mut Intersections) -> Option<u32> {
        (intersections.certain, intersections.open) = (0, 0);
        Some(s.mask_bits(s.lt_u(self.pending, s.splat_u(NONE)))).filter(|lanes| *lanes != 0)
    }

    /// Stores the triangles of the pending hits; `kept` are in the cache.
    #[inline(always)]
    fn store_triangles(
        &self,
        s: S,
        lanes: u32,
        (uncached, kept): (S::M, usize),
        cached: &mut CachedHits<'_>,
        intersections: &mut Intersections,
    ) {
        let hit_cache = &*cached.hit_cache;
        for k in 0..3 {
            for c in 0..3 {
                let mut corner = self.corner[c][k];
                if kept > 0 {
                    corner =
                        s.select(uncached, corner, s.lookup(s.load(&hit_cache.corner[c][k]), self.pending));
                }
                s.store(corner, &mut cached.pairs.corner[c][k]);
            }
        }
        let index = s.select_u(uncached, self.index, s.lookup_u(s.load_u(&hit_cache.index), self.pending));
        s.store_u(s.gather_u(s.mask(lanes), cached.ids, index), &mut intersections.triangle);
    }
}

/// Like [`IntersectGroup`], for rays whose lines f32 does not hold.
pub(crate) struct IntersectLines<'a, 'c, S: Simd> {
    pub(crate) group: &'a RayGroup<S>,
    /// Index of the group.
    pub(crate) at: usize,
    pub(crate) cached: &'a mut CachedHits<'c>,
    pub(crate) intersections: &'a mut Intersections,
}

impl<S: Simd> Part<S> for IntersectLines<'_, '_, S> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let IntersectLines { group, at, cached, intersections } = self;
        let Some(lanes) = group.pending_lanes(s, intersections) else { return };
        let mut of_lanes = LineLanes::NONE;
        cached.lines_of(at, &mut of_lanes);
        let uncached = s.eq_u(group.pending, s.splat_u(UNCACHED));
        let kept = cached.hit_cache.kept();
        if kept > 0 && s.mask_bits(uncached) == 0 && cached.compute_for_lines() {
            let (hit_cache, terms, pending) = (&*cached.hit_cache, &*cached.origin_terms, group.pending);
            s.store_u(s.lookup_u(s.load_u(&hit_cache.id), pending), &mut intersections.triangle);
            let of_lane = |i: usize| {
                let direction = of_lanes.direction_of(i);
                (direction, max_norm(direction))
            };
            return if hit_cache.is_at_most_half_full() {
                intersections.compute_from_point::<S, true>(s, lanes, of_lane, terms, pending)
            } else {
                intersections.compute_from_point::<S, false>(s, lanes, of_lane, terms, pending)
            };
        }
        group.store_triangles(s, lanes, (uncached, kept), cached, intersections);
        if cached.exact.is_empty() {
            return intersections.compute_lines(s, lanes, &of_lanes, &cached.pairs.corner);
        }
        let triangles = ExactCorners::of(&cached.exact, &intersections.triangle, lanes);
        intersections.compute_lines(s, lanes, &of_lanes, &triangles);
    }
}
