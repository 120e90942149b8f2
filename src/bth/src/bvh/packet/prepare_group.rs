//! Preparation of sixteen rays of a packet.

use super::bounds::PacketBounds;
use super::ray_group::RayGroup;
use crate::intersect::prepare::{self, MixedAxes};
use crate::intersect::vector::put3;
use crate::rays::Ray;
use crate::simd::{LANES, Lanewise, Part, Simd, lanes_of_piece};
use bth_format::layout::NONE;
use bth_format::object::ObjectBounds;
use std::marker::PhantomData;

impl<S: Simd> RayGroup<S> {
    /// Stores prepared rays of a piece. Returns one bit per ray, set if the ray is usable.
    #[inline(always)]
    fn set_prepared<H: PacketBounds<S>>(
        &mut self,
        p: S::Piece,
        lanes: prepare::PreparedLanes<S::Piece>,
    ) -> u32 {
        put3::<S>(p, &mut self.reciprocal, lanes.reciprocal);
        if !H::COMMON_ORIGIN {
            S::put(p, &mut self.reach, lanes.reach);
            for k in 0..3 {
                S::put_mask(p, &mut self.negative[k], lanes.negative[k]);
            }
            put3::<S>(p, &mut self.near_addend, lanes.near_addend);
            put3::<S>(p, &mut self.far_addend, lanes.far_addend);
        }
        S::put(p, &mut self.scale, lanes.scale);
        S::put(p, &mut self.first, lanes.depths[0]);
        S::put(p, &mut self.limit, lanes.depths[1]);
        for k in 0..2 {
            S::put(p, &mut self.certain[k], lanes.certain[k]);
            S::put(p, &mut self.projection.shear[k], lanes.shear[k]);
        }
        S::put(p, &mut self.projection.forward, lanes.forward);
        if !H::COMMON_ORIGIN {
            for k in 0..2 {
                S::put(p, &mut self.projection.origin[k], lanes.origin[k]);
            }
            S::put(p, &mut self.projection.start, lanes.start);
        }
        p.mask_bits(lanes.usable)
    }
}

/// Prepares the first sixteen of the rays, as a part of kernels; unused lanes repeat the last ray.
/// Its output is false if a ray cannot be prepared in f32.
pub(crate) struct PrepareGroup<'a, S: Simd, H> {
    group: &'a mut RayGroup<S>,
    bounds: &'a ObjectBounds,
    rays: &'a [Ray],
    /// True if origins and directions are needed later on.
    keeps_lines: bool,
    packet: PhantomData<H>,
}

impl<'a, S: Simd, H> PrepareGroup<'a, S, H> {
    #[inline(always)]
    pub(crate) fn of(
        group: &'a mut RayGroup<S>,
        bounds: &'a ObjectBounds,
        rays: &'a [Ray],
        keeps_lines: bool,
    ) -> Self {
        PrepareGroup { group, bounds, rays, keeps_lines, packet: PhantomData }
    }
}

impl<S: Simd, H: PacketBounds<S>> Part<S> for PrepareGroup<'_, S, H> {
    type Output = bool;
    #[inline(always)]
    fn run(self, s: S) -> bool {
        let PrepareGroup { group, bounds, rays, keeps_lines, .. } = self;
        let mut field = match rays.first_chunk() {
            Some(rays) => prepare::load_rays(s, rays),
            None => {
                let mut all = [rays[rays.len() - 1]; LANES];
                all[..rays.len()].copy_from_slice(rays);
                prepare::load_rays(s, &all)
            }
        };
        group.mixed = MixedAxes::of(s, [field[4], field[5], field[6]]);
        group.common = group.mixed.common(s);
        // Only the needed fields are stored, because stores limit the speed of preparation.
        if H::COMMON_ORIGIN {
            for k in 0..3 {
                field[k] = s.splat(rays[0].origin[k]);
            }
        }
        let keeps_lines = keeps_lines && !H::MIXED_OCTANTS;
        if keeps_lines && (!S::INLINES_PARTS || !H::COMMON_ORIGIN) {
            group.origin = [field[0], field[1], field[2]];
        }
        if keeps_lines {
            group.direction = [field[4], field[5], field[6]];
        }
        // Groups are kept from one batch to the next, so hits of an earlier batch are removed here.
        group.nearest = s.splat(f32::INFINITY);
        group.pending = s.splat_u(NONE);
        // `set_prepared` is called in both branches: joining the results first would pass them
        // through memory.
        let mut ready = true;
        for i in 0..S::PIECES {
            let p = s.piece(i);
            let field = prepare::pick_rays::<S>(p, &field);
            let usable = match group.common {
                Some(common) => group.set_prepared::<H>(p, prepare::prepare_lanes(p, bounds, field, &common)),
                None => {
                    let axes = group.mixed.pick(p);
                    group.set_prepared::<H>(p, prepare::prepare_lanes(p, bounds, field, &axes))
                }
            };
            ready &= usable == lanes_of_piece::<S>(i);
        }
        ready
    }
}
