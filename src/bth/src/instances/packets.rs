//! Rays that go together through the top level: one way for up to 64 of them.
//!
//! A packet lists at once all instances whose boxes any of its rays may meet, nearest first, and visits them one after the
//! other. In scenes where it would meet many, most are hidden by others, and its rays go alone.

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
/// Fewer rays make no packet.
const FEWEST: usize = 2 * LANES;
/// Instances that a packet lists at most.
const MOST_INSTANCES: usize = 64;
/// Nodes that wait at most; a packet that needs more is none.
const MOST_NODES: usize = 64;

/// An instance that rays of a packet may meet.
#[derive(Clone, Copy, Debug)]
struct Item {
    /// Lower bound of the depth at which any of them enters its box: t in units of the greatest component of the direction.
    depth: f32,
    instance: u32,
    /// Which of them, a bit each.
    rays: u64,
}

/// A packet on its way.
#[derive(Clone, Copy, Debug)]
struct Packet {
    /// Number of its first ray.
    first: u32,
    /// The items still to be visited.
    next: u32,
    end: u32,
}

/// Packets on their way.
#[derive(Debug, Default)]
pub(super) struct Packets {
    items: Vec<Item>,
    packets: Vec<Packet>,
    /// After a packet that met too many instances, the next few runs of rays are not tried.
    guard: Guard,
}

/// What became of a run of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Listed {
    /// All instances that it may meet are listed.
    All,
    /// The rays do not go together.
    UncachedHits,
    /// There are too many.
    TooMany,
}

impl Packets {
    /// Whether none is on its way.
    pub(super) fn is_empty(&self) -> bool {
        self.packets.is_empty()
    }

    /// Starts packets of those rays that go together, and puts the numbers of the others into `rest`.
    #[inline(always)]
    pub(super) fn start<S: Simd>(&mut self, s: S, top: &TopLevel, rays: &[Ray], rest: &mut Vec<u32>) {
        self.items.clear();
        self.packets.clear();
        rest.clear();
        let bounds = ObjectBounds::around(top.farthest());
        let mut groups = None;
        for (i, own) in rays.chunks(PACKET).enumerate() {
            let first = (i * PACKET) as u32;
            let begin = self.items.len() as u32;
            let mut listed = Listed::UncachedHits;
            if S::HAS_VECTORS
                && own.len() >= FEWEST
                && is_same_octant(&own[0], &own[own.len() - 1])
                && self.guard.is_open()
            {
                let groups = groups.get_or_insert_with(|| [RayGroup::vacant(s); GROUPS]);
                listed = self.list(s, top, &bounds, groups, own);
                if listed != Listed::UncachedHits {
                    self.guard.learn(listed == Listed::All);
                }
            }
            if listed == Listed::All {
                self.packets.push(Packet { first, next: begin, end: self.items.len() as u32 });
            } else {
                self.items.truncate(begin as usize);
                rest.extend(first..first + own.len() as u32);
            }
        }
    }

    /// Lists the instances that rays may meet.
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
            return Listed::UncachedHits;
        }
        let groups = &mut groups[..rays.len().div_ceil(LANES)];
        for (i, group) in groups.iter_mut().enumerate() {
            let end = rays.len().min((i + 1) * LANES);
            if !group.prepare::<Frustum<S, false>>(s, bounds, &rays[i * LANES..end]) {
                return Listed::UncachedHits;
            }
        }
        let frustum = Frustum::<S, false>::new(s, bounds, &span, groups);
        let all = u64::MAX >> (PACKET - rays.len());
        let begin = self.items.len();
        let mut waiting = [0; MOST_NODES];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = top.node(waiting[count]);
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
                let mut hit_cache = 0;
                for (i, group) in groups.iter().enumerate() {
                    hit_cache |= u64::from(group.meets::<Frustum<S, false>>(s, corners)) << (i * LANES);
                }
                let rays = hit_cache & all;
                if rays == 0 {
                    continue;
                }
                if code & INSTANCE != 0 {
                    if self.items.len() - begin == MOST_INSTANCES {
                        return Listed::TooMany;
                    }
                    self.items.push(Item { depth: depths[slot], instance: code & !INSTANCE, rays });
                } else {
                    if count == MOST_NODES {
                        return Listed::TooMany;
                    }
                    waiting[count] = code;
                    count += 1;
                }
            }
        }
        self.items[begin..].sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth));
        Listed::All
    }

    /// Takes packets on to the next instance that any of their rays may meet at a t that, rounded to f32, is at most that
    /// which `tmax` gives for its number, if it gives one. `arrive` takes numbers and instances.
    #[inline(always)]
    pub(super) fn advance(
        &mut self,
        rays: &[Ray],
        tmax: impl Fn(usize) -> Option<f32>,
        mut arrive: impl FnMut(usize, u32),
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
                        arrive(number, item.instance);
                        any = true;
                    }
                }
            }
            any
        });
    }
}
