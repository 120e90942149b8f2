//! Batches of rays through one object: those that start on a known surface walk its tetrahedra first, all together;
//! the rest goes through the BVH.

use super::Scratch;
use super::bvh_batch::{BatchWalk, Waiting};
use super::bvh_walk::TetOutcome;
use super::packets;
use super::query::{Any, Nearest, Query};
use super::records::LaneRecords;
use super::tet_batch::{self, Walk};
use super::tets::{enter_tets, leaf_of_face};
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};

/// Rays that walk tetrahedra together: enough that the last ones, which walk in lanes half empty, are few.
const PART: usize = 2048;

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
    trace::<Nearest>(object, rays, from, scratch, Sink { answers: hits, instance });
}

/// Whether rays in object space hit anything; `from` as for [`nearest_batch`].
pub(crate) fn any_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    trace::<Any>(object, rays, from, scratch, Sink { answers: found, instance: 0 });
}

/// Where answers go, by the place of their rays in the batch. Those that are not put are misses already.
struct Sink<'a, Q: Query> {
    answers: &'a mut [Q::Answer],
    instance: u32,
}

impl<Q: Query> Sink<'_, Q> {
    #[inline(always)]
    fn put(&mut self, ray: usize, query: &Q) {
        self.answers[ray] = query.answer(self.instance);
    }
}

fn trace<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    mut sink: Sink<'_, Q>,
) {
    if object.header.root == NONE {
        return;
    }
    let from = from.filter(|from| {
        let mut starts = rays.iter().zip(*from);
        !object.tet_leaves.is_empty()
            && starts.any(|(ray, &triangle)| triangle != NONE && is_worth_a_walk::<Q>(object, ray))
    });
    if from.is_some() || whole(object) != NONE {
        for (part, (rays, answers)) in rays.chunks(PART).zip(sink.answers.chunks_mut(PART)).enumerate() {
            let from = from.map(|from| &from[part * PART..][..rays.len()]);
            trace_hinted::<Q>(object, rays, from, scratch, &mut Sink { answers, instance: sink.instance });
        }
        return;
    }
    let packed = Isa::chosen().run(Together { object, rays, scratch, sink: &mut sink });
    if packed < rays.len() {
        let rest = std::mem::take(&mut scratch.packets.rest);
        let order = (packed > 0).then_some(&rest[..]);
        let waiting = Waiting { order, queries: None, walked: None };
        Isa::chosen().run(ThroughBvh { object, rays, waiting, scratch, sink: &mut sink });
        scratch.packets.rest = rest;
    }
}

/// The tet leaf that is the whole object, without another structure for rays that come from outside; or `NONE`.
fn whole(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(leaf)) if object.tet_leaves[leaf as usize].subtree == NONE => leaf,
        _ => NONE,
    }
}

/// Traces at most [`PART`] rays, some of which start on known surfaces, or all of which enter the same tetrahedra.
fn trace_hinted<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    sink: &mut Sink<'_, Q>,
) {
    // Packets of rays that go together beat all else, where they serve enough of their rays.
    let packed = Isa::chosen().run(Together { object, rays, scratch, sink });
    let mut faces = vec![NONE; rays.len()];
    let home = |ray: usize| {
        let triangle = from.map_or(NONE, |from| from[ray]);
        object.triangle_homes.get(triangle as usize).copied().unwrap_or(NONE)
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
    let mut walks = vec![Walk::Not; rays.len()];
    walk_tets(object, rays, &faces, &mut queries, &mut walks);
    let is_all = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let mut walked = vec![NONE; rays.len()];
    order.retain(|&ray| {
        let ray = ray as usize;
        let done = walks[ray] == Walk::Done || walks[ray] == Walk::Left && is_all;
        if done {
            sink.put(ray, &queries[ray]);
        } else if walks[ray] == Walk::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        !done
    });
    if !order.is_empty() {
        let waiting = Waiting { order: Some(&order), queries: Some(&queries), walked: Some(&walked) };
        Isa::chosen().run(ThroughBvh { object, rays, waiting, scratch, sink });
    }
}

/// Whether a ray that starts on a known surface is likely to be faster through tetrahedra than through the BVH beside
/// them, if there is one. By measurement (benchmarks/): with AVX-512 short any-hit rays are, long ones not;
/// nearest hits only where the tetrahedra do not exceed the caches by far. No answer depends on it.
fn is_worth_a_walk<Q: Query>(object: &ObjectView<'_>, ray: &Ray) -> bool {
    const MOST_TETS: usize = 400_000;
    const SHORT: f32 = 0.3;
    if object.tet_leaves.first().is_none_or(|leaf| leaf.subtree == NONE) {
        return true;
    }
    if Isa::chosen() != Isa::Avx512 {
        return false;
    }
    if !Q::ANY {
        return object.records.len() <= MOST_TETS;
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
    walks: &mut [Walk],
) {
    let whole = whole(object);
    let any = whole != NONE || faces.iter().any(|&face| face != NONE);
    let records = LaneRecords::new(object.records).filter(|_| any && tet_batch::Batch::<Q>::fits(object));
    if let Some(records) = records {
        let leaves = vec![whole; rays.len()];
        let mut batch = tet_batch::Batch::new(object, records, rays, faces, &leaves, queries, walks);
        // Without vectors the BVH is faster, and a hint of no use to it.
        let _ = Isa::chosen().run_wide(&mut batch);
    }
}

/// Packets of rays that go together, as a kernel; returns how many rays went in them. If any did, the others are in the
/// scratch's rest.
struct Together<'a, 'b, Q: Query> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    scratch: &'a mut Scratch,
    sink: &'a mut Sink<'b, Q>,
}

impl<Q: Query> Kernel for Together<'_, '_, Q> {
    type Output = usize;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> usize {
        let (packets, sink) = (&mut self.scratch.packets, self.sink);
        let done = |ray: usize, query: &Q| sink.put(ray, query);
        packets::trace(s, self.object, self.rays, packets, packets::LEAST_USE, done).rays
    }
}

/// Rays through the BVH, each on its own, as a kernel.
struct ThroughBvh<'a, 'b, Q: Query> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    waiting: Waiting<'a, Q>,
    scratch: &'a mut Scratch,
    sink: &'a mut Sink<'b, Q>,
}

impl<Q: Query> Kernel for ThroughBvh<'_, '_, Q> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let (object, rays, waiting, sink) = (self.object, self.rays, self.waiting, self.sink);
        let stacks = &mut self.scratch.stacks;
        let done = |ray: usize, query: &Q| sink.put(ray, query);
        let walk = BatchWalk { object, rays, waiting, stacks, done };
        walk.run(s, |leaf, ray, query| enter_tets(object, leaf, ray, query, &mut ()) == TetOutcome::Done);
    }
}
