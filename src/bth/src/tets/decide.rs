//! Decisions in f64 that the f32 lanes of a batch of tet walks leave open, one ray at a time.
//!
//! These are: the exact test of a constrained face that a line crosses; the exit of a line that passes close to an edge, after which
//! the ray returns to the lanes; and the flood, where a sign is uncertain in f64, too. The answers therefore have the same bits as
//! those of walks of single rays.

use super::batch::{Reached, WalkBatch, WalkStart, WalkState};
use super::lanes::DOUBT;
use super::records::{Entered, ReadRecords};
use super::walk::{TetPosition, TetSpace, WalkOutcome};
use super::{leaf_of_face, space};
use crate::intersect::line::Line;
use crate::query::Query;
use bth_format::layout::{FACE_BIT, NONE, TetFace};

/// A ray that returns to the lanes more often is walked to its end in f64.
const MAX_RETURNS: u8 = 16;
/// Slack of bounds of t, relative to them: more than all roundings together.
const T_BOUND_SLACK: f64 = 1.0 / (1 << 20) as f64;

impl<Q: Query + Copy> WalkBatch<'_, Q> {
    /// The line of a ray that is prepared for lanes.
    pub(super) fn line(&self, slot: u32) -> Line {
        Line::new(&self.rays[slot as usize]).expect("a ray that was set up for lanes has a line")
    }

    /// The tet leaf through which a ray walks.
    pub(super) fn space<'b>(&'b self, slot: u32, line: &'b Line) -> TetSpace<'b> {
        let leaf = match (self.object.tet_leaves, self.leaves[slot as usize]) {
            ([_], _) => 0,
            (_, NONE) => leaf_of_face(self.object, self.faces[slot as usize]),
            (_, leaf) => leaf,
        };
        space(self.object, leaf, line)
    }

    /// Ends the walk of a ray.
    pub(super) fn finish(&mut self, slot: u32, outcome: WalkOutcome) {
        self.walks[slot as usize] =
            if outcome == WalkOutcome::Done { WalkState::Done } else { WalkState::Left };
    }

    /// Walks to the end in f64.
    #[inline(never)]
    pub(super) fn walk_alone(&mut self, slot: u32, position: TetPosition) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let space = self.space(slot, &line);
        let outcome = match space.walk(position, &mut query, &mut ()) {
            WalkOutcome::Uncertain => space.flood(&mut query, &mut ()),
            outcome => outcome,
        };
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    /// Repeats the walk of a ray as a flood.
    #[inline(never)]
    pub(super) fn flood(&mut self, slot: u32) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let outcome = self.space(slot, &line).flood(&mut query, &mut ());
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    /// Returns a ray to the lanes, or walks it to its end if it has returned too often.
    fn return_to_lanes(&mut self, slot: u32, position: TetPosition) {
        let returns = &mut self.returns[slot as usize];
        *returns += 1;
        if *returns > MAX_RETURNS {
            self.walk_alone(slot, position);
        } else {
            self.starts.push(WalkStart { slot, tet: position.tet, entered: position.entered });
        }
    }

    /// Makes the step through one tetrahedron in f64.
    #[inline(never)]
    fn step_in_f64(&mut self, start: WalkStart) {
        let slot = start.slot;
        let line = self.line(slot);
        let space = self.space(slot, &line);
        let mut entered = start.entered;
        entered.apex = self.object.records.apex(start.tet, entered.face, entered.apex);
        let mut position =
            TetPosition { tet: start.tet, entered, corner: entered.face.map(|v| space.project(v)) };
        let Some(link) = space.exit(&mut position) else { return self.flood(slot) };
        if link.next != NONE && link.next & FACE_BIT != 0 {
            let reached = Reached { slot, face: link.next & !FACE_BIT };
            return self.reached.push(reached);
        }
        match space.beyond(position.tet, link, position.entered.face) {
            None => self.finish(slot, WalkOutcome::Left),
            Some((tet, apex, behind)) => {
                (position.tet, position.entered.apex, position.entered.behind) = (tet, apex, behind);
                self.return_to_lanes(slot, position);
            }
        }
    }

    /// Tests exactly a constrained face whose plane region a ray certainly crosses, and ends the walk or returns the ray to the lanes
    /// behind the face.
    fn test_face(&mut self, Reached { slot, face }: Reached) {
        let line = self.line(slot);
        let space = self.space(slot, &line);
        let row: &TetFace = &self.object.tet_faces[face as usize];
        let mut query = self.queries[slot as usize];
        let done = space.offer(row, &mut query);
        // If the line leaves the next tetrahedron certainly beyond the limit, no later face can change the result.
        let mut vertex = row.vertex;
        let mut corner = vertex.map(|v| space.project(v));
        let side = usize::from(Line::turns_clockwise(corner.each_ref()));
        if side == 1 {
            vertex.swap(1, 2);
            corner.swap(1, 2);
        }
        let entered = Entered { face: vertex, apex: row.opposite[side], behind: face | FACE_BIT };
        let position = TetPosition { tet: row.tet[side], entered, corner };
        let left = !done && {
            let mut exit = position;
            space.exit(&mut exit).is_some()
                && line.t_before(exit.corner.each_ref(), space.error) > query.limit()
        };
        self.queries[slot as usize] = query;
        match (done, left) {
            (true, _) => self.finish(slot, WalkOutcome::Done),
            (_, true) => self.finish(slot, WalkOutcome::Left),
            _ => self.return_to_lanes(slot, position),
        }
    }

    /// Tests all faces that lanes have reached.
    pub(super) fn test_reached_faces(&mut self) {
        let mut reached = std::mem::take(&mut self.reached);
        for reached in reached.drain(..) {
            self.test_face(reached);
        }
        // The tests may have reached more faces.
        reached.append(&mut self.reached);
        self.reached = reached;
    }

    /// Evaluates a lane that has stopped, given its words and the depths of the corners of its face.
    #[inline]
    pub(super) fn evaluate(&mut self, start: WalkStart, depth: [f32; 3]) {
        let WalkStart { slot, tet, .. } = start;
        if tet == NONE {
            return self.finish(slot, WalkOutcome::Left);
        }
        if tet & DOUBT == DOUBT {
            return self.step_in_f64(WalkStart { tet: tet & !DOUBT, ..start });
        }
        if !Q::KEEPS_DEPTHS {
            return self.reached.push(Reached { slot, face: tet & !FACE_BIT });
        }
        let [a, b, c] = depth;
        let (least, greatest) = (f64::from(a.min(b).min(c)), f64::from(a.max(b).max(c)));
        let per_t = self.rays[slot as usize].direction.iter().fold(0.0_f32, |m, d| m.max(d.abs()));
        // Depths have a relative error of 2^-24, and the t of a hit is rounded once more.
        let (low, high) = (
            least * (1.0 - T_BOUND_SLACK.copysign(least)),
            greatest * (1.0 + T_BOUND_SLACK.copysign(greatest)),
        );
        if self.queries[slot as usize].offer_bounds((low / f64::from(per_t), high / f64::from(per_t))) {
            return self.finish(slot, WalkOutcome::Done);
        }
        self.reached.push(Reached { slot, face: tet & !FACE_BIT });
    }
}
