//! Tet walks of a whole batch: three times sixteen lanes at a time, across rays and tet leaves.
//!
//! A lane that stops makes room for the next ray at once. What lanes cannot decide is decided here, ray by ray, in f64:
//! whether a face that was crossed is a hit, which way a line goes that passes close to an edge (then the ray
//! goes back to the lanes), and what a line meets that f64 cannot tell either (by a flood). So the answers are those of
//! the walk of one ray, to the bit.

use super::line::Line;
use super::query::Query;
use super::records::{Entered, LaneRecord};
use super::tet_lanes::{DOUBT, Lanes, Step, float, three, word};
use super::tet_queue::{Queue, Ready};
use super::tet_walk::{Outcome, Place, TetSpace};
use super::tets::{leaf_of_face, space};
use crate::layout::{FACE_BIT, NONE, TetFace};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{Kernel, LANES, Simd};
use zerocopy::{FromBytes, IntoBytes};

/// Idle lanes of a group that are worth a refill.
const WORTH_A_REFILL: u32 = 6;
/// Hits that wait to be looked at in f64 together.
const PENDING: usize = 64;
/// A ray that went back to the lanes so often is walked to its end in f64.
const MOST_RETURNS: u8 = 16;

/// What has become of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Walk {
    /// It was not walked.
    Not,
    /// Its line was followed to where it leaves the tet leaf, or nothing nearer can follow.
    Left,
    /// Its query has what it wants.
    Done,
}

/// A tetrahedron where a ray is, or is to begin.
#[derive(Clone, Copy, Debug)]
struct Start {
    slot: u32,
    tet: u32,
    /// Entered through a face that the line crosses for certain, counterclockwise.
    entered: Entered,
}

/// A constrained face that a ray certainly crosses.
#[derive(Clone, Copy, Debug)]
struct Reached {
    slot: u32,
    face: u32,
}

/// The batch: rays, where they begin, and what is known of them.
pub(crate) struct Batch<'a, R, Q> {
    pub(crate) object: &'a ObjectView<'a>,
    pub(crate) records: &'a [R],
    pub(crate) rays: &'a [Ray],
    /// For each ray the constrained face that it starts about, or [`NONE`].
    pub(crate) faces: &'a [u32],
    pub(crate) queries: &'a mut [Q],
    pub(crate) walks: &'a mut [Walk],
    next: usize,
    starts: Vec<Start>,
    reached: Vec<Reached>,
    returns: Vec<u8>,
}

impl<'a, R: LaneRecord, Q: Query + Copy> Batch<'a, R, Q> {
    /// None of the rays has been walked yet. All slices have one element a ray.
    pub(crate) fn new(
        object: &'a ObjectView<'a>,
        records: &'a [R],
        rays: &'a [Ray],
        faces: &'a [u32],
        queries: &'a mut [Q],
        walks: &'a mut [Walk],
    ) -> Self {
        walks.fill(Walk::Not);
        Batch {
            object,
            records,
            rays,
            faces,
            queries,
            walks,
            next: 0,
            starts: Vec::new(),
            reached: Vec::new(),
            returns: vec![0; rays.len()],
        }
    }

    /// Whether lanes can address all parts of an object: their words by less than 2^31.
    pub(crate) fn fits(object: &ObjectView<'_>, records: &[R]) -> bool {
        const MOST: usize = 1 << 31;
        records.len() < MOST / 8 && object.tet_vertices.len() < MOST / 4 && object.tet_faces.len() < MOST / 8
    }

    fn line(&self, slot: u32) -> Line {
        Line::new(&self.rays[slot as usize]).expect("a ray that was set up for lanes has a line")
    }

    fn space<'b>(&'b self, slot: u32, line: &'b Line) -> TetSpace<'b, R> {
        let leaf = match self.object.tet_leaves {
            [_] => 0,
            _ => leaf_of_face(self.object, self.faces[slot as usize]),
        };
        space(self.object, self.records, leaf, line)
    }

    fn finish(&mut self, slot: u32, outcome: Outcome) {
        self.walks[slot as usize] = if outcome == Outcome::Done { Walk::Done } else { Walk::Left };
    }

    /// Walks to the end in f64.
    #[inline(never)]
    fn walk_alone(&mut self, slot: u32, place: Place) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let space = self.space(slot, &line);
        let outcome = match space.walk(place, &mut query, &mut ()) {
            Outcome::Uncertain => space.flood(&mut query, &mut ()),
            outcome => outcome,
        };
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    #[inline(never)]
    fn flood(&mut self, slot: u32) {
        let (line, mut query) = (self.line(slot), self.queries[slot as usize]);
        let outcome = self.space(slot, &line).flood(&mut query, &mut ());
        self.queries[slot as usize] = query;
        self.finish(slot, outcome);
    }

    /// Sends a ray back to the lanes, unless it has been too often.
    fn go_on(&mut self, slot: u32, place: Place) {
        let returns = &mut self.returns[slot as usize];
        *returns += 1;
        if *returns > MOST_RETURNS {
            self.walk_alone(slot, place);
        } else {
            self.starts.push(Start { slot, tet: place.tet, entered: place.entered });
        }
    }

    /// Goes through one tetrahedron in f64.
    #[inline(never)]
    fn in_doubt(&mut self, start: Start) {
        let slot = start.slot;
        let line = self.line(slot);
        let space = self.space(slot, &line);
        let mut entered = start.entered;
        entered.apex = self.records[start.tet as usize].apex(entered.face, entered.apex);
        let mut place = Place { tet: start.tet, entered, corner: entered.face.map(|v| space.project(v)) };
        let Some(link) = space.exit(&mut place) else { return self.flood(slot) };
        if link.next != NONE && link.next & FACE_BIT != 0 {
            let reached = Reached { slot, face: link.next & !FACE_BIT };
            return self.reached.push(reached);
        }
        match space.beyond(place.tet, link, place.entered.face) {
            None => self.finish(slot, Outcome::Left),
            Some((tet, apex, behind)) => {
                (place.tet, place.entered.apex, place.entered.behind) = (tet, apex, behind);
                self.go_on(slot, place);
            }
        }
    }

    /// Looks in f64 at a constrained face that a ray certainly crosses.
    fn look(&mut self, Reached { slot, face }: Reached) {
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
        let place = Place { tet: row.tet[side], entered, corner };
        let left = !done && {
            let mut exit = place;
            space.exit(&mut exit).is_some()
                && line.t_before(exit.corner.each_ref(), space.error) > query.limit()
        };
        self.queries[slot as usize] = query;
        match (done, left) {
            (true, _) => self.finish(slot, Outcome::Done),
            (_, true) => self.finish(slot, Outcome::Left),
            _ => self.go_on(slot, place),
        }
    }

    fn look_at_all(&mut self) {
        let mut reached = std::mem::take(&mut self.reached);
        for reached in reached.drain(..) {
            self.look(reached);
        }
        // `look` may have found more.
        reached.append(&mut self.reached);
        self.reached = reached;
    }

    /// Takes a lane that has stopped.
    #[inline]
    fn stopped(&mut self, start: Start, depth: [f32; 3]) {
        let Start { slot, tet, .. } = start;
        if tet == NONE {
            return self.finish(slot, Outcome::Left);
        }
        if tet & DOUBT == DOUBT {
            return self.in_doubt(Start { tet: tet & !DOUBT, ..start });
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
        if self.queries[slot as usize].settled_by((low / f64::from(per_t), high / f64::from(per_t))) {
            return self.finish(slot, Outcome::Done);
        }
        self.reached.push(Reached { slot, face: tet & !FACE_BIT });
    }

    /// Gets sixteen rays ready, if there are as many.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, s: S, queue: &mut Queue) {
        if self.reached.len() >= PENDING {
            self.look_at_all();
        }
        queue.rewind();
        while queue.has_room() {
            if self.starts.len() >= LANES || self.next >= self.faces.len() {
                if self.starts.is_empty() {
                    self.look_at_all();
                }
                if self.starts.is_empty() {
                    return;
                }
                self.fill_from_starts(s, queue);
            } else {
                self.fill_from_faces(s, queue);
            }
        }
    }

    #[inline(always)]
    fn fill_from_starts<S: Simd>(&mut self, s: S, queue: &mut Queue) {
        let some = self.starts.len().saturating_sub(LANES);
        let starts = &self.starts[some..];
        let valid = (1u32 << starts.len()) - 1;
        let mut columns = [[0; LANES]; 7];
        for (i, start) in starts.iter().enumerate() {
            let Start { slot, tet, entered: Entered { face, apex, behind } } = *start;
            for (column, value) in
                columns.iter_mut().zip([slot, tet, apex, behind, face[0], face[1], face[2]])
            {
                column[i] = value;
            }
        }
        let slot = s.load_u(&columns[0]);
        let face = three!(|k| s.load_u(&columns[4 + k]));
        let mut ready = Ready::new(s, s.mask(valid), rays(self.rays), vertices(self.object), slot, face);
        ready.lanes.words[word::TET] = s.load_u(&columns[1]);
        ready.lanes.words[word::APEX] = s.load_u(&columns[2]);
        ready.lanes.words[word::BEHIND] = s.load_u(&columns[3]);
        let able = s.mask_bits(ready.able);
        queue.push(s, able, &ready.lanes);
        let mut rest = valid & !able;
        if rest == 0 {
            return self.starts.truncate(some);
        }
        let starts = self.starts.split_off(some);
        while rest != 0 {
            let start = starts[rest.trailing_zeros() as usize];
            rest &= rest - 1;
            let line = self.line(start.slot);
            let corner =
                start.entered.face.map(|v| line.project(self.object.tet_vertices[v as usize].position));
            self.walk_alone(start.slot, Place { tet: start.tet, entered: start.entered, corner });
        }
    }

    #[inline(always)]
    fn fill_from_faces<S: Simd>(&mut self, s: S, queue: &mut Queue) {
        let first = self.next;
        let part = &self.faces[first..self.faces.len().min(first + LANES)];
        self.next += part.len();
        let mut row = [NONE; LANES];
        row[..part.len()].copy_from_slice(part);
        let row = s.load_u(&row);
        let valid = s.lt_u(row, s.splat_u(NONE));
        if s.mask_bits(valid) == 0 {
            return;
        }
        let slot = s.load_u(&std::array::from_fn(|i| (first + i) as u32));
        let faces = <[u32]>::ref_from_bytes(self.object.tet_faces.as_bytes()).expect("whole words");
        let (ready, able) =
            Ready::from_faces(s, valid, rays(self.rays), vertices(self.object), faces, slot, row);
        let able = s.mask_bits(able);
        queue.push(s, able, &ready.lanes);
        let mut rest = s.mask_bits(valid) & !able;
        while rest != 0 {
            self.locate(first as u32 + rest.trailing_zeros());
            rest &= rest - 1;
        }
    }

    /// Looks in f64 for the place where a ray begins.
    #[inline(never)]
    fn locate(&mut self, slot: u32) {
        let ray = &self.rays[slot as usize];
        // A walk from the origin sees only what lies ahead of it.
        if ray.tmin.is_nan() || ray.tmin < 0.0 {
            return;
        }
        let Some(line) = Line::new(ray) else { return };
        if let Some(place) = self.space(slot, &line).locate(self.faces[slot as usize]) {
            self.starts.push(Start { slot, tet: place.tet, entered: place.entered });
        }
    }

    #[inline(always)]
    fn refill<S: Simd>(&mut self, s: S, queue: &mut Queue, group: &mut Group<S>, clock: &mut Clock) {
        let active = s.mask_bits(group.lanes.active(s));
        let idle = LANES as u32 - active.count_ones();
        if idle < WORTH_A_REFILL || !(clock.more || (active == 0 && group.held != 0)) {
            return;
        }
        let stopped = group.held & !active;
        if stopped != 0 {
            self.take_stopped(s, &group.lanes, stopped);
        }
        group.held = active;
        let mut idle = !active & 0xffff;
        while idle != 0 {
            if queue.len() == 0 {
                self.fill(s, queue);
            }
            let taken = queue.pop(s, idle, &mut group.lanes);
            idle &= !taken;
            group.held |= taken;
            group.since = s.select_u(s.mask(taken), s.splat_u(clock.round), group.since);
            clock.more = taken != 0;
            if !clock.more {
                break;
            }
        }
    }

    /// Stops walks that began two rounds ago, in each of which every lane made as many steps as there are tetrahedra.
    #[inline(always)]
    fn give_up<S: Simd>(&mut self, s: S, group: &mut Group<S>, round: u32) {
        let old = s.and(group.lanes.active(s), s.lt_u(group.since, s.splat_u(round.saturating_sub(1))));
        let mut bits = s.mask_bits(old);
        let mut slot = [0; LANES];
        s.store_u(group.lanes.words[word::SLOT], &mut slot);
        let tet = &mut group.lanes.words[word::TET];
        *tet = s.select_u(old, s.splat_u(NONE), *tet);
        group.held &= !bits;
        while bits != 0 {
            self.flood(slot[bits.trailing_zeros() as usize % LANES]);
            bits &= bits - 1;
        }
    }

    /// Hands over the lanes of a group that have stopped.
    #[inline(always)]
    fn take_stopped<S: Simd>(&mut self, s: S, lanes: &Lanes<S>, mut stopped: u32) {
        let (mut words, mut slot, mut depth) = ([[0; LANES]; word::AXIS], [0; LANES], [[0.0; LANES]; 3]);
        macro_rules! store {
            ($($i:literal)*) => { $(s.store_u(lanes.words[$i], &mut words[$i]);)* };
        }
        store!(0 1 2 3 4 5);
        s.store_u(lanes.words[word::SLOT], &mut slot);
        if Q::KEEPS_DEPTHS {
            s.store(lanes.floats[float::DEPTH], &mut depth[0]);
            s.store(lanes.floats[float::DEPTH + 1], &mut depth[1]);
            s.store(lanes.floats[float::DEPTH + 2], &mut depth[2]);
        }
        while stopped != 0 {
            let lane = stopped.trailing_zeros() as usize % LANES;
            stopped &= stopped - 1;
            let word = |name: usize| words[name][lane];
            let entered = Entered {
                face: [word(word::FACE), word(word::FACE + 1), word(word::FACE + 2)],
                apex: word(word::APEX),
                behind: word(word::BEHIND),
            };
            let start = Start { slot: slot[lane], tet: word(word::TET), entered };
            self.stopped(start, depth.map(|row| row[lane]));
        }
    }
}

/// Depths and bounds of t are compared with this much to spare.
const SPARE: f64 = 1.0 / (1 << 20) as f64;

fn rays(rays: &[Ray]) -> &[f32] {
    <[f32]>::ref_from_bytes(rays.as_bytes()).expect("a ray is eight words")
}

fn vertices<'a>(object: &ObjectView<'a>) -> &'a [[f32; 4]] {
    <[[f32; 4]]>::ref_from_bytes(object.tet_vertices.as_bytes()).expect("a vertex is four words")
}

/// A group of lanes, those of them that hold a ray, and when they got it.
#[derive(Clone, Copy)]
struct Group<S: Simd> {
    lanes: Lanes<S>,
    step: Step<S>,
    held: u32,
    since: S::U,
}

impl<R: LaneRecord, Q: Query + Copy> Kernel for &mut Batch<'_, R, Q> {
    type Output = ();

    /// Walks all rays.
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let words = R::words(self.records);
        let vertices = vertices(self.object);
        let mut queue = Queue::new();
        let idle = Group { lanes: Lanes::idle(s), step: Step::none(s), held: 0, since: s.splat_u(0) };
        let (mut a, mut b, mut c) = (idle, idle, idle);
        // A line meets a tetrahedron once; more steps than there are tetrahedra mean bad data.
        let most = self.records.len();
        let mut clock = Clock { round: 0, more: true };
        let mut steps = 0;
        let one = s.splat_u(std::hint::black_box(1));
        loop {
            self.refill(s, &mut queue, &mut a, &mut clock);
            self.refill(s, &mut queue, &mut b, &mut clock);
            self.refill(s, &mut queue, &mut c, &mut clock);
            if a.held | b.held | c.held == 0 {
                return;
            }
            a.lanes.fetch::<R>(s, one, &mut a.step, words, vertices);
            b.lanes.fetch::<R>(s, one, &mut b.step, words, vertices);
            c.lanes.fetch::<R>(s, one, &mut c.step, words, vertices);
            macro_rules! onward {
                ($depths:literal $($group:ident)*) => {
                    $($group.lanes.choose::<$depths>(s, &mut $group.step);)*
                    $($group.lanes.follow::<R, $depths>(s, one, &$group.step, words);)*
                };
            }
            if Q::KEEPS_DEPTHS {
                onward!(true a b c);
            } else {
                onward!(false a b c);
            }
            steps += 1;
            if steps == most {
                (clock.round, steps) = (clock.round + 1, 0);
                self.give_up(s, &mut a, clock.round);
                self.give_up(s, &mut b, clock.round);
                self.give_up(s, &mut c, clock.round);
            }
        }
    }
}

struct Clock {
    round: u32,
    more: bool,
}
