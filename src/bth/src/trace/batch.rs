//! Batches of rays through one object: those that start on a known surface walk its tetrahedra first, all together;
//! the rest goes through the BVH.

use super::Scratch;
use super::bvh_batch::{BatchWalk, Waiting};
use super::bvh_walk::TetOutcome;
use super::query::{Any, Nearest, Query};
use super::records::LaneRecord;
use super::tet_batch::{self, Walk};
use super::tets::{enter_tets, leaf_of_face};
use crate::layout::{Child, NONE};
use crate::object::{ObjectView, Records};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use std::marker::PhantomData;

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
    trace(object, rays, from, scratch, |ray, query: &Nearest| hits[ray] = query.hit(instance));
}

/// Whether rays in object space hit anything; `from` as for [`nearest_batch`].
pub(crate) fn any_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    found: &mut [bool],
) {
    trace(object, rays, from, scratch, |ray, query: &Any| found[ray] = query.found);
}

fn trace<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    scratch: &mut Scratch,
    mut done: impl FnMut(usize, &Q),
) {
    if object.header.root == NONE {
        return;
    }
    let Some(from) = from.filter(|_| !object.tet_leaves.is_empty()) else {
        let waiting = Waiting::all();
        return Isa::chosen().run(ThroughBvh { object, rays, waiting, scratch, done, query: PhantomData });
    };
    for (part, (rays, from)) in rays.chunks(PART).zip(from.chunks(PART)).enumerate() {
        trace_hinted(object, rays, from, scratch, |ray, query: &Q| done(part * PART + ray, query));
    }
}

/// Traces at most [`PART`] rays, some of which start on known surfaces.
fn trace_hinted<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    scratch: &mut Scratch,
    mut done: impl FnMut(usize, &Q),
) {
    let home = |&triangle: &u32| object.triangle_homes.get(triangle as usize).copied().unwrap_or(NONE);
    let faces: Vec<u32> = from.iter().map(home).collect();
    let mut queries: Vec<Q> = rays.iter().map(Q::new).collect();
    let mut walks = vec![Walk::Not; rays.len()];
    match object.records {
        Records::None => {}
        Records::Link32(records) => walk_tets(object, records, rays, &faces, &mut queries, &mut walks),
        Records::Tet32(records) => walk_tets(object, records, rays, &faces, &mut queries, &mut walks),
        Records::Tet20(records) => walk_tets(object, records, rays, &faces, &mut queries, &mut walks),
        Records::Tet16(records) => walk_tets(object, records, rays, &faces, &mut queries, &mut walks),
    }
    let is_all = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let (mut order, mut walked) = (Vec::with_capacity(rays.len()), vec![NONE; rays.len()]);
    for (ray, walk) in walks.iter().enumerate() {
        if *walk == Walk::Done || *walk == Walk::Left && is_all {
            done(ray, &queries[ray]);
            continue;
        }
        if *walk == Walk::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        order.push(ray as u32);
    }
    let waiting = Waiting { order: Some(&order), queries: Some(&queries), walked: Some(&walked) };
    Isa::chosen().run(ThroughBvh { object, rays, waiting, scratch, done, query: PhantomData });
}

fn walk_tets<R: LaneRecord, Q: Query>(
    object: &ObjectView<'_>,
    records: &[R],
    rays: &[Ray],
    faces: &[u32],
    queries: &mut [Q],
    walks: &mut [Walk],
) {
    if tet_batch::Batch::<R, Q>::fits(object, records) && faces.iter().any(|&face| face != NONE) {
        Isa::chosen().run(&mut tet_batch::Batch::new(object, records, rays, faces, queries, walks));
    }
}

/// Rays through the BVH, as a kernel.
struct ThroughBvh<'a, Q, D> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    waiting: Waiting<'a, Q>,
    scratch: &'a mut Scratch,
    /// Takes the results.
    done: D,
    query: PhantomData<Q>,
}

impl<Q: Query, D: FnMut(usize, &Q)> Kernel for ThroughBvh<'_, Q, D> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let walk = BatchWalk {
            object: self.object,
            rays: self.rays,
            waiting: self.waiting,
            stacks: &mut self.scratch.stacks,
            done: self.done,
        };
        walk.run(s, |leaf, ray, query| {
            enter_tets(self.object, leaf, ray, query, &mut ()) == TetOutcome::Done
        });
    }
}
