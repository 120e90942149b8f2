//! Tests of the boxes of a node's children against the bounds of a packet, and against its rays.

use super::bounds::PacketBounds;
use super::entry::StackEntry;
use super::ray_group::RayGroup;
use crate::query::Goal;
use crate::simd::{IN_ORDER, LANES, Part, Simd, lanes_of_piece};
use bth_format::layout::{WIDTH, WideNode};
use std::marker::PhantomData;

/// Writes the stack entries of the children of a node that the bounds of the packet overlap before
/// the depth `limit`, the nearest last, as a part of kernels. Its output is their number. Where
/// directions lie in different octants, each entry gets only the rays that may hit its box.
pub(super) struct PacketChildren<'a, S: Simd, H, G> {
    pub(super) bounds: &'a H,
    pub(super) groups: &'a [RayGroup<S>],
    pub(super) rays: u64,
    pub(super) node: (u32, &'a WideNode),
    pub(super) limit: f32,
    pub(super) entries: &'a mut [StackEntry; WIDTH],
    pub(super) goal: G,
}

impl<S: Simd, H: PacketBounds<S>, G: Goal> Part<S> for PacketChildren<'_, S, H, G> {
    type Output = usize;
    #[inline(always)]
    fn run(self, s: S) -> usize {
        let PacketChildren { bounds, groups, rays, node: (parent, node), limit, entries, goal } = self;
        let slots = s.load_u(&IN_ORDER);
        let (bits, keys) = bounds.children(s, node, limit);
        let (mut slot, mut key) = ([0; LANES], [0.0; LANES]);
        let count = if H::is_any(goal) {
            s.compress(bits, slots, &mut slot)
        } else {
            s.compress_far_to_near(bits, keys, slots, &mut slot, &mut key)
        };
        let mut written = 0;
        for i in 0..count {
            let slot = slot[i];
            let rays =
                if H::MIXED_OCTANTS { rays & meeting(s, bounds, groups, rays, node, slot) } else { rays };
            entries[written % WIDTH] = StackEntry { rays, parent, slot, key: key[i] };
            written += usize::from(rays != 0);
        }
        written
    }
}

/// [`meeting`] as a part of kernels: the corners of the child's box, the groups, and the rays that
/// are tested.
struct Meeting<'a, S: Simd, H>([[f32; 3]; 2], &'a [RayGroup<S>], u64, PhantomData<H>);

impl<S: Simd, H: PacketBounds<S>> Part<S> for Meeting<'_, S, H> {
    type Output = u64;
    #[inline(always)]
    fn run(self, s: S) -> u64 {
        let Meeting(corners, groups, rays, _) = self;
        let mut meets = 0;
        for (g, group) in groups.iter().enumerate() {
            for i in 0..S::PIECES {
                if rays >> (g * LANES) & u64::from(lanes_of_piece::<S>(i)) != 0 {
                    let bits = group.piece_may_enter::<H>(s.piece(i), corners);
                    meets |= u64::from(bits) << (g * LANES);
                }
            }
        }
        meets
    }
}

/// The rays that may hit the box of a child, one bit per ray. Only groups with a bit in `rays` are
/// tested.
#[inline(always)]
pub(super) fn meeting<S: Simd, H: PacketBounds<S>>(
    s: S,
    bounds: &H,
    groups: &[RayGroup<S>],
    rays: u64,
    node: &WideNode,
    slot: u32,
) -> u64 {
    rays_meeting::<S, H>(s, groups, rays, bounds.corners(node, slot as usize % WIDTH))
}

/// Like [`meeting`], given the corners of the box ([`PacketBounds::corners`]).
#[inline(always)]
pub(crate) fn rays_meeting<S: Simd, H: PacketBounds<S>>(
    s: S,
    groups: &[RayGroup<S>],
    rays: u64,
    corners: [[f32; 3]; 2],
) -> u64 {
    if !S::INLINES_PARTS {
        return s.call(Meeting(corners, groups, rays, PhantomData::<H>));
    }
    let mut meets = 0;
    for (i, group) in groups.iter().enumerate() {
        if rays >> (i * LANES) & 0xffff != 0 {
            let bits = group.may_enter::<H>(s, corners);
            meets |= u64::from(bits) << (i * LANES);
        }
    }
    meets
}
