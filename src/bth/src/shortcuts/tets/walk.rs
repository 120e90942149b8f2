//! The walk of one ray from tetrahedron to tetrahedron along its line, in f64.
//!
//! As in the traversal of Aman et al. (arXiv 2103.02309, 2021), the projections of the entered
//! face's three vertices are kept, the fourth vertex is projected, and the signs of three cross
//! products select the face of exit. While all signs are certain, the walk follows the exact line
//! through the interiors of faces. A sign is uncertain if the line passes an edge or a vertex
//! within the bound of the rounding errors. The walk then ends, and [`TetWalker::flood`] visits
//! every tetrahedron that the line may touch.

use crate::intersect::exact_ray::{WorldLines, intersect_in_world};
use crate::intersect::line::{Line, Projected, Sign};
use crate::intersect::start::ExactStart;
use crate::intersect::vector::wide;
use crate::query::double::offer_in_world;
use crate::query::{Count, EitherQuery, TriangleRef};
use bth_format::layout::{FACE_BIT, HullFace, Link, Link32, NONE, TetFace, TetLeaf, TetVertex};
use bth_format::object::ObjectView;

/// The face through which a walk entered a tetrahedron, and the fourth vertex of the tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entered {
    /// Vertices of the entered face.
    pub(crate) face: [u32; 3],
    /// The fourth vertex.
    pub(crate) apex: u32,
}

/// The data of a tet leaf that a walk reads, and the line of the ray, in object space.
pub(crate) struct TetWalker<'a> {
    pub(crate) leaf: &'a TetLeaf,
    /// Records of all tetrahedra of the object.
    pub(crate) records: &'a [Link32],
    /// Vertices of all tetrahedra of the object.
    pub(crate) vertices: &'a [TetVertex],
    /// Constrained faces of all tet leaves of the object.
    pub(crate) faces: &'a [TetFace],
    /// Hull faces of this leaf.
    pub(crate) hull: &'a [HullFace],
    pub(crate) line: &'a Line,
    /// Bound of the error of projected coordinates of points within the leaf's box.
    pub(crate) error: f64,
    pub(super) decision: Decision<'a>,
    /// Ids of the object's triangles, in leaf order.
    ids: &'a [u32],
}

/// What decides about a face that the line may cross.
pub(super) enum Decision<'a> {
    /// The line, which f64 holds exactly.
    Line,
    /// The exact start on a triangle of the object.
    Start(ExactStart),
    /// The line in world space of the ray with this index, through an object.
    World(&'a ObjectView<'a>, &'a dyn WorldLines, usize),
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WalkOutcome {
    /// The query is complete.
    Done,
    /// The line has left the leaf, or no face further along it can change the result.
    Left,
    /// A sign was uncertain, or the data are inconsistent. The hits that were offered are correct,
    /// but others may be missing.
    Uncertain,
}

/// Position of a walk: the tetrahedron `tet`, and the face through which the line enters it. The
/// line crosses that face with certain signs, and the corners of the face are counterclockwise as
/// seen along the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TetPosition {
    pub(crate) tet: u32,
    pub(crate) entered: Entered,
    /// Projected corners of the entered face.
    pub(crate) corner: [Projected; 3],
}

impl<'a> TetWalker<'a> {
    /// The walker for the tet leaf with index `leaf`.
    pub(crate) fn new(object: &ObjectView<'a>, leaf: u32, line: &'a Line) -> Self {
        let leaf = &object.tet_leaves[leaf as usize];
        TetWalker {
            leaf,
            records: object.records,
            vertices: object.tet_vertices,
            faces: object.tet_faces,
            hull: &object.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize],
            ids: object.triangle_ids,
            line,
            error: line.own_projection_error(line.reach_of_box(leaf.lower, leaf.upper)),
            decision: Decision::Line,
        }
    }

    /// Position of a vertex in object space.
    #[inline(always)]
    pub(crate) fn position(&self, vertex: u32) -> [f32; 3] {
        self.vertices[vertex as usize].position
    }

    #[inline(always)]
    pub(crate) fn project(&self, vertex: u32) -> Projected {
        self.line.project(self.position(vertex))
    }

    /// The sides on which the line passes the three edges of a face with these corners.
    pub(crate) fn sides(&self, corner: &[Projected; 3]) -> [Sign; 3] {
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| Line::side(&corner[i], &corner[j], self.error))
    }

    /// The triangle of a constrained face, and its corners.
    pub(crate) fn triangle(&self, face: &TetFace) -> (TriangleRef<'a>, [[f32; 3]; 3]) {
        (TriangleRef::id(face.triangle, self.ids), face.vertex.map(|v| self.position(v)))
    }

    /// Tests a constrained face exactly, as the triangles of BVH leaves are, and offers a hit to
    /// the query. Returns true if the query is complete.
    pub(crate) fn offer_face(&self, face: &TetFace, query: &mut EitherQuery) -> bool {
        let (triangle, corners) = self.triangle(face);
        self.offer(triangle, corners, query)
    }

    /// Like [`Self::offer_face`], given its triangle.
    pub(crate) fn offer(
        &self,
        triangle: TriangleRef<'_>,
        corners: [[f32; 3]; 3],
        query: &mut EitherQuery,
    ) -> bool {
        let found = match &self.decision {
            Decision::Line => self.line.intersection(corners),
            Decision::Start(start) => start.intersection(self.line, corners),
            &Decision::World(object, lines, ray) => {
                let line = (lines, ray);
                let found = intersect_in_world(line, corners.map(wide), |t| query.may_matter(t));
                return found
                    .is_some_and(|found| offer_in_world(object, line, (triangle, corners), found, query));
            }
        };
        found.is_some_and(|found| query.offer(triangle, found))
    }

    /// The link behind the face opposite to a vertex of an entered tetrahedron. Links are stored in
    /// ascending order of the opposite vertex.
    #[inline(always)]
    pub(crate) fn link(&self, tet: u32, entered: &Entered, vertex: u32) -> Link {
        let below = |v: u32| usize::from(v < vertex);
        let rank = entered.face.iter().map(|v| below(*v)).sum::<usize>() + below(entered.apex);
        self.records[tet as usize].link[rank & 3]
    }

    /// Follows a link from the tetrahedron `from`. Returns the tetrahedron behind the face and its
    /// fourth vertex; `None` if the face belongs to the hull.
    #[inline(always)]
    pub(crate) fn beyond(&self, from: u32, link: Link) -> Option<(u32, u32)> {
        if link.next == NONE {
            return None;
        }
        if link.next & FACE_BIT != 0 {
            let constrained = &self.faces[(link.next & !FACE_BIT) as usize];
            let side = (constrained.tet[0] == from) as usize;
            return Some((constrained.tet[side], constrained.opposite[side]));
        }
        Some((link.next, link.opposite))
    }

    /// Replaces the position's face by the one through which the line leaves the tetrahedron, and
    /// returns the link behind it. `None` if a sign is uncertain; the position is then unchanged.
    #[inline(always)]
    pub(crate) fn exit(&self, position: &mut TetPosition) -> Option<Link> {
        use Sign::{Negative, Positive};
        let apex = self.project(position.entered.apex);
        let [s0, s1, s2] = position.corner.each_ref().map(|p| Line::side(&apex, p, self.error));
        let replaced = match (s0, s1, s2) {
            (Positive, Negative, _) => 2,
            (Negative, _, Positive) => 1,
            (_, Positive, Negative) => 0,
            _ => return None,
        };
        let link = self.link(position.tet, &position.entered, position.entered.face[replaced]);
        position.entered.face[replaced] = position.entered.apex;
        position.corner[replaced] = apex;
        Some(link)
    }

    /// Walks from a position until the query is complete, the line leaves the hull or passes the
    /// query's limit, or a sign is uncertain.
    pub(crate) fn walk<C: Count>(
        &self,
        mut position: TetPosition,
        query: &mut EitherQuery,
        count: &mut C,
    ) -> WalkOutcome {
        // A line passes each tetrahedron at most once, so a walk has more steps only if the data
        // are inconsistent.
        for _ in 0..self.leaf.tets {
            count.cell();
            let Some(link) = self.exit(&mut position) else { return WalkOutcome::Uncertain };
            if link.next & FACE_BIT != 0
                && link.next != NONE
                && self.offer_face(&self.faces[(link.next & !FACE_BIT) as usize], query)
            {
                return WalkOutcome::Done;
            }
            let (nearest, _) = self.line.t_range(position.corner.each_ref());
            if nearest > query.limit() {
                return WalkOutcome::Left;
            }
            let Some((tet, apex)) = self.beyond(position.tet, link) else { return WalkOutcome::Left };
            position.tet = tet;
            position.entered.apex = apex;
        }
        WalkOutcome::Uncertain
    }

    /// The position behind the constrained face on which the ray starts. `None` if it is uncertain
    /// that the line crosses the face.
    pub(crate) fn leave(&self, face: u32) -> Option<TetPosition> {
        let constrained = &self.faces[face as usize];
        let mut vertex = constrained.vertex;
        let mut corner = vertex.map(|v| self.project(v));
        let sides = self.sides(&corner);
        let side = match sides {
            [Sign::Positive, Sign::Positive, Sign::Positive] => 0,
            [Sign::Negative, Sign::Negative, Sign::Negative] => 1,
            _ => return None,
        };
        if side == 1 {
            vertex.swap(1, 2);
            corner.swap(1, 2);
        }
        let entered = Entered { face: vertex, apex: constrained.opposite[side] };
        Some(TetPosition { tet: constrained.tet[side], entered, corner })
    }

    /// The position at which the line enters the hull.
    ///
    /// # Errors
    /// [`WalkOutcome::Left`] if the line misses the hull, [`WalkOutcome::Uncertain`] if it passes
    /// an edge of the hull within the bound of the rounding errors.
    pub(crate) fn enter_hull(&self) -> Result<TetPosition, WalkOutcome> {
        let mut position = Err(WalkOutcome::Left);
        for face in self.hull {
            let corner = face.vertex.map(|v| self.project(v));
            let sides = self.sides(&corner);
            if sides.contains(&Sign::Negative) {
                if !sides.contains(&Sign::Positive) && sides.contains(&Sign::Uncertain) {
                    // The line leaves the hull here or passes its silhouette, and it may also enter
                    // close to the same edge.
                    return Err(WalkOutcome::Uncertain);
                }
                continue;
            }
            if sides.contains(&Sign::Uncertain) {
                return Err(WalkOutcome::Uncertain);
            }
            let entered = Entered { face: face.vertex, apex: face.opposite };
            position = Ok(TetPosition { tet: face.tet, entered, corner });
        }
        position
    }
}
