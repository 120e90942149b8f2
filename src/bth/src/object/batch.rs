//! Tracing of one object by batches of rays. Coherent rays are traced in packets. Of the others, those that start on a known
//! triangle may first walk through the tetrahedra at that triangle, and those that remain are traced interleaved through the BVH.

use super::hints::Hinted;
use super::scratch::Scratch;
use super::single;
use super::strategy::{HintUse, MIN_MEASURED_RAYS, QueryKind, Strategy, is_short};
use crate::SMALL;
use crate::bvh::interleaved::{Interleaved, RemainingRays};
use crate::bvh::packet::{self, Packets};
use crate::bvh::single::TetOutcome;
use crate::clock;
use crate::intersect::exact_lanes::Intersections;
use crate::query::sink::Sink;
use crate::query::{Answer, AnswerLanes, Goal, Nearest, Query, Uncounted};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use crate::tets::batch::{WalkBatch, WalkRays, WalkState};
use crate::tets::records::LaneRecords;
use crate::tets::{enter_tets, leaf_of_face};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Least number of rays of a batch; fewer rays are traced one after the other.
pub(crate) const MIN_BATCH: usize = 4;
/// Greatest number of rays that walk through tetrahedra together. It is large, because lanes are idle at the end of each part.
const RAYS_PER_PART: usize = 2048;

/// The longest side of the object's box.
#[inline]
pub(super) fn size_of(object: &ObjectView<'_>) -> f32 {
    let header = object.header;
    (0..3).fold(0f32, |size, k| size.max(header.upper[k] - header.lower[k]))
}

/// What measurements of an object are stored under.
pub(super) fn address_of(object: &ObjectView<'_>) -> usize {
    std::ptr::from_ref(object.header).addr()
}

/// Traces a batch by the strategy that was measured to be faster for such rays on this thread, and measures it. The measurements are
/// those of an address, of an object or a scene, and of a kind of rays ([`HintUse::kind`]). `unmeasured` is the strategy of small
/// batches before there are measurements.
pub(crate) fn by_hint(
    (address, kind): (usize, usize),
    rays: usize,
    unmeasured: Strategy,
    scratch: &mut Scratch,
    trace: impl FnOnce(Strategy, &mut Scratch),
) {
    let hinted = Hinted::chosen();
    let choice = scratch.choices.of(address, kind);
    let measured = rays >= MIN_MEASURED_RAYS && hinted == Hinted::Measured;
    let strategy = match hinted {
        Hinted::Bvh => Strategy::Bvh,
        Hinted::Tets => Strategy::Hinted,
        Hinted::Measured if measured => choice.next(),
        Hinted::Measured => choice.best_or(unmeasured),
    };
    let start = if measured { clock::now() } else { None };
    trace(strategy, scratch);
    if let Some(start) = start {
        let seconds_per_ray = start.elapsed().as_secs_f64() / rays as f64;
        scratch.choices.of(address, kind).record(strategy, seconds_per_ray);
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

/// Stores in `sink` the answers of those rays in object space that hit anything; `from` as for [`nearest_batch`].
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
        (address_of(object), HintUse::Tets.kind(QueryKind::of(sink.goal().is_any(), rays, size_of(object))));
    by_hint(key, rays.len(), Strategy::Bvh, scratch, |strategy, scratch| {
        trace_with(object, rays, from.filter(|_| strategy == Strategy::Hinted), scratch, sink);
    });
}

/// Traces rays with the hints `from` if they are given or the object is a single tet leaf, else in packets and through the BVH.
fn trace_with<Q: Query>(
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

/// Whether the triangles of tet leaves are also in a BVH.
fn has_subtrees(object: &ObjectView<'_>) -> bool {
    object.tet_leaves.first().is_some_and(|leaf| leaf.subtree != NONE)
}

/// Index of the tet leaf that is the whole object, if its triangles are not also in a BVH; else `NONE`.
fn sole_tet_leaf(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(leaf)) if object.tet_leaves[leaf as usize].subtree == NONE => leaf,
        _ => NONE,
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
    let mut faces = vec![NONE; rays.len()];
    let face_of = |ray: usize| {
        let triangle = from.map_or(NONE, |from| from[ray]);
        object.triangle_faces.get(triangle as usize).copied().unwrap_or(NONE)
    };
    let mut order: Vec<u32> = match packet_rays {
        0 => (0..rays.len() as u32).collect(),
        _ => scratch.packets.rest.clone(),
    };
    for &ray in &order {
        if may_gain_by_walk(object, &rays[ray as usize], sink.goal()) {
            faces[ray as usize] = face_of(ray as usize);
        }
    }
    let mut queries: Vec<Q> = rays.iter().map(|ray| Q::new(sink.goal(), ray)).collect();
    let mut walks = vec![WalkState::NotWalked; rays.len()];
    walk_tets(object, rays, &faces, &mut queries, &mut walks);
    let is_whole_object = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let mut walked = vec![NONE; rays.len()];
    order.retain(|&ray| {
        let ray = ray as usize;
        let done = walks[ray] == WalkState::Done || walks[ray] == WalkState::Left && is_whole_object;
        if done {
            sink.query(ray, &queries[ray]);
        } else if walks[ray] == WalkState::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        !done
    });
    if !order.is_empty() {
        let remaining = RemainingRays { order: Some(&order), queries: Some(&queries), walked: Some(&walked) };
        through_bvh(object, rays, remaining, scratch, sink);
    }
}

/// Whether a ray that starts on a known triangle may be faster through tetrahedra than through the BVH, if there is one.
///
/// By measurement (docs/notes/tets.md), long any-hit rays and all rays in scalar code are not, and with 128 bits no walk is compiled;
/// for other rays [`super::strategy`] chooses by measured time. No answer depends on this.
fn may_gain_by_walk(object: &ObjectView<'_>, ray: &Ray, goal: impl Goal) -> bool {
    if !has_subtrees(object) {
        return true;
    }
    if !Isa::chosen().walks_tets() {
        return false;
    }
    if !goal.is_any() {
        return true;
    }
    is_short(ray, size_of(object))
}

/// Walks the rays through tetrahedra: those that have a face in `faces`, or all if a tet leaf is the whole object. `walks`
/// receives the state of each ray's walk. All slices have one element per ray.
fn walk_tets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    faces: &[u32],
    queries: &mut [Q],
    walks: &mut [WalkState],
) {
    let sole_leaf = sole_tet_leaf(object);
    let has_walks = sole_leaf != NONE || faces.iter().any(|&face| face != NONE);
    let records = LaneRecords::new(object.records).filter(|_| has_walks && WalkBatch::<Q>::fits(object));
    if let Some(records) = records {
        let leaves = vec![sole_leaf; rays.len()];
        let mut batch =
            WalkBatch::new(object, records, WalkRays { rays, faces, leaves: &leaves }, queries, walks);
        // Where no walks are compiled, no ray is walked here, and `walks` stays `NotWalked`: rays are faster through the BVH.
        let _ = Isa::chosen().run_wide(&mut batch);
    }
}

/// Traces coherent rays in packets and returns their number. If it is not 0, the indices of the other rays are stored in
/// `scratch.packets.rest`. In scalar code there are no packets, and the number is 0.
fn in_packets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) -> usize {
    let (scratch, least) = (&mut scratch.packets, packet::MINIMUM_USE);
    Isa::chosen().run_wide(Packets { object, rays, scratch, least, sink }).map_or(0, |count| count.rays)
}

/// Traces rays through the BVH: interleaved, or in scalar code one after the other.
pub(super) fn through_bvh<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: RemainingRays<'_, Q>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    if Isa::chosen() == Isa::Scalar {
        return one_by_one(object, rays, &remaining, sink);
    }
    // `run_wide` runs nothing in scalar code, which has returned above.
    let _ = Isa::chosen().run_wide(InterleavedKernel { object, rays, remaining, scratch, sink });
}

/// Implements [`through_bvh`] in scalar code, one ray after the other. Interleaved and packet kernels are not compiled for scalar
/// code, where they would be the largest part of the library.
fn one_by_one<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: &RemainingRays<'_, Q>,
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
    remaining: RemainingRays<'a, Q>,
    scratch: &'a mut Scratch,
    sink: &'a mut Sink<'s, Q>,
}

impl<Q: Query> Kernel for InterleavedKernel<'_, '_, Q> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let InterleavedKernel { object, rays, remaining, scratch, sink } = self;
        let traversal = Interleaved { object, rays, remaining, stacks: &mut scratch.stacks, sink };
        traversal.run(s, |leaf, ray, query| {
            enter_tets(object, leaf, ray, query, &mut Uncounted::default()) == TetOutcome::Done
        });
    }
}
