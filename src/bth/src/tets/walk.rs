//! The walk of one ray from tetrahedron to tetrahedron along its line, in f64.
//!
//! As in the traversal of Aman et al. (2021), the projections of the entered face's three vertices are kept, the fourth vertex is
//! projected, and the signs of three cross products select the face of exit. While all signs are certain, the walk follows the
//! real line through the interiors of faces. Where a sign is uncertain, because the line passes within rounding of an edge or a
//! vertex, the walk ends, and [`TetSpace::flood`] visits every tetrahedron that the line may touch.

use super::records::{Entered, ReadRecords};
use crate::intersect::line::{Line, Projected, Sign};
use crate::query::{Count, Query, TriangleRef};
use bth_format::layout::{FACE_BIT, HullFace, Link, NONE, TetFace, TetLeaf, TetVertex};
use bth_format::object::{ObjectView, Records};

/// The parts of a tet leaf that a walk reads, and the line of the ray.
pub(crate) struct TetSpace<'a> {
    pub(crate) leaf: &'a TetLeaf,
    /// Records, vertices and faces are those of the whole object, and indices refer to them.
    pub(crate) records: Records<'a>,
    pub(crate) vertices: &'a [TetVertex],
    pub(crate) faces: &'a [TetFace],
    pub(crate) hull: &'a [HullFace],
    pub(crate) line: &'a Line,
    /// Bound on the error of projected coordinates within the leaf's box.
    pub(crate) error: f64,
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WalkOutcome {
    /// The query is complete.
    Done,
    /// The line has left the leaf, or no later face can change the result.
    Left,
    /// A sign was uncertain. The hits offered before are right, but others may be missing.
    Uncertain,
}

/// Position of a walk: the tetrahedron `tet`, entered through a face that the line crosses with certain signs and whose corners are
/// counterclockwise as seen along the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TetPosition {
    pub(crate) tet: u32,
    pub(crate) entered: Entered,
    /// The corners of that face, projected.
    pub(crate) corner: [Projected; 3],
}

impl<'a> TetSpace<'a> {
    /// A tet leaf of an object.
    pub(crate) fn new(object: &ObjectView<'a>, leaf: u32, line: &'a Line) -> Self {
        let leaf = &object.tet_leaves[leaf as usize];
        TetSpace {
            leaf,
            records: object.records,
            vertices: object.tet_vertices,
            faces: object.tet_faces,
            hull: &object.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize],
            ids: object.triangle_ids,
            line,
            error: Line::projection_error(line.reach_of_box(leaf.lower, leaf.upper)),
        }
    }

    #[inline(always)]
    pub(crate) fn position(&self, vertex: u32) -> [f32; 3] {
        self.vertices[vertex as usize].position
    }

    #[inline(always)]
    pub(crate) fn project(&self, vertex: u32) -> Projected {
        self.line.project(self.position(vertex))
    }

    /// Signs of the sides on which the line passes the three edges of a face.
    pub(crate) fn sides(&self, p: &[Projected; 3]) -> [Sign; 3] {
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| Line::side(&p[i], &p[j], self.error))
    }

    /// Offers a constrained face to the query, by the exact test that all structures share; returns whether the query is complete.
    pub(crate) fn offer<Q: Query>(&self, face: &TetFace, query: &mut Q) -> bool {
        let corners = face.vertex.map(|v| self.position(v));
        match self.line.intersection(corners) {
            Some(intersection) => query.offer(TriangleRef::id(face.triangle, self.ids), intersection),
            None => false,
        }
    }

    /// The tetrahedron behind a link from tetrahedron `from` through `face`, its fourth vertex, and the link with which its record
    /// refers back; `None` outside of the hull.
    #[inline(always)]
    pub(crate) fn beyond(&self, from: u32, link: Link, face: [u32; 3]) -> Option<(u32, u32, u32)> {
        if link.next == NONE {
            return None;
        }
        if link.next & FACE_BIT != 0 {
            let row = &self.faces[(link.next & !FACE_BIT) as usize];
            let side = (row.tet[0] == from) as usize;
            return Some((row.tet[side], row.opposite[side], link.next));
        }
        let apex = self.records.apex(link.next, face, link.opposite);
        Some((link.next, apex, from))
    }

    /// Replaces the position's face by the one through which the line leaves the tetrahedron, and returns the link behind it. `None`
    /// if a sign is uncertain; the position is then unchanged.
    #[inline(always)]
    pub(crate) fn exit(&self, at: &mut TetPosition) -> Option<Link> {
        use Sign::{Negative, Positive};
        let apex = self.project(at.entered.apex);
        let [s0, s1, s2] = at.corner.each_ref().map(|p| Line::side(&apex, p, self.error));
        let out = match (s0, s1, s2) {
            (Positive, Negative, _) => 2,
            (Negative, _, Positive) => 1,
            (_, Positive, Negative) => 0,
            _ => return None,
        };
        let link = self.records.link(at.tet, &at.entered, at.entered.face[out]);
        at.entered.face[out] = at.entered.apex;
        at.corner[out] = apex;
        Some(link)
    }

    /// Walks from a position until the query is complete, the line leaves the hull or passes the query's limit, or a sign is uncertain.
    pub(crate) fn walk<Q: Query, C: Count>(
        &self,
        mut at: TetPosition,
        query: &mut Q,
        count: &mut C,
    ) -> WalkOutcome {
        // A line passes each tetrahedron at most once, so more steps occur only with inconsistent data.
        for _ in 0..self.leaf.tets {
            count.tet();
            let Some(link) = self.exit(&mut at) else { return WalkOutcome::Uncertain };
            if link.next & FACE_BIT != 0
                && link.next != NONE
                && self.offer(&self.faces[(link.next & !FACE_BIT) as usize], query)
            {
                return WalkOutcome::Done;
            }
            let (nearest, _) = self.line.t_range(at.corner.each_ref());
            if nearest > query.limit() {
                return WalkOutcome::Left;
            }
            let Some((tet, apex, behind)) = self.beyond(at.tet, link, at.entered.face) else {
                return WalkOutcome::Left;
            };
            at.tet = tet;
            at.entered.apex = apex;
            at.entered.behind = behind;
        }
        WalkOutcome::Uncertain
    }

    /// The position at which the line enters the hull. `Err` is `Left` if the line misses the hull, and `Uncertain` if it passes too
    /// close to an edge of it.
    pub(crate) fn enter_hull(&self) -> Result<TetPosition, WalkOutcome> {
        let mut position = Err(WalkOutcome::Left);
        for face in self.hull {
            let corner = face.vertex.map(|v| self.project(v));
            let sides = self.sides(&corner);
            if sides.contains(&Sign::Negative) {
                if !sides.contains(&Sign::Positive) && sides.contains(&Sign::Uncertain) {
                    // The line leaves the hull here or passes its silhouette; it may enter close to the same edge.
                    return Err(WalkOutcome::Uncertain);
                }
                continue;
            }
            if sides.contains(&Sign::Uncertain) {
                return Err(WalkOutcome::Uncertain);
            }
            let entered = Entered { face: face.vertex, apex: face.opposite, behind: NONE };
            position = Ok(TetPosition { tet: face.tet, entered, corner });
        }
        position
    }
}
