//! Walks of the rays of a batch through tetrahedra, before those that remain go through the BVH. They are compiled once for all queries.

use super::strategy::{is_short, size_of};
use crate::query::{EitherGoal, EitherQuery, Goal, Query};
use crate::rays::Ray;
use crate::simd::Isa;
use crate::tets::batch::{WalkBatch, WalkRays};
use crate::tets::leaf_of_face;
use crate::tets::records::LaneRecords;
use crate::tets::walks::WalkState;
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Greatest number of rays that walk through tetrahedra together. It is large, because lanes are idle at the end of each part.
pub(super) const RAYS_PER_PART: usize = 2048;

/// The rays of a batch after their walks. All but `done` and `rest` have one element per ray.
pub(super) struct WalkedRays {
    /// What is known of each ray.
    pub(super) queries: Vec<EitherQuery>,
    /// Indices of the rays whose query is complete.
    pub(super) done: Vec<u32>,
    /// Indices of the rays that go through the BVH.
    pub(super) rest: Vec<u32>,
    /// The tet leaf whose hits the query of a ray already holds, or `NONE`.
    pub(super) walked: Vec<u32>,
}

/// Walks the rays with the indices `order`, at most [`RAYS_PER_PART`], some of which start on known triangles, or all of which enter
/// the same tet leaf.
#[inline(never)]
pub(super) fn walk(
    object: &ObjectView<'_>,
    rays: &[Ray],
    from: Option<&[u32]>,
    mut order: Vec<u32>,
    goal: EitherGoal,
) -> WalkedRays {
    let mut faces = vec![NONE; rays.len()];
    let face_of = |ray: usize| {
        let triangle = from.map_or(NONE, |from| from[ray]);
        object.triangle_faces.get(triangle as usize).copied().unwrap_or(NONE)
    };
    for &ray in &order {
        if may_gain_by_walk(object, &rays[ray as usize], goal) {
            faces[ray as usize] = face_of(ray as usize);
        }
    }
    let mut queries: Vec<_> = rays.iter().map(|ray| EitherQuery::new(goal, ray)).collect();
    let mut walks = vec![WalkState::NotWalked; rays.len()];
    walk_tets(object, rays, &faces, &mut queries, &mut walks);
    let is_whole_object = matches!(Child::from_code(object.header.root), Some(Child::Tets(_)));
    let (mut done, mut walked) = (Vec::new(), vec![NONE; rays.len()]);
    order.retain(|&index| {
        let ray = index as usize;
        let is_done = walks[ray] == WalkState::Done || walks[ray] == WalkState::Left && is_whole_object;
        if is_done {
            done.push(index);
        } else if walks[ray] == WalkState::Left {
            walked[ray] = leaf_of_face(object, faces[ray]);
        }
        !is_done
    });
    WalkedRays { queries, done, rest: order, walked }
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

/// Whether a ray that starts on a known triangle may be faster through tetrahedra than through the BVH, if there is one.
///
/// By measurement (docs/notes/tets.md), long any-hit rays and all rays in scalar code are not, and with 128 bits no walk is compiled;
/// for other rays [`super::strategy`] chooses by measured time. No answer depends on this.
pub(super) fn may_gain_by_walk(object: &ObjectView<'_>, ray: &Ray, goal: impl Goal) -> bool {
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
fn walk_tets(
    object: &ObjectView<'_>,
    rays: &[Ray],
    faces: &[u32],
    queries: &mut [EitherQuery],
    walks: &mut [WalkState],
) {
    let sole_leaf = sole_tet_leaf(object);
    let has_walks = sole_leaf != NONE || faces.iter().any(|&face| face != NONE);
    let records = LaneRecords::new(object.records).filter(|_| has_walks && WalkBatch::fits(object));
    if let Some(records) = records {
        let leaves = vec![sole_leaf; rays.len()];
        let mut batch =
            WalkBatch::new(object, records, WalkRays { rays, faces, leaves: &leaves }, queries, walks);
        // Where no walks are compiled, no ray is walked here, and `walks` stays `NotWalked`: rays are faster through the BVH.
        let _ = Isa::chosen().run_long_vectors(&mut batch);
    }
}
