//! What a tet walk falls back to when the line meets an edge or a vertex: a flood over all tetrahedra
//! that the line touches.
//!
//! From the hull faces that the line may touch it spreads over every face that the line may
//! touch, rounding counted in. The tetrahedra around a vertex or an edge hang together by faces that
//! hold it, so nothing that the line touches is left out, and each is visited once: it
//! ends, and it finds every constrained face that the exact test can accept.

use super::records::{Entered, ReadRecords};
use super::walk::{TetSpace, WalkOutcome};
use crate::intersect::line::{Projected, Sign};
use crate::query::{Count, Query};
use bth_format::layout::{FACE_BIT, NONE};
use std::collections::HashSet;

/// Tetrahedra that a flood has been in: mostly some ten around a vertex, but all of a fan where that is the vertex.
struct OriginTerms {
    few: [u32; 48],
    len: usize,
    many: HashSet<u32>,
}

impl OriginTerms {
    fn new() -> Self {
        OriginTerms { few: [0; 48], len: 0, many: HashSet::new() }
    }

    /// Adds one; false if it was there.
    fn insert(&mut self, tet: u32) -> bool {
        if self.few[..self.len].contains(&tet) {
            return false;
        }
        if self.len == self.few.len() {
            return self.many.insert(tet);
        }
        self.few[self.len] = tet;
        self.len += 1;
        true
    }
}

impl TetSpace<'_> {
    /// Offers all constrained faces of the leaf that the line can touch up to the query's limit.
    #[inline(never)]
    pub(crate) fn flood<Q: Query, C: Count>(&self, query: &mut Q, count: &mut C) -> WalkOutcome {
        count.flood();
        let mut seen = OriginTerms::new();
        let mut open: Vec<(u32, Entered)> = Vec::new();
        for face in self.hull {
            if self.touches(&face.vertex.map(|v| self.project(v))) && seen.insert(face.tet) {
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
                    && seen.insert(next)
                {
                    open.push((next, Entered { face, apex, behind }));
                }
            }
        }
        WalkOutcome::Left
    }

    /// Whether the line may meet the closed face: false only if it certainly does not.
    fn touches(&self, corner: &[Projected; 3]) -> bool {
        let sides = self.sides(corner);
        !(sides.contains(&Sign::Positive) && sides.contains(&Sign::Negative))
    }
}
