//! Tracing of one object by batches of rays. Coherent rays are traced in packets, the others interleaved through the BVH, or through
//! tetrahedra if these are the whole object.

use super::scratch::Scratch;
use super::single;
use super::walked_batch::{RAYS_PER_PART, sole_tet_leaf, walk};
use crate::bvh::interleaved::{Interleaved, RemainingRays};
use crate::bvh::nodes::is_large;
use crate::bvh::packet::{MinimumUse, Packets};
use crate::intersect::exact_lanes::Intersections;
use crate::query::sink::Sink;
use crate::query::{Answer, AnswerLanes, Any, EitherGoal, Goal, Nearest, Query};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use crate::tets::TetOutcome;
use crate::tets::enter_tets;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Least number of rays of a batch; fewer rays are traced one after the other.
pub(crate) const MIN_BATCH: usize = 4;

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

/// Stores the nearest hits of those rays in object space that hit anything, through the instance with the given index.
pub(crate) fn nearest_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    instance: u32,
    scratch: &mut Scratch,
    hits: &mut [Hit],
) {
    let mut sink = Sink::<Nearest>::new(object.triangle_ids, hits, instance);
    trace_batch(object, rays, None, scratch, &mut sink);
}

/// Stores which rays in object space hit anything; parameters as for [`nearest_batch`].
pub(crate) fn any_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    instance: u32,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    let mut sink = Sink::<Any>::new(object.triangle_ids, found, instance);
    trace_batch(object, rays, None, scratch, &mut sink);
}

/// Stores in `sink` the answers of those rays in object space that hit anything: all of them, or those whose indices are in `order`.
pub(crate) fn trace_batch<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    order: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    if object.header.root == NONE {
        return;
    }
    if !sink.starts().is_empty() {
        let object = &ObjectView { bounds: object.start_bounds, ..*object };
        return trace_through(object, rays, order, scratch, sink);
    }
    if sole_tet_leaf(object) != NONE && order.is_none() {
        for (part, rays) in rays.chunks(RAYS_PER_PART).enumerate() {
            trace_in_tets(object, rays, scratch, &mut sink.part(part * RAYS_PER_PART));
        }
        return;
    }
    trace_through(object, rays, order, scratch, sink);
}

/// Traces rays in packets and through the BVH.
fn trace_through<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    order: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    if order.is_some() {
        // Too few rays are left of most packets.
        return through_bvh(
            object,
            rays,
            RemainingRays { order, queries: None, walked: None },
            scratch,
            sink,
        );
    }
    let packet_rays = in_packets(object, rays, scratch, sink);
    if packet_rays < rays.len() {
        let rest = std::mem::take(&mut scratch.packets.rest);
        let order = (packet_rays > 0).then_some(&rest[..]);
        through_bvh(object, rays, RemainingRays { order, queries: None, walked: None }, scratch, sink);
        scratch.packets.rest = rest;
    }
}

/// Traces at most [`RAYS_PER_PART`] rays, which enter the same tet leaf.
fn trace_in_tets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    let mut walks = std::mem::take(&mut scratch.walks);
    let goal = sink.goal();
    walk(object, rays, EitherGoal { is_any: goal.is_any() }, &mut walks);
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
    // Without vectors no walk is compiled, so no ray has been walked before, and rays that start on triangles are not traced together.
    let trace = |index: usize, sink: &mut Sink<'_, Q>| {
        let (goal, instance, mut answer) = (sink.goal(), sink.instance_of(index), Answer::MISS);
        let count = &mut ();
        single::trace::<Q, _, _>((object, goal), &rays[index], instance, count, &mut answer);
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
        traversal
            .run(s, |leaf, ray, query| enter_tets(object, leaf, ray, query, &mut ()) == TetOutcome::Done);
    }
}
