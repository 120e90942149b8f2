//! Fallback of a tet walk for lines that pass through an edge or a vertex: a flood fill over all tetrahedra that the line may
//! touch.
//!
//! The flood starts at the hull faces that the line may touch within the bounds of rounding errors, and crosses every such face.
//! All tetrahedra at a vertex or an edge are connected through faces that contain the vertex or edge. Therefore the flood reaches
//! every tetrahedron that the line touches, and every constrained face that the exact test can accept. Each tetrahedron is
//! visited once, so the flood ends.

use super::records::{Entered, ReadRecords};
use super::walk::{TetWalker, WalkOutcome};
use crate::intersect::line::{Projected, Sign};
use crate::query::{Count, Query};
use bth_format::layout::{FACE_BIT, NONE};
use std::collections::HashSet;

/// The tetrahedra that a flood has visited. Around most vertices these are about ten, around the center of a fan as many as the
/// leaf holds.
struct VisitedSet {
    /// The tetrahedra that were inserted first. An array needs no allocation.
    first: [u32; 48],
    /// Number of elements of `first` that are set.
    len: usize,
    /// The tetrahedra that were inserted after `first` was full.
    rest: HashSet<u32>,
}

impl VisitedSet {
    fn new() -> Self {
        VisitedSet { first: [0; 48], len: 0, rest: HashSet::new() }
    }

    /// Adds a tetrahedron; returns false if it was already in the set.
    fn insert(&mut self, tet: u32) -> bool {
        if self.first[..self.len].contains(&tet) {
            return false;
        }
        if self.len == self.first.len() {
            return self.rest.insert(tet);
        }
        self.first[self.len] = tet;
        self.len += 1;
        true
    }
}

impl TetWalker<'_> {
    /// Offers to the query all constrained faces of the leaf that the line can touch up to the query's limit. Returns `Done` if
    /// the query is complete, else `Left`.
    #[inline(never)]
    pub(crate) fn flood<Q: Query, C: Count>(&self, query: &mut Q, count: &mut C) -> WalkOutcome {
        count.flood();
        let mut visited = VisitedSet::new();
        let mut stack: Vec<(u32, Entered)> = Vec::new();
        for face in self.hull {
            if self.touches(&face.vertex.map(|v| self.project(v))) && visited.insert(face.tet) {
                stack.push((face.tet, Entered { face: face.vertex, apex: face.opposite, behind: NONE }));
            }
        }
        while let Some((tet, entered)) = stack.pop() {
            count.tet();
            let apex = self.project(entered.apex);
            let corner = entered.face.map(|v| self.project(v));
            for replaced in 0..3 {
                let (mut face, mut projected) = (entered.face, corner);
                face[replaced] = entered.apex;
                projected[replaced] = apex;
                if !self.touches(&projected) {
                    continue;
                }
                let link = self.records.link(tet, &entered, entered.face[replaced]);
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
                    stack.push((next, Entered { face, apex, behind }));
                }
            }
        }
        WalkOutcome::Left
    }

    /// Whether the line may touch the closed face; false only if it certainly does not.
    fn touches(&self, corner: &[Projected; 3]) -> bool {
        let sides = self.sides(corner);
        !(sides.contains(&Sign::Positive) && sides.contains(&Sign::Negative))
    }
}
