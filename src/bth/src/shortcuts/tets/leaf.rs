//! Leaves that hold tetrahedra, as the traversals see them: special leaves.

use super::flood::VisitedSet;
use super::walk::{Decision, TetWalker, WalkOutcome};
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::line::Line;
use crate::intersect::start::start_on;
use crate::query::{Count, EitherQuery, Goal, RayQuery, Receiver, TriangleRef};
use crate::simd::LANES;
use bth_format::layout::{Child, NONE, RawLeaf, TetFace, WIDTH};
use bth_format::object::ObjectView;

/// A leaf that holds no block of triangles. It answers queries itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpecialLeaf {
    /// Row of TET_LEAVES.
    row: u32,
}

/// The leaf of a child that is neither a node nor a block of triangles. `None` for other children.
#[inline(always)]
pub(crate) fn special(child: Child) -> Option<SpecialLeaf> {
    match child {
        Child::Tets(row) => Some(SpecialLeaf { row }),
        _ => None,
    }
}

/// The special leaf that is the whole object, if it is.
pub(crate) fn whole(object: &ObjectView<'_>) -> Option<SpecialLeaf> {
    special(Child::from_code(object.header.root)?)
}

/// Returns true if an object has special leaves.
#[inline(always)]
pub(crate) fn has_special_leaves(object: &ObjectView<'_>) -> bool {
    !object.tet_leaves.is_empty()
}

impl SpecialLeaf {
    #[inline(always)]
    pub(super) fn row(self) -> u32 {
        self.row
    }

    /// Offers the hits of a ray in this leaf to its query. Returns true if the query is complete.
    #[inline(never)]
    pub(crate) fn enter<G: Goal, C: Count>(
        self,
        object: &ObjectView<'_>,
        ray: ExactRay<'_>,
        query: &mut RayQuery<G>,
        count: &mut C,
    ) -> bool {
        let mut either = query.to_either();
        let is_complete = self.walk(object, ray, &mut either, count);
        *query = either.with_goal(query.goal());
        is_complete
    }

    /// Walks through the tetrahedra, from the face of the hull through which the line enters or
    /// from the face on which the ray starts.
    #[inline(never)]
    fn walk<C: Count>(
        self,
        object: &ObjectView<'_>,
        ray: ExactRay<'_>,
        query: &mut EitherQuery,
        count: &mut C,
    ) -> bool {
        let Some(line) = Line::of(&ray.rounded()) else { return true };
        let mut walker = TetWalker::new(object, self.row, &line);
        walker.decision = match ray.line {
            LineSource::Ray => Decision::Line,
            LineSource::Start(start) => start_on(object, start).map_or(Decision::Line, Decision::Start),
            LineSource::World(lines, ray) => Decision::World(object, lines, ray),
        };
        let entered = match ray.start() {
            Some(start) if start.leaf == Child::Tets(self.row).code() => walker.leave(start.slot),
            _ => None,
        };
        let outcome = match entered.map_or_else(|| walker.enter_hull(), Ok) {
            Ok(position) => walker.walk(position, query, count),
            Err(outcome) => outcome,
        };
        let outcome = match outcome {
            WalkOutcome::Uncertain => walker.flood(query, count),
            outcome => outcome,
        };
        outcome == WalkOutcome::Done
    }

    /// Passes each triangle of this leaf that a line may touch to a receiver. Returns true if the
    /// query is complete. A flood fill finds every triangle that the line touches, even where it
    /// passes through edges and vertices or lies in the plane of a face.
    #[cold]
    #[inline(never)]
    pub(crate) fn pass_triangles(
        self,
        object: &ObjectView<'_>,
        ray: ExactRay<'_>,
        receiver: &mut dyn Receiver,
    ) -> bool {
        let Some(line) = Line::of(&ray.rounded()) else { return false };
        let walker = TetWalker::new(object, self.row, &line);
        walker.flood_faces(&mut PassedOnce { receiver, passed: VisitedSet::new() }, &mut ())
    }

    /// All triangles of this leaf, as blocks of sixteen.
    #[inline(always)]
    pub(crate) fn blocks<'a>(self, object: &'a ObjectView<'a>) -> SpecialBlocks<'a> {
        let leaf = &object.tet_leaves[self.row as usize];
        SpecialBlocks {
            object,
            rest: &object.tet_faces[leaf.first_face as usize..][..leaf.faces as usize],
            block: RawLeaf { corner: [[[0.0; WIDTH]; 3]; 3], first: 0, triangles: 0, reserved: [0; 14] },
            ids: [NONE; LANES],
        }
    }
}

/// Passes each triangle only once: a flood may reach a face from both sides.
struct PassedOnce<'a> {
    receiver: &'a mut dyn Receiver,
    /// Ids of the passed triangles.
    passed: VisitedSet,
}

impl Receiver for PassedOnce<'_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        self.passed.insert(triangle.read()) && self.receiver.receive(triangle, corners)
    }
    fn limit(&self) -> f64 {
        self.receiver.limit()
    }
}

/// The triangles of a special leaf that are still to be visited.
pub(crate) struct SpecialBlocks<'a> {
    object: &'a ObjectView<'a>,
    rest: &'a [TetFace],
    block: RawLeaf,
    ids: [u32; LANES],
}

impl SpecialBlocks<'_> {
    /// The next up to sixteen triangles, and their ids.
    #[inline(always)]
    pub(crate) fn next_block(&mut self) -> Option<(&RawLeaf, &[u32; LANES])> {
        let (faces, rest) = self.rest.split_at(self.rest.len().min(LANES));
        self.rest = rest;
        self.block.triangles = faces.len() as u32;
        for i in 0..faces.len() {
            self.ids[i] = faces[i].triangle;
            let corners = self.object.face_corners(&faces[i]);
            for c in 0..3 {
                for k in 0..3 {
                    self.block.corner[c][k][i] = corners[c][k];
                }
            }
        }
        (!faces.is_empty()).then_some((&self.block, &self.ids))
    }
}
