//! Walks of the rays of a batch through tetrahedra, before those that remain go through the BVH.
//! They are compiled once for all queries.

use crate::bvh::nodes::sole_tet_leaf;
use crate::query::{EitherGoal, EitherQuery};
use crate::rays::Ray;
use crate::simd::Isa;
use crate::tets::batch::WalkBatch;
use crate::tets::records::LaneRecords;
use crate::tets::walks::{WalkLists, WalkState};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Largest number of rays that walk through tetrahedra together. It is large, because lanes are
/// idle at the end of each part.
pub(super) const RAYS_PER_PART: usize = 2048;

/// The rays of a batch after their walks, and memory of the walks, which is reused from one batch
/// to the next. Lists with one element per ray say so.
#[derive(Debug, Default)]
pub(super) struct WalkScratch {
    /// Indices of the rays that were not walked.
    pub(super) rest: Vec<u32>,
    /// Indices of the rays whose query is complete.
    pub(super) done: Vec<u32>,
    /// What is known of each ray.
    pub(super) queries: Vec<EitherQuery>,
    /// For each ray the tet leaf whose hits its query already holds, or `NONE`.
    pub(super) walked: Vec<u32>,
    /// For each ray the state of its walk.
    states: Vec<WalkState>,
    lists: WalkLists,
}

/// Resizes a list to one element per ray, all with one value.
fn filled<T: Clone>(list: &mut Vec<T>, rays: usize, value: T) -> &mut [T] {
    list.clear();
    list.resize(rays, value);
    list
}

/// Walks at most [`RAYS_PER_PART`] rays, which all enter the tet leaf that is the whole object.
#[inline(never)]
pub(super) fn walk(object: &ObjectView<'_>, rays: &[Ray], goal: EitherGoal, scratch: &mut WalkScratch) {
    let WalkScratch { rest, done, queries, walked, states, lists } = scratch;
    queries.clear();
    queries.extend(rays.iter().map(|ray| EitherQuery::new(goal, ray)));
    let states = filled(states, rays.len(), WalkState::NotWalked);
    let records = LaneRecords::new(object.records).filter(|_| WalkBatch::fits(object));
    if let Some(records) = records {
        let of = (rays, sole_tet_leaf(object));
        let mut batch = WalkBatch::new(object, records, of, queries, states, lists);
        // Elsewhere no ray is walked here, and `states` stay `NotWalked`: rays are faster through
        // the BVH.
        if Isa::chosen().has_long_vectors() {
            Isa::chosen().run(&mut batch);
        }
    }
    filled(walked, rays.len(), NONE);
    done.clear();
    rest.clear();
    for (index, state) in (0..).zip(&*states) {
        if *state == WalkState::NotWalked { rest.push(index) } else { done.push(index) }
    }
}
