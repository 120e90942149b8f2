//! Batches of rays through one object: those that start on a known surface walk its tetrahedra first, all together;
//! the rest goes through the BVH.

use super::hints::Hinted;
use super::scratch::Scratch;
use super::single;
use super::strategy::{self, FEWEST_MEASURED_RAYS, Strategy};
use crate::bvh::interleaved::{Interleaved, RemainingRays};
use crate::bvh::nodes::{Nodes, Packed, Wide};
use crate::bvh::packet;
use crate::bvh::single::TetOutcome;
use crate::intersect::exact_lanes::Intersections;
use crate::query::sink::Sink;
use crate::query::{AnswerLanes, Any, Nearest, Query};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use crate::tets;
use crate::tets::batch::WalkState;
use crate::tets::records::LaneRecords;
use crate::tets::{enter_tets, leaf_of_face};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Fewer rays than these are traced one after the other.
pub(crate) const LEAST_BATCH: usize = 4;
/// Rays that walk tetrahedra together: enough that the last ones, which walk in lanes half empty, are few.
const RAYS_PER_PART: usize = 2048;

/// Nearest hits of rays in object space that start on the triangles `from` of the object, or on none (`NONE`). A hint
/// changes where the search begins, never what is found.
pub(crate) fn nearest_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    instance: u32,
    scratch: &mut Scratch,
    hits: &mut [Hit],
) {
    let mut sink = Sink::<Nearest>::new(object.triangle_ids, hits, instance);
    trace_batch(object, rays, from, scratch, &mut sink);
}

/// Whether rays in object space hit anything; `from` as for [`nearest_batch`].
pub(crate) fn any_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    let mut sink = Sink::<Any>::new(object.triangle_ids, found, 0);
    trace_batch(object, rays, from, scratch, &mut sink);
}

/// Says of all rays that they hit nothing.
#[inline]
pub(crate) fn fill_misses(hits: &mut [Hit]) {
    // One ray alone need not pay for a kernel.
    if hits.len() < LEAST_BATCH {
        hits.fill(Hit::MISS);
    } else {
        Isa::chosen().run(MissKernel(hits));
    }
}

/// [`fill_misses`] as a kernel: whole vectors are stored, not hits.
struct MissKernel<'a>(&'a mut [Hit]);

impl Kernel for MissKernel<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let (blocks, rest) = self.0.as_chunks_mut();
        let none = AnswerLanes { lanes: 0, intersections: &Intersections::NONE, instance: NONE };
        for block in blocks {
            Nearest::answers_of(s, &none, block);
        }
        rest.fill(Hit::MISS);
    }
}

/// Hands on what rays in object space hit, of those that hit anything; `from` as for [`nearest_batch`].
pub(crate) fn trace_batch<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    to: &mut Sink<'_, Q>,
) {
    if object.header.root == NONE {
        return;
    }
    let from = from.filter(|from| {
        let mut starts = rays.iter().zip(*from);
        !object.tet_leaves.is_empty()
            && starts.any(|(ray, &triangle)| triangle != NONE && is_worth_a_walk::<Q>(object, ray))
    });
    // Where there is no BVH beside the tetrahedra there is no choice.
    if from.is_none() || !has_subtrees(object) {
        return trace_with(object, rays, from, scratch, to);
    }
    let hinted = Hinted::chosen();
    let at = std::ptr::from_ref(object.header).addr();
    let choice = scratch.choices.of(at, usize::from(Q::ANY));
    let measured = rays.len() >= FEWEST_MEASURED_RAYS && hinted == Hinted::Measured;
    let way = match hinted {
        Hinted::Bvh => Strategy::Bvh,
        Hinted::Tets => Strategy::Tets,
        Hinted::Measured if measured => choice.next(),
        Hinted::Measured => choice.best(),
    };
    let start = if measured { strategy::now() } else { None };
    trace_with(object, rays, from.filter(|_| way == Strategy::Tets), scratch, to);
    if let Some(start) = start {
        let seconds_a_ray = start.elapsed().as_secs_f64() / rays.len() as f64;
        scratch.choices.of(at, usize::from(Q::ANY)).learn(way, seconds_a_ray);
    }
}

/// Traces rays that start on surfaces of which tetrahedra are known through those; others through packets and the BVH.
fn trace_with<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    to: &mut Sink<'_, Q>,
) {
    if from.is_some() || whole(object) != NONE {
        for (part, rays) in rays.chunks(RAYS_PER_PART).enumerate() {
            let first = part * RAYS_PER_PART;
            let from = from.map(|from| &from[first..][..rays.len()]);
            trace_hinted(object, rays, from, scratch, &mut to.part(first));
        }
        return;
    }
    let packed = in_packets(object, rays, scratch, to);
    if packed < rays.len() {
        let rest = std::mem::take(&mut scratch.packets.rest);
        let order = (packed > 0).then_some(&rest[..]);
        let remaining = RemainingRays { order, queries: None, walked: None };
        through_bvh(object, rays, remaining, scratch, to);
        scratch.packets.rest = rest;
    }
}

/// Whether there is a BVH beside the tetrahedra.
fn has_subtrees(object: &ObjectView<'_>) -> bool {
    object.tet_leaves.first().is_some_and(|leaf| leaf.subtree != NONE)
}

/// The tet leaf that is the whole object, without another structure for rays that come from outside; or `NONE`.
fn whole(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(leaf)) if object.tet_leaves[leaf as usize].subtree == NONE => leaf,
        _ => NONE,
    }
}

/// Traces at most [`RAYS_PER_PART`] rays, some of which start on known surfaces, or all of which enter the same tetrahedra.
fn trace_hinted<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    to: &mut Sink<'_, Q>,
) {
    // Packets of rays that go together beat all else, where they serve enough of their rays.
    let packed = in_packets(object, rays, scratch, to);
    let mut faces = vec![NONE; rays.len()];
    let home = |ray: usize| {
        let triangle = from.map_or(NONE, |from| from[ray]);
        object.triangle_faces.get(triangle as usize).copied().unwrap_or(NONE)
    };
    let mut order: Vec<u32> = match packed {
        0 => (0..rays.len() as u32).collect(),
        _ => scratch.packets.rest.clone(),
    };
    for &ray in &order {
        if is_worth_a_walk::<Q>(object, &rays[ray as usize]) {
            faces[ray as usize] = home(ray as usize);
        }
    }
    let mut queries: Vec<Q> = rays.iter().map(Q::new).collect();
    let mut walks = vec![WalkState::Not; rays.len()];
    walk_tets(object, rays, &faces, &mut queries, &mut walks);
    let is_all = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let mut walked = vec![NONE; rays.len()];
    order.retain(|&ray| {
        let ray = ray as usize;
        let done = walks[ray] == WalkState::Done || walks[ray] == WalkState::Left && is_all;
        if done {
            to.query(ray, &queries[ray]);
        } else if walks[ray] == WalkState::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        !done
    });
    if !order.is_empty() {
        let remaining = RemainingRays { order: Some(&order), queries: Some(&queries), walked: Some(&walked) };
        through_bvh(object, rays, remaining, scratch, to);
    }
}

/// Whether a ray that starts on a known surface may be faster through tetrahedra than through the BVH beside
/// them, if there is one. By measurement (docs/notes/tets.md): long any-hit rays never are, and none are without vectors. Of
/// the others [`choice`] decides. No answer depends on it.
fn is_worth_a_walk<Q: Query>(object: &ObjectView<'_>, ray: &Ray) -> bool {
    const SHORT: f32 = 0.3;
    if !has_subtrees(object) {
        return true;
    }
    if Isa::chosen() == Isa::Scalar {
        return false;
    }
    if !Q::ANY {
        return true;
    }
    let (header, d) = (object.header, ray.direction);
    let size = (0..3).fold(0f32, |size, k| size.max(header.upper[k] - header.lower[k]));
    d[0].abs().max(d[1].abs()).max(d[2].abs()) * ray.tmax <= SHORT * size
}

fn walk_tets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    faces: &[u32],
    queries: &mut [Q],
    walks: &mut [WalkState],
) {
    let whole = whole(object);
    let any = whole != NONE || faces.iter().any(|&face| face != NONE);
    let records =
        LaneRecords::new(object.records).filter(|_| any && tets::batch::WalkBatch::<Q>::fits(object));
    if let Some(records) = records {
        let leaves = vec![whole; rays.len()];
        let mut batch = tets::batch::WalkBatch::new(object, records, rays, faces, &leaves, queries, walks);
        // Without vectors the BVH is faster, and a hint of no use to it.
        let _ = Isa::chosen().run_wide(&mut batch);
    }
}

/// Traces rays that go together in packets; returns how many rays went in them. If any did, the others are in the scratch's
/// `rest`. None do in plain code, which has no vectors to fill.
fn in_packets<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    to: &mut Sink<'_, Q>,
) -> usize {
    Isa::chosen().run_wide(PacketKernel { object, rays, scratch, to }).unwrap_or(0)
}

/// Packets of rays that go together, as a kernel; returns how many rays went in them. If any did, the others are in the
/// scratch's rest.
struct PacketKernel<'a, 's, Q: Query> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    scratch: &'a mut Scratch,
    to: &'a mut Sink<'s, Q>,
}

impl<Q: Query> Kernel for PacketKernel<'_, '_, Q> {
    type Output = usize;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> usize {
        let packets = &mut self.scratch.packets;
        packet::trace(s, self.object, self.rays, packets, packet::MINIMUM_USE, self.to).rays
    }
}

/// Rays through the BVH, each on its own.
fn through_bvh<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: RemainingRays<'_, Q>,
    scratch: &mut Scratch,
    to: &mut Sink<'_, Q>,
) {
    if Isa::chosen() == Isa::Scalar {
        return one_by_one(object, rays, &remaining, to);
    }
    // Without vectors neither runs, and the branch above was taken.
    if object.has_packed_nodes() {
        let _ =
            Isa::chosen().run_wide(InterleavedKernel { nodes: Packed, object, rays, remaining, scratch, to });
    } else {
        let _ =
            Isa::chosen().run_wide(InterleavedKernel { nodes: Wide, object, rays, remaining, scratch, to });
    }
}

/// As [`through_bvh`] in plain code: one ray after the other, as there are no cache misses of vectors to overlap with and the
/// kernels of many rays would be the largest part of the library.
fn one_by_one<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    remaining: &RemainingRays<'_, Q>,
    to: &mut Sink<'_, Q>,
) {
    let trace = |place: usize, to: &mut Sink<'_, Q>| {
        let ray = &rays[place];
        let mut query = remaining.queries.map_or_else(|| Q::new(ray), |queries| queries[place]);
        let walked = remaining.walked.map_or(NONE, |walked| walked[place]);
        single::through_bvh(object, ray, &mut query, walked, &mut ());
        to.query(place, &query);
    };
    match remaining.order {
        Some(order) => order.iter().for_each(|&place| trace(place as usize, to)),
        None => (0..rays.len()).for_each(|place| trace(place, to)),
    }
}

/// As [`through_bvh`], as a kernel.
struct InterleavedKernel<'a, 's, N, Q: Query> {
    nodes: N,
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    remaining: RemainingRays<'a, Q>,
    scratch: &'a mut Scratch,
    to: &'a mut Sink<'s, Q>,
}

impl<N: Nodes, Q: Query> Kernel for InterleavedKernel<'_, '_, N, Q> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let InterleavedKernel { nodes, object, rays, remaining, scratch, to } = self;
        let walk = Interleaved { object, rays, remaining, stacks: &mut scratch.stacks, to };
        walk.run(s, nodes, |leaf, ray, query| {
            enter_tets(object, leaf, ray, query, &mut ()) == TetOutcome::Done
        });
    }
}
