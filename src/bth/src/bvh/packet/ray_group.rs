//! Sixteen rays of a packet, a lane each.
//!
//! What [`crate::intersect::boxes`] and [`crate::intersect::filter`] do for one ray and sixteen boxes or triangles, here for sixteen rays and
//! one box or triangle: the same operations on the same prepared floats ([`crate::intersect::prepare`]), so the same bounds hold.

use super::bounds::PacketBounds;
use super::hit_cache::{CachedHits, UNCACHED};
use super::leaf_mesh::Leaf;
use super::projection::Projection;
use crate::intersect::exact_lanes::{Intersections, Pairs};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::prepare::{self, Axes, CommonAxis, MixedAxes};
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectBounds;

/// Sixteen rays, and what they have found.
#[derive(Clone, Copy)]
pub(crate) struct RayGroup<S: Simd> {
    pub(crate) origin: [S::F; 3],
    pub(crate) direction: [S::F; 3],
    pub(crate) reciprocal: [S::F; 3],
    near_addend: [S::F; 3],
    far_addend: [S::F; 3],
    /// Rays that go down along each axis.
    negative: [S::M; 3],
    /// Depth of t = 1.
    pub(crate) scale: S::F,
    /// Nothing whose depth is certainly less than this matters,
    pub(crate) first: S::F,
    /// or certainly exceeds this.
    pub(crate) limit: S::F,
    /// Greatest coordinate of the object's box, seen from the origin.
    pub(crate) reach: S::F,
    pub(crate) mixed: MixedAxes<S>,
    /// The axis along the rays, if it is the same for all.
    pub(crate) common: Option<CommonAxis>,
    pub(crate) projection: Projection<S>,
    /// From which to which depth hits are certainly in range.
    pub(crate) certain: [S::F; 2],
    /// Lower bound of the depth of the nearest hit so far.
    pub(crate) nearest: S::F,
    /// The triangle of the nearest hit so far if it is still to be computed, else `NONE`: its number among those of the
    /// packet ([`HitCache`]), or [`UNCACHED`].
    pub(crate) waiting: S::U,
    /// Of one that is kept apart the leaf,
    pub(crate) leaf: S::U,
    /// the triangle within,
    pub(crate) triangle: S::U,
    /// its place in leaf order and corners (`[corner][axis]`).
    place: S::U,
    corner: [[S::F; 3]; 3],
}

impl<S: Simd> RayGroup<S> {
    /// A place for rays.
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
            waiting: none,
            leaf: none,
            triangle: none,
            place: none,
            corner: [[zero; 3]; 3],
        }
    }

    /// A triangle is certainly the nearest hit so far of these lanes, between these depths.
    #[inline(always)]
    pub(crate) fn accept(&mut self, s: S, m: S::M, depth: [S::F; 2], number: u32) {
        self.nearest = s.select(m, depth[0], self.nearest);
        self.limit = s.select(m, depth[1], self.limit);
        self.waiting = s.select_u(m, s.splat_u(number), self.waiting);
    }

    /// What is to be known of it to compute the hit, if the packet does not keep it.
    #[inline(always)]
    pub(crate) fn keep<B: TriangleBlock>(&mut self, s: S, m: S::M, leaf: &Leaf<'_, B>, triangle: u32) {
        self.leaf = s.select_u(m, s.splat_u(leaf.code), self.leaf);
        self.triangle = s.select_u(m, s.splat_u(triangle), self.triangle);
        self.place = s.select_u(m, s.splat_u(leaf.block.first() + triangle), self.place);
        for c in 0..3 {
            for k in 0..3 {
                // Each straight from the leaf: through an array, what was written in words would be read as more.
                let x = s.splat(leaf.block.coordinate(triangle as usize, c, k));
                self.corner[c][k] = s.select(m, x, self.corner[c][k]);
            }
        }
    }

    /// Prepares the first sixteen of rays; the last fills up lanes that are too many. False if one of them can't be
    /// prepared.
    #[inline(always)]
    pub(crate) fn prepare<H: PacketBounds<S>>(&mut self, s: S, bounds: &ObjectBounds, rays: &[Ray]) -> bool {
        let mut field = match rays.first_chunk() {
            Some(rays) => prepare::load_rays(s, rays),
            None => {
                let mut all = [rays[rays.len() - 1]; LANES];
                all[..rays.len()].copy_from_slice(rays);
                prepare::load_rays(s, &all)
            }
        };
        self.mixed = MixedAxes::of(s, [field[4], field[5], field[6]]);
        self.common = self.mixed.common(s);
        // Not one store more than there must be: they are what preparing waits for.
        if H::FROM_POINT {
            for k in 0..3 {
                field[k] = s.splat(rays[0].origin[k]);
            }
        } else if !H::MIXED {
            self.origin = [field[0], field[1], field[2]];
        }
        if !H::MIXED {
            self.direction = [field[4], field[5], field[6]];
        }
        // Groups are kept from batch to batch: what an earlier one found, of another object maybe, must not be taken up.
        self.nearest = s.splat(f32::INFINITY);
        self.waiting = s.splat_u(NONE);
        // Each taken over where it is made: merged first, they would all pass through memory once more.
        match self.common {
            Some(common) => self.take::<H>(s, prepare::prepare_lanes(s, bounds, field, &common)),
            None => self.take::<H>(s, prepare::prepare_lanes(s, bounds, field, &self.mixed)),
        }
    }

    /// Takes over what rays are prepared to; false if one of them can't be prepared.
    #[inline(always)]
    fn take<H: PacketBounds<S>>(&mut self, s: S, lanes: prepare::PreparedLanes<S>) -> bool {
        self.reciprocal = lanes.reciprocal;
        if !H::FROM_POINT {
            self.reach = lanes.reach;
            self.negative = lanes.negative;
            self.near_addend = lanes.near_addend;
            self.far_addend = lanes.far_addend;
        }
        self.scale = lanes.scale;
        [self.first, self.limit] = lanes.depths;
        self.certain = lanes.certain;
        let prepare::PreparedLanes { origin, shear, forward, start, .. } = lanes;
        (self.projection.shear, self.projection.forward) = (shear, forward);
        if !H::FROM_POINT {
            (self.projection.origin, self.projection.start) = (origin, start);
        }
        s.mask_bits(lanes.usable) == 0xffff
    }

    /// What the rays are prepared to, where they do not start at one point.
    #[inline(always)]
    pub(crate) fn lanes(&self, s: S) -> prepare::PreparedLanes<S> {
        prepare::PreparedLanes {
            reciprocal: self.reciprocal,
            near_addend: self.near_addend,
            far_addend: self.far_addend,
            negative: self.negative,
            scale: self.scale,
            depths: [self.first, self.limit],
            certain: self.certain,
            axis: self.mixed.axes(s),
            origin: self.projection.origin,
            shear: self.projection.shear,
            forward: self.projection.forward,
            start: self.projection.start,
            reach: self.reach,
            usable: s.mask(0xffff),
        }
    }

    /// The rays that may meet a box within their range. Where all go into the same octant ([`PacketBounds::MIXED`] is false) the corners
    /// are that at which they enter and the one at which they leave, else the lower and the upper one.
    #[inline(always)]
    pub(crate) fn meets<H: PacketBounds<S>>(&self, s: S, corners: [[f32; 3]; 2]) -> u32 {
        let (mut enter, mut leave) = (self.first, self.limit);
        for k in 0..3 {
            let (mut near, mut far) = (s.splat(corners[0][k]), s.splat(corners[1][k]));
            if H::MIXED {
                (near, far) = (s.select(self.negative[k], far, near), s.select(self.negative[k], near, far));
            }
            (near, far) = if H::FROM_POINT {
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
        s.mask_bits(s.le(enter, leave))
    }

    /// Computes where rays cross the triangles that wait to be computed; if none does, it is only said so.
    #[inline(always)]
    pub(crate) fn intersect<H: PacketBounds<S>>(
        &self,
        s: S,
        cached: &mut CachedHits<'_>,
        intersections: &mut Intersections,
    ) {
        let some = s.mask_bits(s.lt_u(self.waiting, s.splat_u(NONE)));
        (intersections.certain, intersections.open) = (0, 0);
        if some == 0 {
            return;
        }
        let apart = s.eq_u(self.waiting, s.splat_u(UNCACHED));
        // Known where this is compiled, of most.
        let kept = if H::FROM_POINT && S::HAS_FAST_F64_LOOKUP { cached.hit_cache.kept() } else { 0 };
        if kept > 0 && s.mask_bits(apart) == 0 {
            cached.compute();
            let (hit_cache, seen) = (&*cached.hit_cache, &*cached.seen);
            let (mut direction, mut size) = ([[0.0; LANES]; 3], [0.0; LANES]);
            for k in 0..3 {
                s.store(self.direction[k], &mut direction[k]);
            }
            s.store(self.scale, &mut size);
            s.store_u(s.lookup_u(s.load_u(&hit_cache.id), self.waiting), &mut intersections.triangle);
            let waiting = self.waiting;
            return if hit_cache.are_few() {
                intersections.compute_from_point::<S, true>(s, some, &direction, &size, seen, waiting)
            } else {
                intersections.compute_from_point::<S, false>(s, some, &direction, &size, seen, waiting)
            };
        }
        let (hit_cache, ids) = (&*cached.hit_cache, cached.ids);
        let mut pairs = Pairs::NONE;
        for k in 0..3 {
            let origin = if H::FROM_POINT { s.splat(cached.origin[k]) } else { self.origin[k] };
            s.store(origin, &mut pairs.origin[k]);
            s.store(self.direction[k], &mut pairs.direction[k]);
            for c in 0..3 {
                let mut corner = self.corner[c][k];
                if kept > 0 {
                    corner = s.select(apart, corner, s.lookup(s.load(&hit_cache.corner[c][k]), self.waiting));
                }
                s.store(corner, &mut pairs.corner[c][k]);
            }
        }
        let place = s.select_u(apart, self.place, s.lookup_u(s.load_u(&hit_cache.place), self.waiting));
        s.store_u(s.gather_u(s.mask(some), ids, place), &mut intersections.triangle);
        intersections.compute(s, some, &pairs);
    }
}
