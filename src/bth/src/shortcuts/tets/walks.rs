//! The state of the walks of a batch of rays, without their queries.

use super::walk::{Entered, TetPosition};
use crate::rays::Ray;
use bth_format::object::ObjectView;
use zerocopy::{FromBytes, IntoBytes};

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
    /// The line certainly crosses the entered face, whose corners are counterclockwise as seen
    /// along the ray.
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

/// Memory of the walks of a batch, which is reused from one batch to the next.
#[derive(Debug, Default)]
pub(crate) struct WalkLists {
    starts: Vec<WalkStart>,
    reached: Vec<Reached>,
    returns: Vec<u8>,
    without_lanes: Vec<(u32, Option<TetPosition>)>,
}

/// The walks of a batch of rays through one tet leaf, without the queries. All slices have one
/// element per ray.
pub(super) struct Walks<'a> {
    pub(super) object: &'a ObjectView<'a>,
    /// The links of all tetrahedra, four each.
    pub(super) links: &'a [[u32; 2]],
    /// The rays, in object space.
    pub(super) rays: &'a [Ray],
    /// Index of the tet leaf that the rays enter from outside.
    pub(super) leaf: u32,
    /// True if the walks keep track of depths: they can end any-hit queries, whose rays are often
    /// short.
    pub(super) keeps_depths: bool,
    /// For each ray the state of its walk.
    pub(super) states: &'a mut [WalkState],
    /// Index of the first ray that is not yet prepared.
    pub(super) next: usize,
    /// Located starts of walks, and walks that return to the lanes, which are not yet prepared.
    pub(super) starts: &'a mut Vec<WalkStart>,
    /// Faces that lanes have reached and that are not yet tested.
    pub(super) reached: &'a mut Vec<Reached>,
    /// For each ray the number of times that it has returned to the lanes.
    pub(super) returns: &'a mut [u8],
    /// Rays whose walks are to be made without lanes: from a position, or where that is uncertain
    /// as a flood.
    pub(super) without_lanes: &'a mut Vec<(u32, Option<TetPosition>)>,
}

impl<'a> Walks<'a> {
    /// Returns walks that have not begun, as `states` say. All slices have one element per ray.
    pub(super) fn new(
        object: &'a ObjectView<'a>,
        rays: &'a [Ray],
        leaf: u32,
        keeps_depths: bool,
        states: &'a mut [WalkState],
        WalkLists { starts, reached, returns, without_lanes }: &'a mut WalkLists,
    ) -> Self {
        returns.clear();
        returns.resize(rays.len(), 0);
        // Anything may be left after a panic.
        starts.clear();
        reached.clear();
        without_lanes.clear();
        Walks {
            object,
            links: <[[u32; 2]]>::ref_from_bytes(object.records.as_bytes()).ok().expect("links are two words"),
            rays,
            leaf,
            keeps_depths,
            states,
            next: 0,
            starts,
            reached,
            returns,
            without_lanes,
        }
    }
}

/// The object's tet vertices as rows of four words: x, y, z and an unused word.
pub(super) fn vertices<'a>(object: &ObjectView<'a>) -> &'a [[f32; 4]] {
    <[[f32; 4]]>::ref_from_bytes(object.tet_vertices.as_bytes()).ok().expect("a vertex is four words")
}
