//! Batches of rays that start on known surfaces, or all in one tet leaf: the tet leaves are walked all together, the
//! rest of the structure ray by ray.

use super::line::Line;
use super::query::{Any, Nearest, Query};
use super::records::LaneRecord;
use super::tet_batch::{Batch, Walk};
use super::{Scratch, leaf_of_face, trace_rest, trace_with};
use crate::layout::{Child, NONE};
use crate::object::{ObjectView, Records};
use crate::rays::{Hit, Ray};
use crate::simd::Isa;

/// Rays that are walked together: enough that the last ones, which walk in lanes half empty, are few.
const PART: usize = 2048;

/// Nearest hits of rays that start on the triangles `from` of an object, or on none (`NONE`); only what is nearer than
/// `hits` already.
pub(crate) fn nearest_hinted(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    instance: u32,
    hits: &mut [Hit],
    scratch: &mut Scratch,
) {
    let parts = rays.chunks(PART).zip(from.chunks(PART)).zip(hits.chunks_mut(PART));
    for ((rays, from), hits) in parts {
        // Not `min`, which would take NaN for no limit.
        let tmax = |ray: &Ray, hit: &Hit| if hit.t < ray.tmax { hit.t } else { ray.tmax };
        let shortened: Vec<Ray> =
            rays.iter().zip(&*hits).map(|(ray, hit)| Ray { tmax: tmax(ray, hit), ..*ray }).collect();
        let mut queries: Vec<Nearest> = shortened.iter().map(Nearest::new).collect();
        trace(object, &shortened, from, &mut queries, scratch);
        for (query, best) in queries.iter().zip(hits) {
            let hit = query.hit(instance);
            if hit.t < best.t {
                *best = hit;
            }
        }
    }
}

/// Whether rays hit anything; `from` as for [`nearest_hinted`]. Those that are known to already are left out.
pub(crate) fn any_hinted(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    found: &mut [bool],
    scratch: &mut Scratch,
) {
    let parts = rays.chunks(PART).zip(from.chunks(PART)).zip(found.chunks_mut(PART));
    for ((rays, from), found) in parts {
        let mut queries: Vec<Any> = rays.iter().map(Any::new).collect();
        trace(object, rays, from, &mut queries, scratch);
        for (query, found) in queries.iter().zip(found) {
            *found |= query.found;
        }
    }
}

/// The tet leaf that is the whole object, without another structure for rays that come from outside; or [`NONE`].
pub(crate) fn whole(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(leaf)) if object.tet_leaves[leaf as usize].subtree == NONE => leaf,
        _ => NONE,
    }
}

fn trace<Q: Query + Copy>(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: &[u32],
    queries: &mut [Q],
    scratch: &mut Scratch,
) {
    match object.records {
        Records::None => {
            trace_with_records::<crate::layout::Tet20, _>(object, &[], rays, from, queries, scratch)
        }
        Records::Link32(records) => trace_with_records(object, records, rays, from, queries, scratch),
        Records::Tet32(records) => trace_with_records(object, records, rays, from, queries, scratch),
        Records::Tet20(records) => trace_with_records(object, records, rays, from, queries, scratch),
        Records::Tet16(records) => trace_with_records(object, records, rays, from, queries, scratch),
    }
}

fn trace_with_records<R: LaneRecord, Q: Query + Copy>(
    object: &ObjectView<'_>,
    records: &[R],
    rays: &[Ray],
    from: &[u32],
    queries: &mut [Q],
    scratch: &mut Scratch,
) {
    let home = |&triangle: &u32| object.triangle_homes.get(triangle as usize).copied().unwrap_or(NONE);
    let faces: Vec<u32> = from.iter().map(home).collect();
    let whole = whole(object);
    let nothing_to_walk = whole == NONE && faces.iter().all(|&face| face == NONE);
    let isa = Isa::chosen();
    // Lanes of plain code would take half as long again as the walk of one ray.
    if isa == Isa::Scalar || nothing_to_walk || !Batch::<R, Q>::fits(object, records) {
        for ((ray, &from), query) in rays.iter().zip(from).zip(queries) {
            trace_with(object, records, ray, from, scratch, query, &mut ());
        }
        return;
    }
    let mut walks = vec![Walk::Not; rays.len()];
    let leaves = vec![whole; rays.len()];
    isa.run(&mut Batch::new(object, records, rays, &faces, &leaves, queries, &mut walks));
    let root = Child::from_code(object.header.root);
    let only = whole != NONE || (matches!(root, Some(Child::Tets(_))) && object.tet_leaves.len() == 1);
    for (((ray, &face), query), &walk) in rays.iter().zip(&faces).zip(queries).zip(&walks) {
        if walk == Walk::Done || (walk == Walk::Left && only) {
            continue;
        }
        let Some(line) = Line::new(ray) else { continue };
        let walked = if walk == Walk::Left { leaf_of_face(object, face) } else { NONE };
        trace_rest(object, records, ray, &line, walked, scratch, query, &mut ());
    }
}
