//! Walks of the rays of a batch through tetrahedra, before those that remain go through the BVH. They are compiled once for all queries.

use super::strategy::{QueryKind, is_short, size_of};
use crate::query::{EitherGoal, EitherQuery, Goal, Query};
use crate::rays::Ray;
use crate::simd::Isa;
use crate::tets::batch::WalkBatch;
use crate::tets::leaf_of_face;
use crate::tets::records::LaneRecords;
use crate::tets::walks::{WalkLists, WalkRays, WalkState};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Greatest number of rays that walk through tetrahedra together. It is large, because lanes are idle at the end of each part.
pub(super) const RAYS_PER_PART: usize = 2048;

/// The rays of a batch after their walks, and memory of the walks, which is reused from one batch to the next. Lists with one element
/// per ray say so.
#[derive(Debug, Default)]
pub(super) struct WalkScratch {
    /// Indices of the rays that are to be walked, then of those that go through the BVH.
    pub(super) rest: Vec<u32>,
    /// Indices of the rays whose query is complete.
    pub(super) done: Vec<u32>,
    /// What is known of each ray.
    pub(super) queries: Vec<EitherQuery>,
    /// For each ray the tet leaf whose hits its query already holds, or `NONE`.
    pub(super) walked: Vec<u32>,
    /// For each ray the constrained face on which it starts, or `NONE`.
    faces: Vec<u32>,
    /// For each ray the state of its walk.
    states: Vec<WalkState>,
    lists: WalkLists,
}

/// The elements of a list, as many as there are rays, all with one value.
fn filled<T: Clone>(list: &mut Vec<T>, rays: usize, value: T) -> &mut [T] {
    list.clear();
    list.resize(rays, value);
    list
}

/// Walks those of at most [`RAYS_PER_PART`] rays whose indices are in `scratch.rest`: some of them start on known triangles, or all
/// enter the same tet leaf.
#[inline(never)]
pub(super) fn walk(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    goal: EitherGoal,
    scratch: &mut WalkScratch,
) {
    let WalkScratch { rest, done, queries, walked, faces, states, lists } = scratch;
    let face_of = |ray: usize| {
        let triangle = from.map_or(NONE, |from| from[ray]);
        object.triangle_faces.get(triangle as usize).copied().unwrap_or(NONE)
    };
    let faces = filled(faces, rays.len(), NONE);
    for &ray in &*rest {
        if may_gain_by_walk(object, &rays[ray as usize], goal) {
            faces[ray as usize] = face_of(ray as usize);
        }
    }
    queries.clear();
    queries.extend(rays.iter().map(|ray| EitherQuery::new(goal, ray)));
    let states = filled(states, rays.len(), WalkState::NotWalked);
    walk_tets(object, rays, faces, queries, states, lists);
    let is_whole_object = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let walked = filled(walked, rays.len(), NONE);
    done.clear();
    rest.retain(|&index| {
        let ray = index as usize;
        let is_done = states[ray] == WalkState::Done || states[ray] == WalkState::Left && is_whole_object;
        if is_done {
            done.push(index);
        } else if states[ray] == WalkState::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        !is_done
    });
}

/// Whether the triangles of tet leaves are also in a BVH.
pub(super) fn has_subtrees(object: &ObjectView<'_>) -> bool {
    object.tet_leaves.first().is_some_and(|leaf| leaf.subtree != NONE)
}

/// Index of the tet leaf that is the whole object, if its triangles are not also in a BVH; else `NONE`.
pub(super) fn sole_tet_leaf(object: &ObjectView<'_>) -> u32 {
    match Child::from_code(object.header.root) {
        Some(Child::Tets(leaf)) if object.tet_leaves[leaf as usize].subtree == NONE => leaf,
        _ => NONE,
    }
}

/// Whether rays of a kind that start on known triangles may be faster through tetrahedra than through the BVH, if there is one.
///
/// By measurement (docs/notes/tets.md), long any-hit rays and all rays in scalar code are not, and with 128 bits no walk is compiled;
/// for other rays [`super::strategy`] chooses by measured time. No answer depends on this.
pub(super) fn may_gain_by_walks(object: &ObjectView<'_>, kind: QueryKind) -> bool {
    !has_subtrees(object) || Isa::chosen().walks_tets() && (!kind.any || kind.short)
}

/// As [`may_gain_by_walks`], of one ray.
pub(super) fn may_gain_by_walk(object: &ObjectView<'_>, ray: &Ray, goal: impl Goal) -> bool {
    let any = goal.is_any();
    may_gain_by_walks(object, QueryKind { any, short: any && is_short(ray, size_of(object)) })
}

/// Walks the rays through tetrahedra: those that have a face in `faces`, or all if a tet leaf is the whole object. `states`
/// receives the state of each ray's walk. All slices have one element per ray.
fn walk_tets(
    object: &ObjectView<'_>,
    rays: &[Ray],
    faces: &[u32],
    queries: &mut [EitherQuery],
    states: &mut [WalkState],
    lists: &mut WalkLists,
) {
    let sole_leaf = sole_tet_leaf(object);
    let has_walks = sole_leaf != NONE || faces.iter().any(|&face| face != NONE);
    let records = LaneRecords::new(object.records).filter(|_| has_walks && WalkBatch::fits(object));
    if let Some(records) = records {
        let rays = WalkRays { rays, faces, sole_leaf };
        let mut batch = WalkBatch::new(object, records, rays, queries, states, lists);
        // Where no walks are compiled, no ray is walked here, and `states` stay `NotWalked`: rays are faster through the BVH.
        let _ = Isa::chosen().run_long_vectors(&mut batch);
    }
}
