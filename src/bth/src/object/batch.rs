//! Tracing of one object by batches of rays. Coherent rays are traced in packets. Of the others, those that start on a known
//! triangle may first walk through the tetrahedra at that triangle, and those that remain are traced interleaved through the BVH.

use super::hints::Hinted;
use super::scratch::Scratch;
use super::single;
use super::strategy::{HintUse, MIN_COMPARED_RAYS, PARTS, Plan, QueryKind, Strategy, size_of};
use super::walked_batch::{RAYS_PER_PART, has_subtrees, may_gain_by_walk, sole_tet_leaf, walk};
use crate::SMALL;
use crate::bvh::interleaved::{Interleaved, RemainingRays};
use crate::bvh::nodes::is_large;
use crate::bvh::packet::{MinimumUse, Packets};
use crate::clock;
use crate::intersect::exact_lanes::Intersections;
use crate::query::sink::Sink;
use crate::query::{Answer, AnswerLanes, EitherGoal, Goal, Nearest, Query, Uncounted};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, LANES, Simd};
use crate::tets::TetOutcome;
use crate::tets::enter_tets;
use bth_format::Identity;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use std::ops::Range;

/// Least number of rays of a batch; fewer rays are traced one after the other.
pub(crate) const MIN_BATCH: usize = 4;

/// Traces a batch by the strategy that was measured to be faster for such rays on this thread, or parts of it by both to measure them. The
/// measurements are those of a `key`: an object or a scene, and a kind of rays ([`HintUse::kind`]). `unmeasured` is the strategy of small
/// batches before there are measurements. `trace` traces a range of the rays.
pub(crate) fn by_hint(
    key: (Identity, usize),
    rays: usize,
    unmeasured: Strategy,
    scratch: &mut Scratch,
    mut trace: impl FnMut(Range<usize>, Strategy, &mut Scratch),
) {
    let (strategies, parts) = match plan(key, rays, unmeasured, scratch) {
        Plan::Whole(strategy) => ([strategy; PARTS], 1),
        Plan::Compare(strategies) => (strategies, PARTS),
    };
    // All but the last part have whole vectors of rays.
    let size = if parts == 1 { rays } else { rays.div_ceil(parts).next_multiple_of(LANES) };
    let (mut seconds, mut counts) = ([0.0; 2], [0; 2]);
    for (part, &strategy) in strategies[..parts].iter().enumerate() {
        let range = rays.min(part * size)..rays.min((part + 1) * size);
        counts[strategy as usize] += range.len();
        let start = if parts > 1 { clock::now() } else { None };
        trace(range, strategy, scratch);
        seconds[strategy as usize] += clock::elapsed(start).as_secs_f64();
    }
    if parts > 1 {
        let seconds_per_ray = [0, 1].map(|i| seconds[i] / counts[i] as f64);
        scratch.choices.of(key.0, key.1).record(seconds_per_ray);
    }
}

/// How a batch is traced. The parameters are those of [`by_hint`].
#[inline(never)]
fn plan((traced, kind): (Identity, usize), rays: usize, unmeasured: Strategy, scratch: &mut Scratch) -> Plan {
    let choice = scratch.choices.of(traced, kind);
    match Hinted::chosen() {
        Hinted::Bvh => Plan::Whole(Strategy::Bvh),
        Hinted::Tets => Plan::Whole(Strategy::Hinted),
        Hinted::Measured if rays >= MIN_COMPARED_RAYS => choice.next(),
        Hinted::Measured => Plan::Whole(choice.best_or(unmeasured)),
    }
}

/// Fills `hits` with [`Hit::MISS`].
#[inline]
pub(crate) fn fill_misses(hits: &mut [Hit]) {
    // For a few hits the call of a kernel takes longer than a loop.
    if hits.len() < MIN_BATCH {
        hits.fill(Hit::MISS);
    } else {
        Isa::chosen().run(MissKernel(hits));
    }
}

/// The kernel of [`fill_misses`], which stores whole vectors.
struct MissKernel<'a>(&'a mut [Hit]);

impl Kernel for MissKernel<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if !S::HAS_VECTORS {
            return self.0.fill(Hit::MISS);
        }
        let (blocks, rest) = self.0.as_chunks_mut();
        let none = AnswerLanes { lanes: 0, intersections: &Intersections::NONE, instance: NONE };
        for block in blocks {
            <Nearest>::answers_of(s, &none, block);
        }
        rest.fill(Hit::MISS);
    }
}

/// Stores in `sink` the answers of those rays in object space that hit anything; `from` as for
/// [`nearest_batch`](super::nearest_batch).
pub(crate) fn trace_batch<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    if object.header.root == NONE {
        return;
    }
    let from = from.filter(|from| {
        if SMALL {
            return false;
        }
        let mut starts = rays.iter().zip(*from);
        !object.tet_leaves.is_empty()
            && starts.any(|(ray, &triangle)| triangle != NONE && may_gain_by_walk(object, ray, sink.goal()))
    });
    // There is a choice of strategy only if the triangles of tet leaves are also in a BVH.
    if from.is_none() || !has_subtrees(object) {
        return trace_with(object, rays, from, scratch, sink);
    }
    let key =
        (object.identity, HintUse::Tets.kind(QueryKind::of(sink.goal().is_any(), rays, size_of(object))));
    by_hint(key, rays.len(), Strategy::Bvh, scratch, |range, strategy, scratch| {
        let from = from.filter(|_| strategy == Strategy::Hinted).map(|from| &from[range.clone()]);
        trace_with(object, &rays[range.clone()], from, scratch, &mut sink.part(range.start));
    });
}

/// Traces rays with the hints `from` if they are given or the object is a single tet leaf, else in packets and through the BVH.
pub(super) fn trace_with<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    if !SMALL && (from.is_some() || sole_tet_leaf(object) != NONE) {
        for (part, rays) in rays.chunks(RAYS_PER_PART).enumerate() {
            let first = part * RAYS_PER_PART;
            let from = from.map(|from| &from[first..][..rays.len()]);
            trace_hinted(object, rays, from, scratch, &mut sink.part(first));
        }
        return;
    }
    let packet_rays = in_packets(object, rays, scratch, sink);
    if packet_rays < rays.len() {
        let rest = std::mem::take(&mut scratch.packets.rest);
        let order = (packet_rays > 0).then_some(&rest[..]);
        let remaining = RemainingRays { order, queries: None, walked: None };
        through_bvh(object, rays, remaining, scratch, sink);
        scratch.packets.rest = rest;
    }
}

/// Traces at most [`RAYS_PER_PART`] rays, some of which start on known triangles, or all of which enter the same tet leaf.
fn trace_hinted<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    // For coherent rays packets are the fastest, with hints or without.
    let packet_rays = in_packets(object, rays, scratch, sink);
    let mut walks = std::mem::take(&mut scratch.walks);
    walks.rest.clear();
    match packet_rays {
        0 => walks.rest.extend(0..rays.len() as u32),
        _ => walks.rest.extend_from_slice(&scratch.packets.rest),
    }
    let goal = sink.goal();
    walk(object, rays, from, EitherGoal { is_any: goal.is_any() }, &mut walks);
    for &ray in &walks.done {
        let ray = ray as usize;
        sink.query(ray, &Q::from_either(goal, &walks.queries[ray]));
    }
    if !walks.rest.is_empty() {
        let (order, walked) = (Some(&walks.rest[..]), Some(&walks.walked[..]));
        let remaining = RemainingRays { order, queries: Some(&walks.queries), walked };
        through_bvh(object, rays, remaining, scratch, sink);
    }
    scratch.walks = walks;
}

/// Traces coherent rays in packets and returns their number. If it is not 0, the indices of the other rays are stored in
/// `scratch.packets.rest`. In scalar code there are no packets, and the number is 0. With vectors of 128 bits, with which kernels are
/// long, one kernel serves both goals.
fn in_packets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) -> usize {
    let (isa, scratch, least) = (Isa::chosen(), &mut scratch.packets, MinimumUse::of(object));
    let count = match isa.run_long_vectors(Packets { object, rays, scratch, least, sink }) {
        Ok(count) => count,
        Err(Packets { scratch, sink, .. }) => {
            let sink = &mut sink.either();
            isa.run_quads(Packets { object, rays, scratch, least, sink }).unwrap_or_default()
        }
    };
    count.rays
}

/// Traces rays through the BVH: interleaved, or in scalar code one after the other. Kernels are those of [`in_packets`].
pub(super) fn through_bvh<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: RemainingRays<'_>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    let isa = Isa::chosen();
    if isa == Isa::Scalar {
        return one_by_one(object, rays, &remaining, sink);
    }
    let kernel = InterleavedKernel { object, rays, remaining, scratch, sink };
    if let Err(InterleavedKernel { remaining, scratch, sink, .. }) = isa.run_long_vectors(kernel) {
        // With 128 bits no walk is compiled, so no ray has been walked before.
        let remaining = RemainingRays { order: remaining.order, queries: None, walked: None };
        let sink = &mut sink.either();
        // This always runs, since scalar code has returned above.
        let _ = isa.run_quads(InterleavedKernel { object, rays, remaining, scratch, sink });
    }
}

/// Implements [`through_bvh`] in scalar code, one ray after the other. Interleaved and packet kernels are not compiled for scalar
/// code, where they would be the largest part of the library.
fn one_by_one<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: &RemainingRays<'_>,
    sink: &mut Sink<'_, Q>,
) {
    // Without vectors no walk is compiled, so no ray has been walked before.
    let trace = |index: usize, sink: &mut Sink<'_, Q>| {
        let (goal, instance, mut answer) = (sink.goal(), sink.instance_of(index), Answer::MISS);
        let count = &mut Uncounted::default();
        single::trace::<Q, _>((object, goal), &rays[index], NONE, instance, count, &mut answer);
        sink.answer(index, answer);
    };
    match remaining.order {
        Some(order) => order.iter().for_each(|&index| trace(index as usize, sink)),
        None => (0..rays.len()).for_each(|index| trace(index, sink)),
    }
}

/// The kernel of [`through_bvh`].
struct InterleavedKernel<'a, 's, Q: Query> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    remaining: RemainingRays<'a>,
    scratch: &'a mut Scratch,
    sink: &'a mut Sink<'s, Q>,
}

impl<Q: Query> Kernel for InterleavedKernel<'_, '_, Q> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let InterleavedKernel { object, rays, remaining, scratch, sink } = self;
        let (stacks, entry_nodes) = (&mut scratch.stacks, is_large(object));
        let traversal = Interleaved { object, rays, remaining, stacks, sink, entry_nodes };
        traversal.run(s, |leaf, ray, query| {
            enter_tets(object, leaf, ray, query, &mut Uncounted::default()) == TetOutcome::Done
        });
    }
}
