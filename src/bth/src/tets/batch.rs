//! Tet walks of a batch of rays, in one or several tet leaves: the state of the batch, and the choice of the rays that are
//! prepared next.
//!
//! The kernel is in [`super::rounds`]; the decisions that its f32 lanes leave open are made in [`super::decide`].

use super::queue::PreparedQueue;
use super::records::{Entered, LaneRecords};
use super::starts::Fill;
use super::walk::TetPosition;
use crate::query::{EitherQuery, Goal, Query};
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::object::ObjectView;
use zerocopy::{FromBytes, IntoBytes};

/// When this many faces have been reached, they are tested together in f64.
const PENDING: usize = 64;

/// State of a ray's walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WalkState {
    /// The ray was not walked.
    NotWalked,
    /// The query holds all hits of the ray in the tet leaf that can change its result.
    Left,
    /// The query is complete.
    Done,
}

/// The tetrahedron in which a ray's walk begins or continues.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkStart {
    /// Index of the ray in the batch.
    pub(super) ray: u32,
    pub(super) tet: u32,
    /// The line certainly crosses the entered face, whose corners are counterclockwise as seen along the ray.
    pub(super) entered: Entered,
}

/// A constrained face that a ray's line certainly crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    /// Index of the ray in the batch.
    pub(super) ray: u32,
    /// Index of the face in the object's constrained faces.
    pub(super) face: u32,
}

/// The rays of a batch and where their walks begin, as in the fields of [`WalkBatch`].
pub(crate) struct WalkRays<'a> {
    pub(crate) rays: &'a [Ray],
    pub(crate) faces: &'a [u32],
    pub(crate) leaves: &'a [u32],
}

/// The walks of a batch of rays, but for the queries. All slices have one element per ray.
pub(super) struct Walks<'a> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) records: LaneRecords<'a>,
    /// The rays, in object space.
    pub(super) rays: &'a [Ray],
    /// For each ray the constrained face near which it starts, or `NONE`.
    pub(super) faces: &'a [u32],
    /// For each ray the tet leaf that it enters from outside if it does not start near a face, or `NONE`.
    pub(super) leaves: &'a [u32],
    /// Whether the walks keep track of depths: they can end any-hit queries, whose rays are often short.
    pub(super) keeps_depths: bool,
    /// For each ray the state of its walk.
    pub(super) states: &'a mut [WalkState],
    /// Index of the first ray that is not yet prepared.
    pub(super) next: usize,
    /// Located starts of walks, and walks that return to the lanes, which are not yet prepared.
    pub(super) starts: Vec<WalkStart>,
    /// Faces that lanes have reached and that are not yet tested.
    pub(super) reached: Vec<Reached>,
    /// For each ray the number of times that it has returned to the lanes.
    pub(super) returns: Vec<u8>,
    /// Rays whose walks are to be made without lanes: from a position, or where that is uncertain as a flood.
    pub(super) without_lanes: Vec<(u32, Option<TetPosition>)>,
}

/// A batch of rays that walk through tetrahedra, with their queries.
pub(crate) struct WalkBatch<'a> {
    pub(super) walks: Walks<'a>,
    /// For each ray its query, which receives the hits.
    pub(super) queries: &'a mut [EitherQuery],
}

impl<'a> WalkBatch<'a> {
    /// A batch of which no ray has been walked. All slices have one element per ray.
    pub(crate) fn new(
        object: &'a ObjectView<'a>,
        records: LaneRecords<'a>,
        WalkRays { rays, faces, leaves }: WalkRays<'a>,
        queries: &'a mut [EitherQuery],
        states: &'a mut [WalkState],
    ) -> Self {
        states.fill(WalkState::NotWalked);
        let walks = Walks {
            object,
            records,
            rays,
            faces,
            leaves,
            keeps_depths: queries.first().is_some_and(|query| query.goal().is_any()),
            states,
            next: 0,
            starts: Vec::new(),
            reached: Vec::new(),
            returns: vec![0; rays.len()],
            without_lanes: Vec::new(),
        };
        WalkBatch { walks, queries }
    }

    /// Whether lanes can address the tetrahedra of an object: gathers need indices of words below 2^31.
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
            self.test_reached_faces();
        }
        loop {
            s.call(Fill { walks: &mut self.walks, queue });
            self.walk_without_lanes();
            if queue.len() != 0 || self.walks.reached.is_empty() && self.walks.starts.is_empty() {
                return;
            }
            // Behind the faces that are tested, walks may go on.
            self.test_reached_faces();
        }
    }
}

/// The object's tet vertices as rows of four words: x, y, z and an unused word.
pub(super) fn vertices<'a>(object: &ObjectView<'a>) -> &'a [[f32; 4]] {
    <[[f32; 4]]>::ref_from_bytes(object.tet_vertices.as_bytes()).ok().expect("a vertex is four words")
}
