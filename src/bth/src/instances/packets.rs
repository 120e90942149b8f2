//! Packets of up to 64 coherent rays in the top level.
//!
//! A packet is traversed once: all instances whose boxes any of its rays may intersect are listed,
//! nearest first, and then visited one after the other. If the list exceeds its limit, the rays are
//! traversed one by one, because most of the listed instances would be occluded by others.

use super::box_tests::limit_lanes;
use super::scene_batch::{BatchProgress, Chunk};
use super::top_level::TopLevel;
use super::top_nodes::INSTANCE;
use super::visit_queue::VisitQueue;
use crate::bvh::packet::backoff::PacketBackoff;
use crate::bvh::packet::bounds::PacketBounds;
use crate::bvh::packet::children::rays_meeting;
use crate::bvh::packet::entry::{GROUPS, MIN_RAYS, PACKET};
use crate::bvh::packet::frustum::{Frustum, FrustumOf};
use crate::bvh::packet::prepare_group::PrepareGroup;
use crate::bvh::packet::ray_group::RayGroup;
use crate::bvh::stack::BOTTOM;
use crate::coherence::{Span, is_same_octant};
use crate::rays::{RAYS_PER_CACHE_LINE, Ray};
use crate::simd::{CacheLevel, LANES, Part, Simd};
use bth_format::layout::WIDTH;
use bth_format::object::ObjectBounds;

/// Max number of instances that a packet lists.
const MAX_INSTANCES: usize = 64;
/// Entries of the stack of nodes; rays that need more are not traced as a packet.
const MAX_STACKED_NODES: usize = 64;

/// An instance whose box is intersected by rays of a packet.
#[derive(Clone, Copy, Debug)]
struct ListedInstance {
    /// Lower bound of the depth at which any of the rays enters the box; a depth is t times the
    /// max |component| of the direction.
    depth: f32,
    instance: u32,
    /// Bit i is set if ray i of the packet intersects the box.
    rays: u64,
}

/// Sorts instances by depth. A separate function, so that it is compiled once for all instruction
/// sets.
#[inline(never)]
fn sort_by_depth(items: &mut [ListedInstance]) {
    items.sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth));
}

/// A packet, and the range of its instances in the list.
#[derive(Clone, Copy, Debug)]
struct TopLevelPacket {
    /// Index of its first ray in the chunk.
    first: u32,
    /// The next instance to be visited, as an index of `items`.
    next: u32,
    /// The end of its instances in `items`.
    end: u32,
    /// Number of its rays.
    count: u32,
    /// For each ray the depth of t = 1.
    scale: [[f32; LANES]; GROUPS],
}

impl TopLevelPacket {
    /// For each ray the max depth of hits that can still change its result, given the answers
    /// so far from its first ray on.
    #[inline(always)]
    fn limits<S: Simd>(&self, s: S, progress: BatchProgress<'_>) -> [S::F; GROUPS] {
        // All are stored before any is loaded, because a vector waits for what was just stored in
        // parts.
        let mut tmax = [[f32::NEG_INFINITY; LANES]; GROUPS];
        for (ray, tmax) in tmax.as_flattened_mut()[..self.count as usize].iter_mut().enumerate() {
            *tmax = progress.tmax(ray);
        }
        let mut limits = [s.splat(0.0); GROUPS];
        for (group, limits) in limits[..self.groups()].iter_mut().enumerate() {
            *limits = limit_lanes(s, s.load(&self.scale[group]), s.load(&tmax[group]));
        }
        limits
    }

    /// Number of groups of sixteen rays.
    #[inline(always)]
    fn groups(&self) -> usize {
        (self.count as usize).div_ceil(LANES).min(GROUPS)
    }
}

/// The packets of a chunk.
#[derive(Debug, Default)]
pub(super) struct TopLevelPackets {
    items: Vec<ListedInstance>,
    packets: Vec<TopLevelPacket>,
    /// Decides after packets with too many instances that the next rays are not tried as packets.
    backoff: PacketBackoff,
}

/// Result of listing the instances of up to 64 rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Listed {
    /// All instances whose boxes the rays may intersect are listed.
    All,
    /// The rays are not coherent.
    Incoherent,
    /// There are too many such instances, or too many nodes to be visited.
    TooMany,
}

impl TopLevelPackets {
    /// Returns true if there are no packets.
    pub(super) fn is_empty(&self) -> bool {
        self.packets.is_empty()
    }

    /// Makes packets of the coherent rays of a chunk, and stores the indices of the other rays in
    /// `rest`.
    #[inline(always)]
    pub(super) fn start<S: Simd>(&mut self, s: S, chunk: &Chunk<'_>, rest: &mut Vec<u32>) {
        let (top, rays) = (chunk.top, chunk.rays);
        self.items.clear();
        self.packets.clear();
        rest.clear();
        let bounds = top.cube;
        let (mut groups, count) = (None, rays.len());
        for (i, rays) in rays.chunks(PACKET).enumerate() {
            if (i + 1) * PACKET < count {
                // The next rays are in the cache when this packet is done.
                let next = rays.as_ptr().wrapping_add(PACKET).cast::<[Ray; RAYS_PER_CACHE_LINE]>();
                s.prefetch_into::<{ PACKET / RAYS_PER_CACHE_LINE }, _>(CacheLevel::waiting(), next);
            }
            let first = (i * PACKET) as u32;
            let begin = self.items.len() as u32;
            let mut listed = Listed::Incoherent;
            if S::HAS_VECTORS
                && rays.len() >= MIN_RAYS
                && is_same_octant(&rays[0], &rays[rays.len() - 1])
                && self.backoff.may_try()
            {
                let groups = groups.get_or_insert_with(|| [RayGroup::vacant(s); GROUPS]);
                listed = self.list(s, top, &bounds, groups, rays);
                if listed != Listed::Incoherent {
                    self.backoff.record(listed == Listed::All);
                }
            }
            if listed == Listed::All {
                let mut scale = [[0.0; LANES]; GROUPS];
                for (scale, group) in scale.iter_mut().zip(groups.iter().flatten()) {
                    s.store(group.scale, scale);
                }
                let (count, end) = (rays.len() as u32, self.items.len() as u32);
                self.packets.push(TopLevelPacket { first, next: begin, end, count, scale });
            } else {
                self.items.truncate(begin as usize);
                rest.extend(first..first + rays.len() as u32);
            }
        }
    }

    /// Lists the instances whose boxes up to 64 rays may intersect, nearest first.
    #[inline(always)]
    fn list<S: Simd>(
        &mut self,
        s: S,
        top: &TopLevel,
        bounds: &ObjectBounds,
        groups: &mut [RayGroup<S>; GROUPS],
        rays: &[Ray],
    ) -> Listed {
        let span = Span::of(s, rays);
        if top.is_empty() || !span.is_coherent() || span.farthest_origin() > top.reach {
            return Listed::Incoherent;
        }
        let groups = &mut groups[..rays.len().div_ceil(LANES)];
        for (i, group) in groups.iter_mut().enumerate() {
            let end = rays.len().min((i + 1) * LANES);
            let rays = &rays[i * LANES..end];
            if !PrepareGroup::<S, Frustum<S, false>>::of(group, bounds, rays, true).inline_or_share(s) {
                return Listed::Incoherent;
            }
        }
        let frustum = FrustumOf::<S, false> { bounds, span: &span, groups }.inline_or_share(s);
        let all = u64::MAX >> (PACKET - rays.len());
        let begin = self.items.len();
        let (nodes, mut stack) = (top.nodes(), [0; MAX_STACKED_NODES]);
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = nodes.node(stack[count]);
            let (mut bits, depth) = frustum.children(s, node, f32::INFINITY);
            let mut depths = [0.0; WIDTH];
            s.store(depth, &mut depths);
            while bits != 0 {
                let slot = bits.trailing_zeros() as usize % WIDTH;
                bits &= bits - 1;
                let code = node.child[slot];
                if code >= BOTTOM {
                    continue;
                }
                let corners = frustum.corners(node, slot);
                let rays = rays_meeting::<S, Frustum<S, false>>(s, groups, all, corners) & all;
                if rays == 0 {
                    continue;
                }
                if code & INSTANCE != 0 {
                    if self.items.len() - begin == MAX_INSTANCES {
                        return Listed::TooMany;
                    }
                    self.items.push(ListedInstance { depth: depths[slot], instance: code & !INSTANCE, rays });
                } else {
                    if count == MAX_STACKED_NODES {
                        return Listed::TooMany;
                    }
                    stack[count] = code;
                    count += 1;
                }
            }
        }
        sort_by_depth(&mut self.items[begin..]);
        Listed::All
    }

    /// Advances each packet to the next instance whose box any of its rays may still intersect, and
    /// queues the visits. Packets without a further instance are removed. `first_ray` is added to
    /// the index of the ray of a visit.
    #[inline(always)]
    pub(super) fn advance<S: Simd>(
        &mut self,
        s: S,
        progress: BatchProgress<'_>,
        first_ray: u32,
        visits: &mut VisitQueue,
    ) {
        let TopLevelPackets { items, packets, .. } = self;
        let mut kept = 0;
        for i in 0..packets.len() {
            let packet = &mut packets[i];
            if packet.next == packet.end {
                continue;
            }
            let (first, groups) = (packet.first as usize, packet.groups());
            let limits = packet.limits(s, progress.of_rays_from(first));
            while packet.next < packet.end {
                let item = items[packet.next as usize];
                packet.next += 1;
                let mut entering = 0;
                for (group, limits) in limits[..groups].iter().enumerate() {
                    let bits = s.mask_bits(s.le(s.splat(item.depth), *limits));
                    entering |= u64::from(bits) << (group * LANES);
                }
                entering &= item.rays;
                if entering != 0 {
                    visits.push_run(s, first_ray + packet.first, entering, item.instance);
                    packets[kept] = packets[i];
                    kept += 1;
                    break;
                }
            }
        }
        packets.truncate(kept);
    }
}
