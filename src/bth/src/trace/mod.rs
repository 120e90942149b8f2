//! Tracing rays through one object: BVH walk, tet walk, and what both share.

mod bvh_walk;
mod line;
mod query;
mod records;
mod slabs;
mod tet_batch;
mod tet_decide;
mod tet_flood;
mod tet_hinted;
mod tet_lanes;
mod tet_locate;
mod tet_queue;
mod tet_rounds;
mod tet_walk;

pub use query::Steps;
pub(crate) use tet_hinted::{any_hinted, nearest_hinted, whole};

use crate::layout::{Child, NONE};
use crate::object::{ObjectView, Records};
use crate::rays::{Hit, Ray};
use bvh_walk::TetOutcome;
use line::Line;
use query::{Any, Count, Nearest, Query};
use records::Record;
use slabs::Slabs;
use tet_walk::{Outcome, TetSpace};

/// Memory that traversals need, kept from one ray to the next.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    stack: bvh_walk::Stack,
}

/// Nearest hit of a ray in object space; `from` is the triangle it starts on, or `NONE`.
pub(crate) fn nearest(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    scratch: &mut Scratch,
) -> Hit {
    let mut query = Nearest::new(ray);
    trace(object, ray, from, scratch, &mut query, &mut ());
    query.hit(instance)
}

/// As [`nearest`], with a count of the work.
pub(crate) fn nearest_counted(object: &ObjectView<'_>, ray: &Ray, from: u32, instance: u32) -> (Hit, Steps) {
    let (mut query, mut steps) = (Nearest::new(ray), Steps::default());
    trace(object, ray, from, &mut Scratch::default(), &mut query, &mut steps);
    (query.hit(instance), steps)
}

/// Whether a ray in object space hits anything.
pub(crate) fn any(object: &ObjectView<'_>, ray: &Ray, from: u32, scratch: &mut Scratch) -> bool {
    let mut query = Any::new(ray);
    trace(object, ray, from, scratch, &mut query, &mut ());
    query.found
}

fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    scratch: &mut Scratch,
    query: &mut Q,
    count: &mut C,
) {
    match object.records {
        Records::None => {
            trace_with::<crate::layout::Tet20, _, _>(object, &[], ray, from, scratch, query, count)
        }
        Records::Link32(records) => trace_with(object, records, ray, from, scratch, query, count),
        Records::Tet32(records) => trace_with(object, records, ray, from, scratch, query, count),
        Records::Tet20(records) => trace_with(object, records, ray, from, scratch, query, count),
        Records::Tet16(records) => trace_with(object, records, ray, from, scratch, query, count),
    }
}

fn trace_with<R: Record, Q: Query, C: Count>(
    object: &ObjectView<'_>,
    records: &[R],
    ray: &Ray,
    from: u32,
    scratch: &mut Scratch,
    query: &mut Q,
    count: &mut C,
) {
    let Some(line) = Line::new(ray) else { return };
    // A hint changes where the search begins, never what is found: the tet leaf of the surface is
    // walked first, from the surface, and left out later.
    let (mut walked, row) = (NONE, object.triangle_homes.get(from as usize).copied().unwrap_or(NONE));
    // Such a walk sees only what lies ahead of the origin.
    if row != NONE && ray.tmin >= 0.0 {
        let leaf = leaf_of_face(object, row);
        let space = space(object, records, leaf, &line);
        if let Some(place) = space.locate(row) {
            count.leaf();
            let outcome = match space.walk(place, query, count) {
                Outcome::Uncertain => space.flood(query, count),
                outcome => outcome,
            };
            if outcome == Outcome::Done {
                return;
            }
            walked = leaf;
        }
    }
    trace_rest(object, records, ray, &line, walked, scratch, query, count);
}

/// What remains once a tet leaf, if any, has been walked.
#[allow(clippy::too_many_arguments)]
fn trace_rest<R: Record, Q: Query, C: Count>(
    object: &ObjectView<'_>,
    records: &[R],
    ray: &Ray,
    line: &Line,
    walked: u32,
    scratch: &mut Scratch,
    query: &mut Q,
    count: &mut C,
) {
    if object.header.root == NONE || object.header.root == Child::Tets(walked).code() && walked != NONE {
        return;
    }
    let slabs = Slabs::new(ray, line, object.header);
    let stack = &mut scratch.stack;
    bvh_walk::walk(object, line, &slabs, stack, query, count, |leaf, query, count| {
        if leaf == walked {
            return TetOutcome::GoOn;
        }
        let subtree = object.tet_leaves[leaf as usize].subtree;
        if subtree != NONE {
            return TetOutcome::Instead(subtree);
        }
        count.leaf();
        let space = space(object, records, leaf, line);
        let outcome = match space.enter_hull() {
            Ok(place) => space.walk(place, query, count),
            Err(outcome) => outcome,
        };
        match outcome {
            Outcome::Uncertain if space.flood(query, count) == Outcome::Done => TetOutcome::Done,
            Outcome::Done => TetOutcome::Done,
            _ => TetOutcome::GoOn,
        }
    });
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
