//! Tet walks of a batch of rays in one tet leaf: the state of the batch, and the choice between
//! rays that are prepared and faces that are tested.
//!
//! The kernel is in [`super::rounds`]; the decisions that its f32 lanes leave open are made in
//! [`super::decide`].

use super::queue::PreparedQueue;
use super::starts::Fill;
use super::walks::{WalkLists, WalkState, Walks};
use crate::query::{EitherQuery, Goal};
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::object::ObjectView;

/// When this many faces have been reached, they are tested together in f64.
const PENDING: usize = 64;

/// A batch of rays that walk through tetrahedra, with their queries.
pub(crate) struct WalkBatch<'a> {
    pub(super) walks: Walks<'a>,
    /// For each ray its query, which receives the hits.
    pub(super) queries: &'a mut [EitherQuery],
}

impl<'a> WalkBatch<'a> {
    /// A batch in which no ray has been walked. All slices have one element per ray.
    pub(crate) fn new(
        object: &'a ObjectView<'a>,
        (rays, leaf): (&'a [Ray], u32),
        queries: &'a mut [EitherQuery],
        states: &'a mut [WalkState],
        lists: &'a mut WalkLists,
    ) -> Self {
        let keeps_depths = queries.first().is_some_and(|query| query.goal().is_any());
        let walks = Walks::new(object, rays, leaf, keeps_depths, states, lists);
        WalkBatch { walks, queries }
    }

    /// Returns true if lanes can address the tetrahedra of an object: gathers need indices of words
    /// below 2^31.
    pub(crate) fn fits(object: &ObjectView<'_>) -> bool {
        const MAX_WORDS: usize = 1 << 31;
        object.records.len() < MAX_WORDS / 8
            && object.tet_vertices.len() < MAX_WORDS / 4
            && object.tet_faces.len() < MAX_WORDS / 8
    }

    /// Fills the empty queue with prepared rays. It stays empty only if no rays are left.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
        if self.walks.reached.len() >= PENDING {
            self.test_reached_faces(s);
        }
        loop {
            s.call(Fill { walks: &mut self.walks, queue });
            self.walk_without_lanes();
            if queue.len() != 0 || self.walks.reached.is_empty() && self.walks.starts.is_empty() {
                return;
            }
            // Behind the faces that are tested, walks may go on.
            self.test_reached_faces(s);
        }
    }
}
