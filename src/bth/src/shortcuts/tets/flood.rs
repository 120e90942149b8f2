//! Fallback of a tet walk for lines that pass through an edge or a vertex: a flood fill over all
//! tetrahedra that the line may touch.
//!
//! The flood starts at the hull faces that the line may touch within the bounds of rounding errors,
//! and crosses every such face. All tetrahedra at a vertex or an edge are connected through faces
//! that contain the vertex or edge. Therefore the flood reaches every tetrahedron that the line
//! touches, and every constrained face that the exact test can accept. Each tetrahedron is visited
//! once, so the flood ends.

use super::walk::{Entered, TetWalker, WalkOutcome};
use crate::intersect::line::{Projected, Sign};
use crate::query::{Count, EitherQuery, Receiver, TriangleRef};
use bth_format::layout::{FACE_BIT, NONE};

/// The tetrahedra that a flood has visited, or the faces. Around most vertices these are about ten,
/// around the center of a fan up to all of the leaf.
pub(crate) struct VisitedSet {
    /// The elements while there are few. An array needs no allocation.
    first: [u32; VisitedSet::FIRST],
    /// Number of elements of `first` that are set.
    len: usize,
    /// A bit for each element once there are many, so that the time of a flood is linear in the
    /// tetrahedra that it visits; else empty.
    bits: Vec<u64>,
}

impl VisitedSet {
    /// More than lines visit in most models, few enough to be searched one by one.
    const FIRST: usize = 256;

    pub(crate) fn new() -> Self {
        VisitedSet { first: [0; VisitedSet::FIRST], len: 0, bits: Vec::new() }
    }

    /// Adds an element; returns false if it was already in the set.
    pub(crate) fn insert(&mut self, tet: u32) -> bool {
        if !self.bits.is_empty() {
            return self.insert_bit(tet);
        }
        if self.first[..self.len].contains(&tet) {
            return false;
        }
        if self.len == self.first.len() {
            for i in 0..self.len {
                self.insert_bit(self.first[i]);
            }
            return self.insert_bit(tet);
        }
        self.first[self.len] = tet;
        self.len += 1;
        true
    }

    fn insert_bit(&mut self, tet: u32) -> bool {
        let (word, bit) = (tet as usize / 64, 1 << (tet % 64));
        if word >= self.bits.len() {
            self.bits.resize(word + 1, 0);
        }
        let is_new = self.bits[word] & bit == 0;
        self.bits[word] |= bit;
        is_new
    }
}

/// Tetrahedra that a flood has yet to pass, with the faces through which it enters them. Most are
/// few enough to need no allocation.
type Pending = smallvec::SmallVec<[(u32, Entered); 64]>;

/// Offers the faces to a query.
struct Offering<'a, 'w> {
    walker: &'a TetWalker<'w>,
    query: &'a mut EitherQuery,
}

impl Receiver for Offering<'_, '_> {
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool {
        self.walker.offer(triangle, corners, self.query)
    }
    fn limit(&self) -> f64 {
        self.query.limit()
    }
}

impl TetWalker<'_> {
    /// Offers to the query all constrained faces of the leaf that the line can touch up to the
    /// query's limit. Returns `Done` if the query is complete, else `Left`.
    pub(crate) fn flood<C: Count>(&self, query: &mut EitherQuery, count: &mut C) -> WalkOutcome {
        if self.flood_faces(&mut Offering { walker: self, query }, count) {
            WalkOutcome::Done
        } else {
            WalkOutcome::Left
        }
    }

    /// Passes all constrained faces of the leaf that the line can touch up to the receiver's limit,
    /// each once or from both sides.
    /// Returns true if the query is complete.
    #[inline(never)]
    pub(crate) fn flood_faces<C: Count>(&self, receiver: &mut dyn Receiver, count: &mut C) -> bool {
        count.flood();
        let mut visited = VisitedSet::new();
        let mut stack = Pending::new();
        for face in self.hull {
            if self.touches(&face.vertex.map(|v| self.project(v))) && visited.insert(face.tet) {
                stack.push((face.tet, Entered { face: face.vertex, apex: face.opposite }));
            }
        }
        while let Some((tet, entered)) = stack.pop() {
            count.cell();
            let apex = self.project(entered.apex);
            let corner = entered.face.map(|v| self.project(v));
            for replaced in 0..3 {
                let (mut face, mut projected) = (entered.face, corner);
                face[replaced] = entered.apex;
                projected[replaced] = apex;
                if !self.touches(&projected) {
                    continue;
                }
                let link = self.link(tet, &entered, entered.face[replaced]);
                let constrained = link.next & FACE_BIT != 0 && link.next != NONE;
                if constrained {
                    let (triangle, corners) = self.triangle(&self.faces[(link.next & !FACE_BIT) as usize]);
                    if receiver.receive(triangle, corners) {
                        return true;
                    }
                }
                if self.line.t_range(projected.each_ref()).0 > receiver.limit() {
                    continue;
                }
                if let Some((next, apex)) = self.beyond(tet, link)
                    && visited.insert(next)
                {
                    stack.push((next, Entered { face, apex }));
                }
            }
        }
        false
    }

    /// Returns true if the line may touch the closed face; false only if it certainly does not.
    fn touches(&self, corner: &[Projected; 3]) -> bool {
        let sides = self.sides(corner);
        !(sides.contains(&Sign::Positive) && sides.contains(&Sign::Negative))
    }
}
