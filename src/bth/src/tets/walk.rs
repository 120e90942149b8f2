//! The walk from tetrahedron to tetrahedron along a ray's line.
//!
//! As the paper's traversal (Aman et al. 2021): the three vertices of the face entered stay
//! projected, the fourth is projected, and the signs of three cross products name the exit. A
//! walk whose signs are all certain follows the real line through the interiors of real faces. Where
//! rounding hides a sign (the line meets an edge or vertex, within rounding) the walk gives up, and
//! `tet_flood` visits everything that the line can touch instead.

use super::records::{Entered, ReadRecords};
use crate::intersect::line::{Line, Projected, Sign};
use crate::query::{Count, Query, TriangleRef};
use bth_format::layout::{FACE_BIT, HullFace, Link, NONE, TetFace, TetLeaf, TetVertex};
use bth_format::object::{ObjectView, Records};

/// The parts of a tet leaf that a walk reads, and what it knows about the ray.
pub(crate) struct TetSpace<'a> {
    pub(crate) leaf: &'a TetLeaf,
    /// All records, vertices and faces of the object: rows are object-wide.
    pub(crate) records: Records<'a>,
    pub(crate) vertices: &'a [TetVertex],
    pub(crate) faces: &'a [TetFace],
    pub(crate) hull: &'a [HullFace],
    pub(crate) line: &'a Line,
    /// Bound on the error of projected coordinates within the leaf's box.
    pub(crate) error: f64,
    /// Of the object's triangles, in leaf order.
    ids: &'a [u32],
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WalkOutcome {
    /// The query has what it wants.
    Done,
    /// The line has left the leaf, or nothing nearer can follow.
    Left,
    /// A sign was uncertain: what was offered so far is right, but the rest is not known.
    Uncertain,
}

/// Where a walk stands: in tetrahedron `tet`, entered through a face that the line crosses with
/// all signs certain, its corners counterclockwise as seen along the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TetPosition {
    pub(crate) tet: u32,
    pub(crate) entered: Entered,
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

    /// Offers a constrained face to the query, by the test that all structures share.
    pub(crate) fn offer<Q: Query>(&self, face: &TetFace, query: &mut Q) -> bool {
        let corners = face.vertex.map(|v| self.position(v));
        match self.line.intersection(corners) {
            Some(intersection) => query.offer(TriangleRef::id(face.triangle, self.ids), intersection),
            None => false,
        }
    }

    /// The tetrahedron on the other side of a link, with its fourth vertex, and how that one's
    /// record stores the face between; `None` outside the hull.
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

    /// Moves a place's face to the one through which the line leaves the tetrahedron, and says what lies behind
    /// that; `None` if a sign is uncertain, and nothing has changed then.
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

    /// Walks on from a place until the query is done, the hull, the query's limit or an uncertain sign.
    pub(crate) fn walk<Q: Query, C: Count>(
        &self,
        mut at: TetPosition,
        query: &mut Q,
        count: &mut C,
    ) -> WalkOutcome {
        // A line meets a tetrahedron once; more steps than there are tetrahedra mean bad data.
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

    /// The place where the line enters the hull. `Err` tells why there is none: the line misses the
    /// hull (`Left`) or meets it too close to an edge to tell (`Uncertain`).
    pub(crate) fn enter_hull(&self) -> Result<TetPosition, WalkOutcome> {
        let mut place = Err(WalkOutcome::Left);
        for face in self.hull {
            let corner = face.vertex.map(|v| self.project(v));
            let sides = self.sides(&corner);
            if sides.contains(&Sign::Negative) {
                if !sides.contains(&Sign::Positive) && sides.contains(&Sign::Uncertain) {
                    // An exit, or the rim: the entry may be as close to the same edge.
                    return Err(WalkOutcome::Uncertain);
                }
                continue;
            }
            if sides.contains(&Sign::Uncertain) {
                return Err(WalkOutcome::Uncertain);
            }
            let entered = Entered { face: face.vertex, apex: face.opposite, behind: NONE };
            place = Ok(TetPosition { tet: face.tet, entered, corner });
        }
        place
    }
}
