//! What the lanes of a batch of tet walks cannot tell, decided ray by ray in f64.
//!
//! That is whether a face that was crossed is a hit, which way a line goes that passes close to an edge (then the ray
//! goes back to the lanes), and what a line meets that f64 cannot tell either (by a flood). So the answers are those of
//! the walk of one ray, to the bit.

use super::batch::{Reached, WalkBatch, WalkStart, WalkState};
use super::lanes::DOUBT;
use super::records::{Entered, ReadRecords};
use super::walk::{TetPosition, TetSpace, WalkOutcome};
use super::{leaf_of_face, space};
use crate::intersect::line::Line;
use crate::query::Query;
use bth_format::layout::{FACE_BIT, NONE, TetFace};

/// A ray that went back to the lanes so often is walked to its end in f64.
const MOST_RETURNS: u8 = 16;
/// Depths and bounds of t are compared with this much to spare.
const SPARE: f64 = 1.0 / (1 << 20) as f64;

impl<Q: Query + Copy> WalkBatch<'_, Q> {
    pub(super) fn line(&self, slot: u32) -> Line {
        Line::new(&self.rays[slot as usize]).expect("a ray that was set up for lanes has a line")
    }

    pub(super) fn space<'b>(&'b self, slot: u32, line: &'b Line) -> TetSpace<'b> {
        let leaf = match (self.object.tet_leaves, self.leaves[slot as usize]) {
            ([_], _) => 0,
            (_, NONE) => leaf_of_face(self.object, self.faces[slot as usize]),
            (_, leaf) => leaf,
        };
        space(self.object, leaf, line)
    }

    pub(super) fn finish(&mut self, slot: u32, outcome: WalkOutcome) {
        self.walks[slot as usize] =
            if outcome == WalkOutcome::Done { WalkState::Done } else { WalkState::Left };
    }

    /// Walks to the end in f64.
    #[inline(never)]
    pub(super) fn walk_alone(&mut self, slot: u32, place: TetPosition) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let space = self.space(slot, &line);
        let outcome = match space.walk(place, &mut query, &mut ()) {
            WalkOutcome::Uncertain => space.flood(&mut query, &mut ()),
            outcome => outcome,
        };
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    #[inline(never)]
    pub(super) fn flood(&mut self, slot: u32) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let outcome = self.space(slot, &line).flood(&mut query, &mut ());
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    /// Sends a ray back to the lanes, unless it has been too often.
    fn go_on(&mut self, slot: u32, place: TetPosition) {
        let returns = &mut self.returns[slot as usize];
        *returns += 1;
        if *returns > MOST_RETURNS {
            self.walk_alone(slot, place);
        } else {
            self.starts.push(WalkStart { slot, tet: place.tet, entered: place.entered });
        }
    }

    /// Goes through one tetrahedron in f64.
    #[inline(never)]
    fn in_doubt(&mut self, start: WalkStart) {
        let slot = start.slot;
        let line = self.line(slot);
        let space = self.space(slot, &line);
        let mut entered = start.entered;
        entered.apex = self.object.records.apex(start.tet, entered.face, entered.apex);
        let mut place =
            TetPosition { tet: start.tet, entered, corner: entered.face.map(|v| space.project(v)) };
        let Some(link) = space.exit(&mut place) else { return self.flood(slot) };
        if link.next != NONE && link.next & FACE_BIT != 0 {
            let reached = Reached { slot, face: link.next & !FACE_BIT };
            return self.reached.push(reached);
        }
        match space.beyond(place.tet, link, place.entered.face) {
            None => self.finish(slot, WalkOutcome::Left),
            Some((tet, apex, behind)) => {
                (place.tet, place.entered.apex, place.entered.behind) = (tet, apex, behind);
                self.go_on(slot, place);
            }
        }
    }

    /// CachedHits in f64 at a constrained face that a ray certainly crosses.
    fn compute(&mut self, Reached { slot, face }: Reached) {
        let line = self.line(slot);
        let space = self.space(slot, &line);
        let row: &TetFace = &self.object.tet_faces[face as usize];
        let mut query = self.queries[slot as usize];
        let done = space.offer(row, &mut query);
        // Another face is as near within rounding only if the line leaves the next tetrahedron at once.
        let mut vertex = row.vertex;
        let mut corner = vertex.map(|v| space.project(v));
        let side = usize::from(Line::turns_clockwise(corner.each_ref()));
        if side == 1 {
            vertex.swap(1, 2);
            corner.swap(1, 2);
        }
        let entered = Entered { face: vertex, apex: row.opposite[side], behind: face | FACE_BIT };
        let place = TetPosition { tet: row.tet[side], entered, corner };
        let left = !done && {
            let mut exit = place;
            space.exit(&mut exit).is_some()
                && line.t_before(exit.corner.each_ref(), space.error) > query.limit()
        };
        self.queries[slot as usize] = query;
        match (done, left) {
            (true, _) => self.finish(slot, WalkOutcome::Done),
            (_, true) => self.finish(slot, WalkOutcome::Left),
            _ => self.go_on(slot, place),
        }
    }

    pub(super) fn look_at_all(&mut self) {
        let mut reached = std::mem::take(&mut self.reached);
        for reached in reached.drain(..) {
            self.compute(reached);
        }
        // `look` may have found more.
        reached.append(&mut self.reached);
        self.reached = reached;
    }

    /// Takes a lane that has stopped.
    #[inline]
    pub(super) fn stopped(&mut self, start: WalkStart, depth: [f32; 3]) {
        let WalkStart { slot, tet, .. } = start;
        if tet == NONE {
            return self.finish(slot, WalkOutcome::Left);
        }
        if tet & DOUBT == DOUBT {
            return self.in_doubt(WalkStart { tet: tet & !DOUBT, ..start });
        }
        if !Q::KEEPS_DEPTHS {
            return self.reached.push(Reached { slot, face: tet & !FACE_BIT });
        }
        let [a, b, c] = depth;
        let (least, greatest) = (f64::from(a.min(b).min(c)), f64::from(a.max(b).max(c)));
        let per_t = self.rays[slot as usize].direction.iter().fold(0.0_f32, |m, d| m.max(d.abs()));
        // Depths are off by 2^-24 of themselves; a hit's t is rounded once more.
        let (low, high) =
            (least * (1.0 - SPARE.copysign(least)), greatest * (1.0 + SPARE.copysign(greatest)));
        if self.queries[slot as usize].offer_bounds((low / f64::from(per_t), high / f64::from(per_t))) {
            return self.finish(slot, WalkOutcome::Done);
        }
        self.reached.push(Reached { slot, face: tet & !FACE_BIT });
    }
}
