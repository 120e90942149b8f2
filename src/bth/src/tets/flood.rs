//! Fallback of a tet walk for lines that pass through an edge or a vertex: a flood fill over all tetrahedra that the line may touch.
//!
//! It starts at the hull faces that the line may touch, rounding errors included, and crosses every such face. All tetrahedra at a
//! vertex or an edge are connected through faces that contain it, so the flood reaches every tetrahedron that the line touches, and
//! with them every constrained face that the exact test can accept. Each tetrahedron is visited once, so the flood ends.

use super::records::{Entered, ReadRecords};
use super::walk::{TetSpace, WalkOutcome};
use crate::intersect::line::{Projected, Sign};
use crate::query::{Count, Query};
use bth_format::layout::{FACE_BIT, NONE};
use std::collections::HashSet;

/// The tetrahedra that a flood has visited: about ten around most vertices, but as many as a leaf holds around the center of a fan.
struct VisitedSet {
    /// The first ones, in an array, which needs no allocation.
    first: [u32; 48],
    len: usize,
    /// The others.
    more: HashSet<u32>,
}

impl VisitedSet {
    fn new() -> Self {
        VisitedSet { first: [0; 48], len: 0, more: HashSet::new() }
    }

    /// Adds a tetrahedron; returns false if it was in the set.
    fn insert(&mut self, tet: u32) -> bool {
        if self.first[..self.len].contains(&tet) {
            return false;
        }
        if self.len == self.first.len() {
            return self.more.insert(tet);
        }
        self.first[self.len] = tet;
        self.len += 1;
        true
    }
}

impl TetSpace<'_> {
    /// Offers all constrained faces of the leaf that the line can touch up to the query's limit.
    #[inline(never)]
    pub(crate) fn flood<Q: Query, C: Count>(&self, query: &mut Q, count: &mut C) -> WalkOutcome {
        count.flood();
        let mut visited = VisitedSet::new();
        let mut open: Vec<(u32, Entered)> = Vec::new();
        for face in self.hull {
            if self.touches(&face.vertex.map(|v| self.project(v))) && visited.insert(face.tet) {
                open.push((face.tet, Entered { face: face.vertex, apex: face.opposite, behind: NONE }));
            }
        }
        while let Some((tet, at)) = open.pop() {
            count.tet();
            let apex = self.project(at.apex);
            let corner = at.face.map(|v| self.project(v));
            for out in 0..3 {
                let (mut face, mut projected) = (at.face, corner);
                face[out] = at.apex;
                projected[out] = apex;
                if !self.touches(&projected) {
                    continue;
                }
                let link = self.records.link(tet, &at, at.face[out]);
                let constrained = link.next & FACE_BIT != 0 && link.next != NONE;
                if constrained && self.offer(&self.faces[(link.next & !FACE_BIT) as usize], query) {
                    return WalkOutcome::Done;
                }
                if self.line.t_range(projected.each_ref()).0 > query.limit() {
                    continue;
                }
                if let Some((next, apex, behind)) = self.beyond(tet, link, face)
                    && visited.insert(next)
                {
                    open.push((next, Entered { face, apex, behind }));
                }
            }
        }
        WalkOutcome::Left
    }

    /// Whether the line may meet the closed face; false only if it certainly does not.
    fn touches(&self, corner: &[Projected; 3]) -> bool {
        let sides = self.sides(corner);
        !(sides.contains(&Sign::Positive) && sides.contains(&Sign::Negative))
    }
}
