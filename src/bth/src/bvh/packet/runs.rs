//! Which rays of a batch go in packets: runs of neighbours that go together, as long as packets serve enough of their rays.

use super::bounds::PacketBounds;
use super::coherence::{Guard, Span, is_same_octant};
use super::entry::PACKET;
use super::frustum::Frustum;
use super::packet::{GroupStorage, PacketBuffers, PacketOutcome, Packets};
use super::segment_box::SegmentBox;
use crate::query::Query;
use crate::query::sink::Sink;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectBounds;
use bth_format::object::ObjectView;

/// Rays in a line of the cache.
const RAYS_PER_CACHE_LINE: usize = 64 / size_of::<Ray>();
/// Fewer rays make no packet.
const FEWEST: usize = 2 * LANES;

/// Per cent of its rays that a step of a packet must serve on average: with less, one ray at a time is faster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MinimumUse {
    pub(crate) coherent: u32,
    pub(crate) short: u32,
}

/// By measurement.
pub(crate) const MINIMUM_USE: MinimumUse = MinimumUse { coherent: 10, short: 8 };

/// Memory kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    groups: GroupStorage,
    buffers: PacketBuffers,
    /// Places of the rays that are left.
    pub(crate) rest: Vec<u32>,
}

/// How many rays went in packets, and how many packets served too few of theirs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PacketCount {
    pub(crate) rays: usize,
    pub(crate) coherent: usize,
    pub(crate) short: usize,
    pub(crate) poor: usize,
}

/// Traces those rays of a batch that are better traced in packets, and leaves the others in `scratch.rest`, unless it does
/// not try at all. Hands on places and queries of rays that hit something.
#[inline(always)]
pub(crate) fn trace<S: Simd, Q: Query>(
    s: S,
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut PacketScratch,
    least: MinimumUse,
    to: &mut Sink<'_, Q>,
) -> PacketCount {
    let mut count = PacketCount::default();
    // Where tetrahedra have no subtree beside them, and through packed nodes, rays go alone.
    if rays.len() < FEWEST
        || object.has_packed_nodes()
        || object.tet_leaves.first().is_some_and(|leaf| leaf.subtree == NONE)
    {
        return count;
    }
    let bounds = object.bounds;
    let PacketScratch { groups, buffers, rest } = scratch;
    rest.clear();
    let mut runs = Runs { bounds: &bounds, rays, at: 0, coherent: Guard::new(), short: Guard::new(), rest };
    // The first apart, so that the packets are made where they stay and only if there are any.
    let Some(mut run) = runs.next::<S, Q>(s) else { return count };
    let mut packets = Packets::<S, Q>::new(object, groups.of(s), buffers, &rays[0]);
    loop {
        let (at, own) = (run.at, run.rays);
        // So that the next rays are there when this packet is done.
        let next = own.as_ptr().wrapping_add(PACKET);
        for line in 0..PACKET / RAYS_PER_CACHE_LINE {
            s.prefetch(next.wrapping_add(line * RAYS_PER_CACHE_LINE));
        }
        let to = &mut to.part(at);
        let (outcome, guard, least_use, kind) = match run.kind {
            Kind::Coherent(span) => {
                // Whether any hit will do is most often asked on the way to a light, from different points.
                let outcome = if !Q::ANY && span.is_from_point() {
                    frustum::<S, Q, true>(s, object, &bounds, &span, &mut packets, own, to)
                } else {
                    frustum::<S, Q, false>(s, object, &bounds, &span, &mut packets, own, to)
                };
                (outcome, &mut runs.coherent, least.coherent, &mut count.coherent)
            }
            // Others never are; so this need not be compiled for them.
            Kind::Short(_) if !Q::ANY => {
                (PacketOutcome::Refused, &mut runs.short, least.short, &mut count.short)
            }
            Kind::Short(segments) => {
                let outcome = if prepare::<S, Q, SegmentBox<S>>(s, &bounds, &mut packets, own) {
                    packets.trace(s, object, &SegmentBox::new(s, segments), own, to)
                } else {
                    PacketOutcome::Refused
                };
                (outcome, &mut runs.short, least.short, &mut count.short)
            }
        };
        match outcome {
            PacketOutcome::Refused => runs.leave(at, own.len()),
            PacketOutcome::Lanes(share) => {
                guard.learn(share >= least_use);
                count.rays += own.len();
                *kind += 1;
                count.poor += usize::from(share < least_use);
            }
        }
        let Some(next) = runs.next::<S, Q>(s) else { break };
        run = next;
    }
    count
}

/// Rays that go together.
struct Run<'a> {
    /// Place of the first in the batch.
    at: usize,
    rays: &'a [Ray],
    kind: Kind,
}

/// How they do.
enum Kind {
    Coherent(Span),
    Short([[f32; 3]; 2]),
}

/// The runs of a batch.
struct Runs<'a, 'b> {
    bounds: &'b ObjectBounds,
    rays: &'a [Ray],
    /// Where the next begins.
    at: usize,
    coherent: Guard,
    short: Guard,
    /// Places of rays that go alone.
    rest: &'b mut Vec<u32>,
}

impl<'a> Runs<'a, '_> {
    /// The next run; rays before it go alone.
    #[inline(always)]
    fn next<S: Simd, Q: Query>(&mut self, s: S) -> Option<Run<'a>> {
        while self.at < self.rays.len() {
            let at = self.at;
            let rays = &self.rays[at..self.rays.len().min(at + PACKET)];
            self.at = at + PACKET;
            if let Some(kind) = choose::<S, Q>(s, self.bounds, rays, &mut self.coherent, &mut self.short) {
                return Some(Run { at, rays, kind });
            }
            self.leave(at, rays.len());
        }
        None
    }

    fn leave(&mut self, at: usize, count: usize) {
        self.rest.extend(at as u32..(at + count) as u32);
    }
}

/// How rays may go together, if they may.
#[inline(always)]
fn choose<S: Simd, Q: Query>(
    s: S,
    bounds: &ObjectBounds,
    rays: &[Ray],
    coherent: &mut Guard,
    short: &mut Guard,
) -> Option<Kind> {
    if rays.len() < FEWEST {
        return None;
    }
    let try_coherent = coherent.is_open() && is_same_octant(&rays[0], &rays[rays.len() - 1]);
    let try_short = Q::ANY && short.is_open();
    if !try_coherent && !try_short {
        return None;
    }
    let span = Span::of(s, rays);
    if try_coherent && span.is_coherent() {
        return Some(Kind::Coherent(span));
    }
    if try_short {
        return span.segments(s, bounds, rays).map(Kind::Short);
    }
    None
}

/// Traces a coherent run.
#[inline(always)]
fn frustum<S: Simd, Q: Query, const POINT: bool>(
    s: S,
    object: &ObjectView<'_>,
    bounds: &ObjectBounds,
    span: &Span,
    packets: &mut Packets<'_, S, Q>,
    rays: &[Ray],
    to: &mut Sink<'_, Q>,
) -> PacketOutcome {
    if !prepare::<S, Q, Frustum<S, POINT>>(s, bounds, packets, rays) {
        return PacketOutcome::Refused;
    }
    let frustum = Frustum::<S, POINT>::new(s, bounds, span, &packets.groups[..rays.len().div_ceil(LANES)]);
    packets.buffers.hit_cache.clear(s, POINT);
    packets.trace(s, object, &frustum, rays, to)
}

/// Prepares all groups; false if a ray can't be.
#[inline(always)]
fn prepare<S: Simd, Q: Query, H: PacketBounds<S>>(
    s: S,
    bounds: &ObjectBounds,
    packets: &mut Packets<'_, S, Q>,
    rays: &[Ray],
) -> bool {
    let mut ready = true;
    for (group, rays) in packets.groups.iter_mut().zip(rays.chunks(LANES)) {
        ready &= group.prepare::<H>(s, bounds, rays);
    }
    ready
}
