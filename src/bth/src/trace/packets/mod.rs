//! Which rays of a batch go in packets.

pub(crate) mod coherence;
pub(crate) mod group;
pub(crate) mod hull;
pub(crate) mod leaf;
pub(crate) mod packet;
#[cfg(test)]
mod tests;

use self::coherence::{Guard, Span, is_same_octant};
use self::hull::{Beam, SegmentBox};
use self::packet::{Entry, PACKET, Packets, Use};
use crate::layout::NONE;
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use crate::trace::prepare::Frame;
use crate::trace::query::{Deliver, Offset, Query};

/// Rays in a line of the cache.
const RAYS_A_LINE: usize = 64 / size_of::<Ray>();
/// Fewer rays make no packet.
const FEWEST: usize = 2 * LANES;

/// Per cent of its rays that a step of a packet must serve on average: with less, one ray at a time is faster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LeastUse {
    pub(crate) coherent: u32,
    pub(crate) short: u32,
}

/// By measurement.
pub(crate) const LEAST_USE: LeastUse = LeastUse { coherent: 10, short: 15 };

/// Memory kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    stack: Vec<Entry>,
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

/// A run of rays that go together.
enum Run {
    Coherent(Span),
    Short([[f32; 3]; 2]),
}

/// Traces those rays of a batch that are better traced in packets, and leaves the others in `scratch.rest`, unless it does
/// not try at all. Hands on places and queries of rays that hit something.
#[inline(always)]
pub(crate) fn trace<S: Simd, Q: Query>(
    s: S,
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut PacketScratch,
    least: LeastUse,
    to: &mut impl Deliver<Q>,
) -> PacketCount {
    let mut count = PacketCount::default();
    // Where tetrahedra have no subtree beside them, and through packed nodes, rays go alone.
    if rays.len() < FEWEST
        || object.has_packed_nodes()
        || object.tet_leaves.first().is_some_and(|leaf| leaf.subtree == NONE)
    {
        return count;
    }
    let frame = Frame::new(object.header);
    let (mut coherent, mut short) = (Guard::new(), Guard::new());
    let PacketScratch { stack, rest } = scratch;
    rest.clear();
    let mut packets = None;
    for (i, own) in rays.chunks(PACKET).enumerate() {
        let at = i * PACKET;
        let Some(run) = choose::<S, Q>(s, &frame, own, &mut coherent, &mut short) else {
            rest.extend(at as u32..(at + own.len()) as u32);
            continue;
        };
        // So that the next rays are there when this packet is done.
        let next = own.as_ptr().wrapping_add(PACKET);
        for line in 0..PACKET / RAYS_A_LINE {
            s.prefetch(next.wrapping_add(line * RAYS_A_LINE));
        }
        if packets.is_none() {
            packets = Some(Packets::<S, Q>::new(s, object, &mut *stack, &own[0]));
        }
        let packets = packets.as_mut().expect("just made");
        let mut to = Offset { first: at, to: &mut *to };
        let (outcome, guard, least_use, kind) = match run {
            _ if !prepare(s, &frame, packets, own) => {
                (Use::Refused, &mut coherent, least.coherent, &mut count.coherent)
            }
            Run::Coherent(span) => {
                let beam = Beam::new(s, &frame, &span, &packets.groups[..own.len().div_ceil(LANES)]);
                let outcome = packets.trace(s, object, &beam, own, &mut to);
                (outcome, &mut coherent, least.coherent, &mut count.coherent)
            }
            Run::Short(bounds) => {
                let outcome = packets.trace(s, object, &SegmentBox::new(s, bounds), own, &mut to);
                (outcome, &mut short, least.short, &mut count.short)
            }
        };
        match outcome {
            Use::Refused => rest.extend(at as u32..(at + own.len()) as u32),
            Use::Lanes(share) => {
                guard.learn(share >= least_use);
                count.rays += own.len();
                *kind += 1;
                count.poor += usize::from(share < least_use);
            }
        }
    }
    count
}

/// How rays may go together, if they may.
#[inline(always)]
fn choose<S: Simd, Q: Query>(
    s: S,
    frame: &Frame,
    rays: &[Ray],
    coherent: &mut Guard,
    short: &mut Guard,
) -> Option<Run> {
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
        return Some(Run::Coherent(span));
    }
    if try_short {
        return span.segments(s, frame, rays).map(Run::Short);
    }
    None
}

/// Prepares all groups; false if a ray can't be.
#[inline(always)]
fn prepare<S: Simd, Q: Query>(s: S, frame: &Frame, packets: &mut Packets<'_, S, Q>, rays: &[Ray]) -> bool {
    let mut ready = true;
    for (group, rays) in packets.groups.iter_mut().zip(rays.chunks(LANES)) {
        ready &= group.prepare(s, frame, rays);
    }
    ready
}
