//! Tracing rays through one object: BVH walk, tet walk, and what both share.

mod bvh_batch;
mod bvh_walk;
mod crossing;
mod flight;
mod line;
mod prepare;
mod query;
mod records;
mod sight;
mod slabs;
mod stack;
mod tet_flood;
mod tet_locate;
mod tet_walk;

pub use query::Steps;

use crate::layout::{Child, NONE};
use crate::object::{ObjectView, Records};
use crate::rays::{Hit, Ray};
use crate::simd::{Isa, Kernel, Simd};
use bvh_batch::{BatchWalk, Waiting};
use bvh_walk::TetOutcome;
use flight::Flight;
use line::Line;
use query::{Any, Count, Nearest, Query};
use records::Record;
use stack::Stacks;
use std::cell::Cell;
use std::marker::PhantomData;
use tet_walk::{Outcome, TetSpace};

/// Memory that traversals need, kept from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    stacks: Stacks,
}

/// Lends the thread's scratch memory.
pub(crate) fn with_scratch<R>(work: impl FnOnce(&mut Scratch) -> R) -> R {
    thread_local! {
        static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
    }
    // Taken out while it is in use, so that a panic leaves nothing half done behind.
    let mut scratch = SCRATCH.take().unwrap_or_default();
    let result = work(&mut scratch);
    SCRATCH.set(Some(scratch));
    result
}

/// Nearest hit of a ray in object space; `from` is the triangle it starts on, or `NONE`.
pub(crate) fn nearest(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    scratch: &mut Scratch,
) -> Hit {
    let query = Nearest::new(ray);
    trace(object, ray, from, scratch, query, &mut ()).hit(instance)
}

/// As [`nearest`], with a count of the work.
pub(crate) fn nearest_counted(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> (Hit, Steps) {
    let mut steps = Steps::default();
    let query = with_scratch(|scratch| trace(object, ray, from, scratch, Nearest::new(ray), &mut steps));
    (query.hit(instance), steps)
}

/// Whether a ray in object space hits anything.
pub(crate) fn any(object: &ObjectView<'_>, ray: &Ray, from: u32, scratch: &mut Scratch) -> bool {
    trace(object, ray, from, scratch, Any::new(ray), &mut ()).found
}

/// Nearest hits of many rays in object space.
pub(crate) fn nearest_batch(
    object: &ObjectView<'_>,
    rays: &[Ray],
    instance: u32,
    scratch: &mut Scratch,
    hits: &mut [Hit],
) {
    trace_batch(object, rays, scratch, |ray, query: &Nearest| hits[ray] = query.hit(instance));
}

/// Whether each of many rays in object space hits anything.
pub(crate) fn any_batch(object: &ObjectView<'_>, rays: &[Ray], scratch: &mut Scratch, found: &mut [bool]) {
    trace_batch(object, rays, scratch, |ray, query: &Any| found[ray] = query.found);
}

fn trace_batch<Q: Query>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    scratch: &mut Scratch,
    done: impl FnMut(usize, &Q),
) {
    if object.header.root != NONE {
        Isa::chosen().run(Batch { object, rays, scratch, done, query: PhantomData });
    }
}

struct Batch<'a, Q, D> {
    object: &'a ObjectView<'a>,
    rays: &'a [Ray],
    scratch: &'a mut Scratch,
    /// Takes the results.
    done: D,
    query: PhantomData<Q>,
}

impl<Q: Query, D: FnMut(usize, &Q)> Kernel for Batch<'_, Q, D> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let walk = BatchWalk {
            object: self.object,
            rays: self.rays,
            waiting: Waiting { order: None, queries: None },
            stacks: &mut self.scratch.stacks,
            done: self.done,
        };
        walk.run(s, |leaf, ray, query| {
            enter_tets(self.object, leaf, ray, query, &mut ()) == TetOutcome::Done
        });
    }
}

/// Traces one ray and returns the query as it ends.
fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    scratch: &mut Scratch,
    mut query: Q,
    count: &mut C,
) -> Q {
    let walked = match start_in_tets(object, ray, from, &mut query, count) {
        Start::Done => return query,
        Start::Walked(leaf) => leaf,
    };
    if object.header.root == NONE || object.header.root == Child::Tets(walked).code() && walked != NONE {
        return query;
    }
    Isa::chosen().run(Single { object, ray, walked, query, scratch, count })
}

struct Single<'a, Q, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    /// A tet leaf to leave out.
    walked: u32,
    query: Q,
    scratch: &'a mut Scratch,
    count: &'a mut C,
}

impl<Q: Query, C: Count> Kernel for Single<'_, Q, C> {
    type Output = Q;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q {
        let Some(mut flight) = Flight::new(self.object, self.ray, self.query) else { return self.query };
        self.scratch.stacks.reserve(self.object, 1);
        bvh_walk::walk(
            s,
            self.object,
            self.ray,
            self.walked,
            &mut flight,
            &mut self.scratch.stacks,
            self.count,
            |leaf, query, count| enter_tets(self.object, leaf, self.ray, query, count),
        );
        *flight.query()
    }
}

/// What became of a ray where it starts.
enum Start {
    Done,
    /// Goes on without this tet leaf, if any.
    Walked(u32),
}

/// A hint changes where the search begins, never what is found: the tet leaf of the surface is walked first, from
/// the surface, and left out later.
fn start_in_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    query: &mut Q,
    count: &mut C,
) -> Start {
    let row = object.triangle_homes.get(from as usize).copied().unwrap_or(NONE);
    // Such a walk sees only what lies ahead of the origin. One ray alone is faster through the BVH, if there is one.
    if row == NONE || ray.tmin < 0.0 {
        return Start::Walked(NONE);
    }
    let leaf = leaf_of_face(object, row);
    let Some(line) = Line::new(ray) else { return Start::Done };
    let outcome = match object.records {
        Records::None => None,
        Records::Link32(records) => start(object, records, leaf, row, &line, query, count),
        Records::Tet32(records) => start(object, records, leaf, row, &line, query, count),
        Records::Tet20(records) => start(object, records, leaf, row, &line, query, count),
        Records::Tet16(records) => start(object, records, leaf, row, &line, query, count),
    };
    match outcome {
        Some(Outcome::Done) => Start::Done,
        Some(_) => Start::Walked(leaf),
        None => Start::Walked(NONE),
    }
}

fn start<R: Record, Q: Query, C: Count>(
    object: &ObjectView<'_>,
    records: &[R],
    leaf: u32,
    row: u32,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> Option<Outcome> {
    let space = space(object, records, leaf, line);
    let place = space.locate(row)?;
    count.leaf();
    Some(match space.walk(place, query, count) {
        Outcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    })
}

/// Walks through a tet leaf that has no subtree, from its hull.
#[inline(never)]
fn enter_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    leaf: u32,
    ray: &Ray,
    query: &mut Q,
    count: &mut C,
) -> TetOutcome {
    let Some(line) = Line::new(ray) else { return TetOutcome::Done };
    match object.records {
        Records::None => TetOutcome::GoOn,
        Records::Link32(records) => enter(object, records, leaf, &line, query, count),
        Records::Tet32(records) => enter(object, records, leaf, &line, query, count),
        Records::Tet20(records) => enter(object, records, leaf, &line, query, count),
        Records::Tet16(records) => enter(object, records, leaf, &line, query, count),
    }
}

fn enter<R: Record, Q: Query, C: Count>(
    object: &ObjectView<'_>,
    records: &[R],
    leaf: u32,
    line: &Line,
    query: &mut Q,
    count: &mut C,
) -> TetOutcome {
    let space = space(object, records, leaf, line);
    let outcome = match space.enter_hull() {
        Ok(place) => space.walk(place, query, count),
        Err(outcome) => outcome,
    };
    let outcome = match outcome {
        Outcome::Uncertain => space.flood(query, count),
        outcome => outcome,
    };
    if outcome == Outcome::Done { TetOutcome::Done } else { TetOutcome::GoOn }
}

/// The tet leaf that a constrained face belongs to.
fn leaf_of_face(object: &ObjectView<'_>, row: u32) -> u32 {
    object.tet_leaves.partition_point(|leaf| leaf.first_face <= row) as u32 - 1
}

fn space<'a, R: Record>(
    object: &ObjectView<'a>,
    records: &'a [R],
    leaf: u32,
    line: &'a Line,
) -> TetSpace<'a, R> {
    let leaf = &object.tet_leaves[leaf as usize];
    let hull = &object.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize];
    TetSpace::new(leaf, records, object.tet_vertices, object.tet_faces, hull, line)
}
