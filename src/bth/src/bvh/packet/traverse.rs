//! Traversal of the wide BVH by a packet of up to 64 rays.
//!
//! The sixteen children of a node are tested against the bounds of all rays ([`super::bounds`]),
//! and those that remain against the rays, sixteen at a time. Triangles are decided as for single
//! rays: the f32 filter excludes those that are certainly missed; one that is certainly hit, and
//! certainly nearer than all before, becomes the ray's pending hit, which is computed at the end;
//! the others are decided at once ([`crate::bvh::candidate`]).

use super::bounds::PacketBounds;
use super::buffers::PacketBuffers;
use super::children::{PacketChildren, meeting};
use super::entry::{GROUPS, PACKET};
use super::frustum::Frustum;
use super::hit_cache::CachedHits;
use super::packet_rays::PacketRays;
use super::ray_group::{IntersectGroup, IntersectLines, RayGroup};
use super::single_rays::FEW_OF_PACKET;
use crate::bvh::nodes::{Leaf, LeafMemory, leaf, prefetch_into};
use crate::bvh::ray_state::key_limit;
use crate::intersect::exact_lanes::{Intersections, OriginTermsLanes, Pairs};
use crate::query::sink::Sink;
use crate::query::{Goal, RayQuery};
use crate::rays::Ray;
use crate::simd::{CacheLevel, LANES, Part, Simd};
use bth_format::layout::{Child, WIDTH};
use bth_format::object::ObjectView;
use std::marker::PhantomData;

/// The state of a packet: its prepared rays, their queries and its memory. One value serves all
/// packets of a batch.
pub(crate) struct PacketTracer<'a, S: Simd, G> {
    pub(super) goal: G,
    pub(crate) groups: &'a mut [RayGroup<S>; GROUPS],
    pub(super) queries: [RayQuery<G>; PACKET],
    pub(crate) buffers: &'a mut PacketBuffers,
}

/// Result of the traversal of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PacketOutcome {
    /// The packet was traced; the value is the average share of its rays that took part in a step,
    /// in per cent.
    Lanes(u32),
    /// The packet reached something that only single rays support. No answer has been stored.
    Refused,
}

/// Traces the rays for which the groups have been prepared, and stores the answers of those that
/// hit something. It is a part of kernels, so that the variables of packets with one kind of bounds
/// are not in the way of others.
pub(super) struct TracePacket<'p, 'a, 's, S: Simd, G: Goal, H> {
    pub(super) packets: &'p mut PacketTracer<'a, S, G>,
    pub(super) object: &'p ObjectView<'p>,
    pub(super) bounds: &'p H,
    pub(super) rays: &'p [Ray],
    pub(super) sink: &'p mut Sink<'s>,
}

impl<S: Simd, G: Goal, H: PacketBounds<S>> Part<S> for TracePacket<'_, '_, '_, S, G, H> {
    type Output = PacketOutcome;
    /// This is longer than other functions: all steps share code, mask, limit and the top of the
    /// stack.
    #[inline(always)]
    fn run(self, s: S) -> PacketOutcome {
        let TracePacket { packets, object, bounds, rays, sink } = self;
        let PacketTracer { groups, goal, queries, buffers } = packets;
        let goal = *goal;
        let PacketBuffers {
            stack,
            points,
            relative,
            single_rays,
            hit_cache,
            origin_terms,
            pairs,
            intersections,
            own,
        } = &mut **buffers;
        let groups = &mut groups[..rays.len().div_ceil(LANES)];
        let all = u64::MAX >> (PACKET - rays.len());
        single_rays.clear();
        let lines = sink.lines();
        let mut rays = PacketRays {
            object,
            rays,
            goal,
            queries,
            single_rays,
            hit_cache,
            queried: 0,
            alive: all,
            lines,
            have_starts: lines.have_starts(),
            own,
        };
        if rays.have_starts {
            for ray in 0..rays.rays.len() {
                let [leaf, slot] = &mut rays.own[ray / LANES % GROUPS];
                (leaf[ray % LANES], slot[ray % LANES]) = lines.own(ray).into();
            }
        }
        if let Some(group) = groups.last_mut() {
            // Lanes without a ray get the smallest limit, so that they never keep a child or a
            // triangle.
            let valid = s.mask((all >> ((rays.rays.len() - 1) / LANES * LANES)) as u32);
            group.limit = s.select(valid, group.limit, s.splat(f32::MIN));
        }
        let mut limit = farthest_limit(s, groups);
        let (mut code, mut mask, mut top) = (object.header.root, all, 0);
        let (mut steps, mut used) = (0u32, 0);
        'steps: loop {
            steps += 1;
            used += mask.count_ones();
            let mut memory = LeafMemory::default();
            let reached = if code & Child::LEAF_BIT == 0 {
                let node = object.node(code);
                let entries =
                    stack[top..].first_chunk_mut().expect("the BVH is no deeper than its header says");
                top += if H::MIXED_OCTANTS && mask.count_ones() <= FEW_OF_PACKET {
                    rays.single_rays.children(s, groups, mask, (code, node), entries)
                } else {
                    let (rays, node) = (mask, (code, node));
                    PacketChildren { bounds, groups, rays, node, limit, entries, goal }.inline_or_call(s)
                };
                None
            } else {
                match leaf(s, object, object.node_base(), code, &mut memory) {
                    Leaf::Indexed(block) => rays.reached(s, bounds, groups, (block, code), mask),
                    Leaf::Raw(block) => rays.reached(s, bounds, groups, (block, code), mask),
                    Leaf::Special(_) => return PacketOutcome::Refused,
                    Leaf::None => None,
                }
            };
            if let Some(reached) = reached
                && rays.enter_triangles(s, bounds, groups, (points, relative), reached)
                && !H::is_any(goal)
            {
                limit = farthest_limit(s, groups);
            }
            if rays.alive == 0 {
                break;
            }
            loop {
                if top == 0 {
                    break 'steps;
                }
                top -= 1;
                let entry = stack[top];
                mask = entry.rays & rays.alive;
                if mask == 0 || (!H::is_any(goal) && entry.key > key_limit(limit)) {
                    continue;
                }
                let node = object.node(entry.parent);
                code = node.child[entry.slot as usize % WIDTH];
                prefetch_into(s, CacheLevel::waiting(), object.node_base(), code);
                // The rays are tested against the box only here, because hits since the parent was
                // entered may have shortened them.
                if !H::MIXED_OCTANTS {
                    mask &= meeting(s, bounds, groups, mask, node, entry.slot);
                }
                if mask != 0 {
                    break;
                }
            }
        }
        let found = HitBuffers { origin_terms, pairs, intersections };
        finish::<S, H, G>(s, groups, found, &mut rays, all, sink);
        let steps = u64::from(steps);
        PacketOutcome::Lanes((u64::from(used) * 100 / (steps * rays.rays.len() as u64)) as u32)
    }
}

/// Memory for the computation of the pending hits.
struct HitBuffers<'b> {
    origin_terms: &'b mut OriginTermsLanes,
    pairs: &'b mut Pairs,
    intersections: &'b mut [Intersections; GROUPS],
}

/// Computes the pending hits, and stores the answers of all rays that hit something.
#[inline(always)]
fn finish<S: Simd, H: PacketBounds<S>, G: Goal>(
    s: S,
    groups: &[RayGroup<S>],
    HitBuffers { origin_terms, pairs, intersections }: HitBuffers<'_>,
    rays: &mut PacketRays<'_, G>,
    all: u64,
    sink: &mut Sink<'_>,
) {
    if H::is_any(rays.goal) {
        let mut hit = all & !rays.alive;
        while hit != 0 {
            sink.accepted(hit.trailing_zeros() as usize);
            hit &= hit - 1;
        }
        return;
    }
    // All groups are computed before any answer is stored, so that the divisions of one group
    // overlap with the next.
    let mut cached = CachedHits {
        origin: rays.rays[0].origin,
        ids: rays.object.triangle_ids,
        exact: rays.object.exact,
        hit_cache: rays.hit_cache,
        origin_terms,
        pairs,
        rays: rays.rays,
        lines: rays.lines,
        has_common_origin: true,
    };
    for (at, (group, intersections)) in groups.iter().zip(&mut *intersections).enumerate() {
        let cached = &mut cached;
        if !cached.lines.are_rays() {
            s.call(IntersectLines { group, at, cached, intersections });
        } else if !S::INLINES_PARTS {
            // Every ray has its origin, so one part serves all packets.
            let packet = PhantomData::<Frustum<S, false>>;
            IntersectGroup { group, cached, intersections, packet }.inline_or_call(s);
        } else {
            let packet = PhantomData::<H>;
            IntersectGroup { group, cached, intersections, packet }.inline_or_call(s);
        }
    }
    for (i, (group, intersections)) in groups.iter().zip(intersections.iter()).enumerate() {
        let queried = (rays.queried >> (i * LANES)) as u32 & 0xffff;
        let clear = intersections.certain & !queried;
        if clear != 0 {
            sink.hits(s, i * LANES, clear, intersections);
        }
        let open = intersections.open | intersections.certain & queried;
        if open != 0 {
            rays.settle_last(s, group, i, open);
        }
    }
    // The rays with a decision in f64.
    let mut queried = rays.queried;
    while queried != 0 {
        let ray = queried.trailing_zeros() as usize;
        queried &= queried - 1;
        sink.query(ray, &rays.queries[ray]);
    }
}

/// The largest limit of all rays.
#[inline(always)]
fn farthest_limit<S: Simd>(s: S, groups: &[RayGroup<S>]) -> f32 {
    let mut farthest = groups[0].limit;
    for group in groups {
        farthest = s.max(farthest, group.limit);
    }
    -s.least(s.sub(s.splat(0.0), farthest))
}
