//! Packets of up to 64 coherent rays in the top level.
//!
//! A packet is traversed once: all instances whose boxes any of its rays may meet are listed, nearest first, and then visited one
//! after the other. If the list grows too long, most of its instances are hidden by others, and the rays are traversed singly.

use super::top_level::{INSTANCE, TopLevel};
use super::traverse::limit;
use crate::bvh::packet::bounds::PacketBounds;
use crate::bvh::packet::coherence::{Guard, Span, is_same_octant};
use crate::bvh::packet::entry::PACKET;
use crate::bvh::packet::frustum::Frustum;
use crate::bvh::packet::ray_group::RayGroup;
use crate::bvh::stack::BOTTOM;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;
use bth_format::object::ObjectBounds;

/// Groups of sixteen rays in a packet.
const GROUPS: usize = PACKET / LANES;
/// Least number of rays of a packet.
const MIN_RAYS: usize = 2 * LANES;
/// Greatest number of instances that a packet lists.
const MAX_INSTANCES: usize = 64;
/// Entries of the stack of nodes; rays that need more are not traced as a packet.
const MAX_STACKED_NODES: usize = 64;

/// An instance whose box rays of a packet may meet.
#[derive(Clone, Copy, Debug)]
struct Item {
    /// Lower bound of the depth at which any of the rays enters the box; a depth is t times the greatest |component| of the direction.
    depth: f32,
    instance: u32,
    /// A bit for each of these rays.
    rays: u64,
}

/// A packet with its range of the listed instances.
#[derive(Clone, Copy, Debug)]
struct Packet {
    /// Index of its first ray in the chunk.
    first: u32,
    /// The next instance to be visited, as an index of `items`.
    next: u32,
    /// The end of its instances in `items`.
    end: u32,
}

/// The packets of a chunk.
#[derive(Debug, Default)]
pub(super) struct Packets {
    items: Vec<Item>,
    packets: Vec<Packet>,
    /// After a packet with too many instances, the next few groups of rays are not tried as packets.
    guard: Guard,
}

/// Result of listing the instances of up to 64 rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Listed {
    /// All instances that the rays may meet are listed.
    All,
    /// The rays are not coherent.
    Incoherent,
    /// The rays may meet too many instances.
    TooMany,
}

impl Packets {
    /// Whether there are no packets.
    pub(super) fn is_empty(&self) -> bool {
        self.packets.is_empty()
    }

    /// Makes packets of coherent rays, and stores the indices of the other rays in `rest`.
    #[inline(always)]
    pub(super) fn start<S: Simd>(&mut self, s: S, top: &TopLevel, rays: &[Ray], rest: &mut Vec<u32>) {
        self.items.clear();
        self.packets.clear();
        rest.clear();
        let bounds = ObjectBounds::around(top.farthest());
        let mut groups = None;
        for (i, rays) in rays.chunks(PACKET).enumerate() {
            let first = (i * PACKET) as u32;
            let begin = self.items.len() as u32;
            let mut listed = Listed::Incoherent;
            if S::HAS_VECTORS
                && rays.len() >= MIN_RAYS
                && is_same_octant(&rays[0], &rays[rays.len() - 1])
                && self.guard.is_open()
            {
                let groups = groups.get_or_insert_with(|| [RayGroup::vacant(s); GROUPS]);
                listed = self.list(s, top, &bounds, groups, rays);
                if listed != Listed::Incoherent {
                    self.guard.record(listed == Listed::All);
                }
            }
            if listed == Listed::All {
                self.packets.push(Packet { first, next: begin, end: self.items.len() as u32 });
            } else {
                self.items.truncate(begin as usize);
                rest.extend(first..first + rays.len() as u32);
            }
        }
    }

    /// Lists the instances that up to 64 rays may meet.
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
            if !group.prepare::<Frustum<S, false>>(s, bounds, &rays[i * LANES..end]) {
                return Listed::Incoherent;
            }
        }
        let frustum = Frustum::<S, false>::new(s, bounds, &span, groups);
        let all = u64::MAX >> (PACKET - rays.len());
        let begin = self.items.len();
        let mut stack = [0; MAX_STACKED_NODES];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = top.node(stack[count]);
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
                let mut met = 0;
                for (i, group) in groups.iter().enumerate() {
                    met |= u64::from(group.meets::<Frustum<S, false>>(s, corners)) << (i * LANES);
                }
                let rays = met & all;
                if rays == 0 {
                    continue;
                }
                if code & INSTANCE != 0 {
                    if self.items.len() - begin == MAX_INSTANCES {
                        return Listed::TooMany;
                    }
                    self.items.push(Item { depth: depths[slot], instance: code & !INSTANCE, rays });
                } else {
                    if count == MAX_STACKED_NODES {
                        return Listed::TooMany;
                    }
                    stack[count] = code;
                    count += 1;
                }
            }
        }
        self.items[begin..].sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth));
        Listed::All
    }

    /// Advances each packet to the next instance that any of its rays may meet, and calls `visit` with the index of each such ray and
    /// the instance. `tmax` is as for [`RayTraversals::advance`](super::traverse::RayTraversals::advance). Packets without a further
    /// instance are removed.
    #[inline(always)]
    pub(super) fn advance(
        &mut self,
        rays: &[Ray],
        tmax: impl Fn(usize) -> Option<f32>,
        mut visit: impl FnMut(usize, u32),
    ) {
        let items = &self.items;
        self.packets.retain_mut(|packet| {
            let mut any = false;
            while !any && packet.next < packet.end {
                let item = items[packet.next as usize];
                packet.next += 1;
                let mut bits = item.rays;
                while bits != 0 {
                    let number = packet.first as usize + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let Some(tmax) = tmax(number) else { continue };
                    let [x, y, z] = rays[number].direction;
                    if item.depth <= limit(x.abs().max(y.abs()).max(z.abs()), tmax) {
                        visit(number, item.instance);
                        any = true;
                    }
                }
            }
            any
        });
    }
}
