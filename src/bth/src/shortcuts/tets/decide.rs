//! The decisions that the f32 lanes of a batch of tet walks leave open, made in f64 for one ray at
//! a time.
//!
//! There are three: the exact test of a constrained face that a line crosses, where
//! [`super::reached`] does not decide it; the step of a line that passes close to an edge, after
//! which the ray returns to the lanes; and the flood, where a sign is uncertain in f64, too.
//! Therefore the answers have the same bits as the answers of single rays.

use super::batch::WalkBatch;
use super::lanes::UNCERTAIN;
use super::walk::{Entered, TetPosition, TetWalker, WalkOutcome};
use super::walks::{Reached, WalkStart, WalkState, Walks};
use crate::intersect::line::Line;
use bth_format::layout::{FACE_BIT, NONE, TetFace};

/// Greatest number of times that a ray returns to the lanes; after it, the ray is walked to its end
/// in f64.
const MAX_RETURNS: u8 = 16;
/// Slack of bounds of t, relative to the bound. It exceeds the sum of all rounding errors.
const T_BOUND_SLACK: f64 = 1.0 / (1 << 20) as f64;

impl Walks<'_> {
    /// The line of a ray that was prepared for lanes.
    pub(super) fn line(&self, ray: u32) -> Line {
        Line::new(&self.rays[ray as usize]).expect("a ray that was set up for lanes has a line")
    }

    /// The walker of a ray with this line.
    pub(super) fn walker<'b>(&'b self, line: &'b Line) -> TetWalker<'b> {
        TetWalker::new(self.object, self.leaf, line)
    }

    /// Records how the walk of a ray has ended.
    pub(super) fn finish(&mut self, ray: u32, outcome: WalkOutcome) {
        self.states[ray as usize] =
            if outcome == WalkOutcome::Done { WalkState::Done } else { WalkState::Left };
    }
}

impl WalkBatch<'_> {
    /// Walks the rays that cannot be walked in lanes.
    #[inline(never)]
    pub(super) fn walk_without_lanes(&mut self) {
        while let Some((ray, position)) = self.walks.without_lanes.pop() {
            match position {
                Some(position) => self.walk_in_f64(ray, position),
                None => self.flood(ray),
            }
        }
    }

    /// Walks a ray from a position to its end in f64.
    #[inline(never)]
    pub(super) fn walk_in_f64(&mut self, ray: u32, position: TetPosition) {
        let (line, mut query) = (self.walks.line(ray), self.queries[ray as usize]);
        let walker = self.walks.walker(&line);
        let outcome = match walker.walk(position, &mut query, &mut ()) {
            WalkOutcome::Uncertain => walker.flood(&mut query, &mut ()),
            outcome => outcome,
        };
        self.queries[ray as usize] = query;
        self.walks.finish(ray, outcome);
    }

    /// Repeats the walk of a ray as a flood, whose answer is right for every line.
    #[inline(never)]
    pub(super) fn flood(&mut self, ray: u32) {
        let (line, mut query) = (self.walks.line(ray), self.queries[ray as usize]);
        let outcome = self.walks.walker(&line).flood(&mut query, &mut ());
        self.queries[ray as usize] = query;
        self.walks.finish(ray, outcome);
    }

    /// Returns a ray to the lanes, or walks it to its end if it has returned too often.
    pub(super) fn return_to_lanes(&mut self, start: WalkStart) {
        let returns = &mut self.walks.returns[start.ray as usize];
        *returns += 1;
        if *returns > MAX_RETURNS {
            let WalkStart { ray, tet, entered } = start;
            let line = self.walks.line(ray);
            let corner = entered.face.map(|v| self.walks.walker(&line).project(v));
            self.walk_in_f64(ray, TetPosition { tet, entered, corner });
        } else {
            self.walks.starts.push(start);
        }
    }

    /// Moves a ray through one tetrahedron in f64, and returns it to the lanes or ends its walk.
    #[inline(never)]
    fn step_in_f64(&mut self, start: WalkStart) {
        let ray = start.ray;
        let line = self.walks.line(ray);
        let walker = self.walks.walker(&line);
        let entered = start.entered;
        let mut position =
            TetPosition { tet: start.tet, entered, corner: entered.face.map(|v| walker.project(v)) };
        let Some(link) = walker.exit(&mut position) else { return self.flood(ray) };
        if link.next != NONE && link.next & FACE_BIT != 0 {
            let reached = Reached { ray, face: link.next & !FACE_BIT };
            return self.walks.reached.push(reached);
        }
        match walker.beyond(position.tet, link) {
            None => self.walks.finish(ray, WalkOutcome::Left),
            Some((tet, apex)) => {
                let entered = Entered { apex, ..position.entered };
                self.return_to_lanes(WalkStart { ray, tet, entered });
            }
        }
    }

    /// Tests exactly a constrained face that the line of a ray certainly crosses, and ends the walk
    /// or returns the ray to the lanes in the tetrahedron behind the face.
    #[inline(never)]
    pub(super) fn test_face(&mut self, Reached { ray, face }: Reached) {
        let line = self.walks.line(ray);
        let walker = self.walks.walker(&line);
        let constrained: &TetFace = &self.walks.object.tet_faces[face as usize];
        let mut query = self.queries[ray as usize];
        let done = walker.offer_face(constrained, &mut query);
        // If the line certainly leaves the next tetrahedron beyond the limit, no face further along
        // it can change the result.
        let mut vertex = constrained.vertex;
        let mut corner = vertex.map(|v| walker.project(v));
        let side = usize::from(Line::turns_clockwise(corner.each_ref()));
        if side == 1 {
            vertex.swap(1, 2);
            corner.swap(1, 2);
        }
        let entered = Entered { face: vertex, apex: constrained.opposite[side] };
        let position = TetPosition { tet: constrained.tet[side], entered, corner };
        let left = !done && {
            let mut exit = position;
            walker.exit(&mut exit).is_some()
                && line.t_before(exit.corner.each_ref(), walker.error) > query.limit()
        };
        self.queries[ray as usize] = query;
        match (done, left) {
            (true, _) => self.walks.finish(ray, WalkOutcome::Done),
            (_, true) => self.walks.finish(ray, WalkOutcome::Left),
            _ => self.return_to_lanes(WalkStart { ray, tet: position.tet, entered }),
        }
    }

    /// Evaluates a lane that has stopped. `start` holds its words, with `tet` as described at
    /// `word::TET`; `depth` holds the depths of the corners of its face, if these are kept.
    #[inline(always)]
    pub(super) fn evaluate(&mut self, start: WalkStart, depth: [f32; 3]) {
        let WalkStart { ray, tet, .. } = start;
        if tet == NONE {
            return self.walks.finish(ray, WalkOutcome::Left);
        }
        if tet & UNCERTAIN == UNCERTAIN {
            return self.step_in_f64(WalkStart { tet: tet & !UNCERTAIN, ..start });
        }
        if self.walks.keeps_depths && self.is_certainly_hit(ray, depth) {
            return self.walks.finish(ray, WalkOutcome::Done);
        }
        self.walks.reached.push(Reached { ray, face: tet & !FACE_BIT });
    }

    /// Returns true if the depths of the corners of a face that the line of a ray certainly crosses
    /// complete the ray's query.
    fn is_certainly_hit(&mut self, ray: u32, [a, b, c]: [f32; 3]) -> bool {
        let (least, greatest) = (f64::from(a.min(b).min(c)), f64::from(a.max(b).max(c)));
        let per_t = self.walks.rays[ray as usize].direction.iter().fold(0.0_f32, |m, d| m.max(d.abs()));
        // Depths have a relative error of 2^-24, and the t of a hit is rounded once more.
        let (low, high) = (
            least * (1.0 - T_BOUND_SLACK.copysign(least)),
            greatest * (1.0 + T_BOUND_SLACK.copysign(greatest)),
        );
        self.queries[ray as usize].offer_bounds((low / f64::from(per_t), high / f64::from(per_t)))
    }
}
