//! Selection of the rays of a batch that are traced in packets: runs of consecutive coherent rays,
//! as long as enough of their rays take part in each step.

use super::backoff::{Backoffs, KindBackoffs};
use super::bounds::PacketBounds;
use super::buffers::{GroupStorage, PacketBuffers};
use super::entry::{MIN_RAYS, PACKET};
use super::frustum::{Frustum, FrustumOf};
use super::prepare_group::PrepareGroup;
use super::segment_box::SegmentBox;
use super::traverse::{PacketOutcome, PacketTracer, TracePacket};
use crate::bvh::nodes::is_large;
use crate::coherence::{Span, is_same_octant};
use crate::query::sink::Sink;
use crate::query::{Goal, RayQuery};
use crate::rays::{RAYS_PER_CACHE_LINE, Ray};
use crate::shortcuts;
use crate::simd::{CacheLevel, Kernel, LANES, Part, Simd};
use bth_format::object::ObjectBounds;
use bth_format::object::ObjectView;

/// The smallest average share of a packet's rays, in per cent, that must take part in a step. Below
/// it single rays are faster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MinimumUse {
    /// The share for coherent rays.
    pub(crate) coherent: u32,
    /// The share for short rays.
    pub(crate) short: u32,
}

/// The shares that were measured to be the fastest (docs/notes/packets.md).
pub(crate) const MINIMUM_USE: MinimumUse = MinimumUse { coherent: 10, short: 8 };
/// The same for [large](is_large) objects: single rays wait less for memory, because many are
/// interleaved.
const MINIMUM_USE_OF_LARGE: MinimumUse = MinimumUse { coherent: 20, ..MINIMUM_USE };

impl MinimumUse {
    /// The shares for an object.
    pub(crate) fn of(object: &ObjectView<'_>) -> MinimumUse {
        if is_large(object) { MINIMUM_USE_OF_LARGE } else { MINIMUM_USE }
    }
}

/// Memory kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    groups: GroupStorage,
    buffers: PacketBuffers,
    backoffs: Backoffs,
    /// Indices of the rays that were not traced in packets.
    pub(crate) rest: Vec<u32>,
}

/// Statistics of the packets of a batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PacketCount {
    /// Rays traced in packets.
    pub(crate) rays: usize,
    /// Packets of coherent rays.
    pub(crate) coherent: usize,
    /// Packets of short rays.
    pub(crate) short: usize,
    /// Packets in whose steps too few rays took part.
    pub(crate) poor: usize,
}

/// Kernel that traces the coherent rays of a batch in packets and stores the answers of those that
/// hit something. The indices of the other rays are left in `scratch.rest`, unless no packets were
/// tried; then the returned count is 0.
pub(crate) struct Packets<'a, 's, G: Goal> {
    pub object: &'a ObjectView<'a>,
    pub rays: &'a [Ray],
    pub scratch: &'a mut PacketScratch,
    /// The smallest use of packets for which they are made.
    pub least: MinimumUse,
    pub sink: &'a mut Sink<'s>,
    pub goal: G,
}

impl<G: Goal> Kernel for Packets<'_, '_, G> {
    type Output = PacketCount;
    const SCALAR: bool = false;
    const QUADS: bool = G::QUADS;
    const LONG_VECTORS: bool = G::LONG_VECTORS;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> PacketCount {
        let Packets { object, rays, scratch, least, sink, goal } = self;
        let mut count = PacketCount::default();
        if rays.len() < MIN_RAYS || shortcuts::has_special_leaves(object) {
            return count;
        }
        let bounds = object.bounds;
        let PacketScratch { groups, buffers, backoffs, rest } = scratch;
        rest.clear();
        let backoffs = backoffs.of(object.identity, goal.is_any());
        let mut runs = Runs { bounds: &bounds, rays, next: 0, backoffs: *backoffs, rest };
        // The first run is found before the loop, so that `packets` is made only if there are any.
        let Some(mut run) = runs.next(s, goal) else {
            *backoffs = runs.backoffs;
            return count;
        };
        buffers.reserve(object);
        let mut packets = PacketTracer {
            groups: groups.of(s),
            goal,
            queries: [RayQuery::new(goal, &rays[0]); PACKET],
            buffers,
        };
        loop {
            let (first, rays) = (run.first, run.rays);
            // The next rays are in the cache when this packet is done.
            let next = rays.as_ptr().wrapping_add(PACKET);
            let next = next.cast::<[Ray; RAYS_PER_CACHE_LINE]>();
            s.prefetch_into::<{ PACKET / RAYS_PER_CACHE_LINE }, _>(CacheLevel::waiting(), next);
            let sink = &mut sink.part(first);
            let (outcome, backoff, least_use, kind) = match run.kind {
                Kind::Coherent(span) => {
                    // Any-hit rays with the same origin are rare, so that kernel is compiled for
                    // nearest hits only.
                    let outcome = if !goal.is_any() && span.is_from_point() {
                        frustum::<S, G, true>(s, object, &bounds, &span, &mut packets, rays, sink)
                    } else {
                        frustum::<S, G, false>(s, object, &bounds, &span, &mut packets, rays, sink)
                    };
                    (outcome, &mut runs.backoffs.coherent, least.coherent, &mut count.coherent)
                }
                // Runs of short rays are found for any-hit queries only, so no kernel is compiled
                // for others.
                Kind::Short(_) if !goal.is_any() => {
                    (PacketOutcome::Refused, &mut runs.backoffs.short, least.short, &mut count.short)
                }
                Kind::Short(segments) => {
                    let ready = if !S::INLINES_PARTS {
                        // One part prepares both kinds.
                        prepare::<S, G, Frustum<S, false>>(s, &bounds, &mut packets, rays, false)
                    } else {
                        prepare::<S, G, SegmentBox<S>>(s, &bounds, &mut packets, rays, false)
                    };
                    let outcome = if ready {
                        let bounds = &SegmentBox::new(s, segments);
                        TracePacket { packets: &mut packets, object, bounds, rays, sink }.inline_or_call(s)
                    } else {
                        PacketOutcome::Refused
                    };
                    (outcome, &mut runs.backoffs.short, least.short, &mut count.short)
                }
            };
            match outcome {
                PacketOutcome::Refused => runs.skip(first, rays.len()),
                PacketOutcome::Lanes(share) => {
                    backoff.record(share >= least_use);
                    count.rays += rays.len();
                    *kind += 1;
                    count.poor += usize::from(share < least_use);
                }
            }
            let Some(next) = runs.next(s, goal) else { break };
            run = next;
        }
        *backoffs = runs.backoffs;
        count
    }
}

/// Consecutive rays that make a packet.
struct PacketRun<'a> {
    /// Index of the first ray in the batch.
    first: usize,
    rays: &'a [Ray],
    kind: Kind,
}

/// The kind of a packet.
enum Kind {
    /// The directions are similar.
    Coherent(Span),
    /// The rays are short and close together; the value is their box.
    Short([[f32; 3]; 2]),
}

/// The runs of a batch.
struct Runs<'a, 'b> {
    bounds: &'b ObjectBounds,
    rays: &'a [Ray],
    /// Index of the next ray.
    next: usize,
    backoffs: KindBackoffs,
    /// Indices of the rays that are not in a packet.
    rest: &'b mut Vec<u32>,
}

impl<'a> Runs<'a, '_> {
    /// The next run. The rays before it are added to `rest`.
    #[inline(always)]
    fn next(&mut self, s: impl Simd, goal: impl Goal) -> Option<PacketRun<'a>> {
        while self.next < self.rays.len() {
            let first = self.next;
            let count = match self.rays.len() - first {
                // The rays behind a full packet would be too few for one.
                count if count > PACKET && count < PACKET + MIN_RAYS => count - MIN_RAYS,
                count => count.min(PACKET),
            };
            let rays = &self.rays[first..first + count];
            self.next = first + count;
            if let Some(kind) = choose(s, goal, self.bounds, rays, &mut self.backoffs) {
                return Some(PacketRun { first, rays, kind });
            }
            self.skip(first, rays.len());
        }
        None
    }

    /// Adds rays to `rest`. Not inlined into every kernel.
    #[inline(never)]
    fn skip(&mut self, first: usize, count: usize) {
        self.rest.extend(first as u32..(first + count) as u32);
    }
}

/// The choice of the kind of packet that rays may make, if any, as a part of kernels.
struct Choose<'a> {
    bounds: &'a ObjectBounds,
    rays: &'a [Ray],
    /// True if the rays may make a packet of coherent rays, or one of short rays.
    try_coherent: bool,
    try_short: bool,
}

impl<S: Simd> Part<S> for Choose<'_> {
    type Output = Option<Kind>;
    #[inline(always)]
    fn run(self, s: S) -> Option<Kind> {
        let span = Span::of(s, self.rays);
        if self.try_coherent && span.is_coherent() {
            return Some(Kind::Coherent(span));
        }
        if self.try_short {
            return span.segments(s, self.bounds, self.rays).map(Kind::Short);
        }
        None
    }
}

/// The kind of packet that rays may make, if any.
#[inline(always)]
fn choose(
    s: impl Simd,
    goal: impl Goal,
    bounds: &ObjectBounds,
    rays: &[Ray],
    KindBackoffs { coherent, short }: &mut KindBackoffs,
) -> Option<Kind> {
    if rays.len() < MIN_RAYS {
        return None;
    }
    let try_coherent = coherent.may_try() && is_same_octant(&rays[0], &rays[rays.len() - 1]);
    let try_short = goal.is_any() && short.may_try();
    if !try_coherent && !try_short {
        return None;
    }
    Choose { bounds, rays, try_coherent, try_short }.inline_or_call(s)
}

/// Traces a run of coherent rays. The parameters are separate, because this is a part of the kernel
/// [`Packets`].
#[inline(always)]
fn frustum<S: Simd, G: Goal, const POINT: bool>(
    s: S,
    object: &ObjectView<'_>,
    bounds: &ObjectBounds,
    span: &Span,
    packets: &mut PacketTracer<'_, S, G>,
    rays: &[Ray],
    sink: &mut Sink<'_>,
) -> PacketOutcome {
    if !prepare::<S, G, Frustum<S, POINT>>(s, bounds, packets, rays, true) {
        return PacketOutcome::Refused;
    }
    let groups = &packets.groups[..rays.len().div_ceil(LANES)];
    let frustum = FrustumOf::<S, POINT> { bounds, span, groups };
    // Only one kernel has packets from a point.
    let frustum = if POINT { frustum.inline_or_call(s) } else { frustum.inline_or_share(s) };
    packets.buffers.hit_cache.clear(s, POINT);
    TracePacket { packets, object, bounds: &frustum, rays, sink }.inline_or_call(s)
}

/// Prepares the groups of a packet, with the lines of their rays where these are needed later on;
/// false if a ray cannot be prepared in f32.
#[inline(always)]
fn prepare<S: Simd, G: Goal, H: PacketBounds<S>>(
    s: S,
    bounds: &ObjectBounds,
    packets: &mut PacketTracer<'_, S, G>,
    rays: &[Ray],
    keeps_lines: bool,
) -> bool {
    let mut ready = true;
    for (group, rays) in packets.groups.iter_mut().zip(rays.chunks(LANES)) {
        let group = PrepareGroup::<S, H>::of(group, bounds, rays, keeps_lines);
        ready &= if H::COMMON_ORIGIN { group.inline_or_call(s) } else { group.inline_or_share(s) };
    }
    ready
}
