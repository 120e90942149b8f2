//! Tet walks of a batch of rays, in one or several tet leaves: the state of the batch, and the preparation of rays for lanes.
//!
//! The kernel is in [`super::rounds`]; decisions that its f32 lanes leave open are made in [`super::decide`].

use super::lanes::{three, word};
use super::queue::{Ready, ReadyQueue};
use super::records::{Entered, LaneRecords};
use super::walk::{TetPosition, WalkOutcome};
use crate::intersect::line::Line;
use crate::query::Query;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use zerocopy::{FromBytes, IntoBytes};

/// Number of reached faces that are tested in f64 together.
const PENDING: usize = 64;

/// State of a ray's walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WalkState {
    /// The ray was not walked.
    NotWalked,
    /// The query holds all hits of the ray in the tet leaf that can change its result.
    Left,
    /// The query is complete.
    Done,
}

/// The tetrahedron in which a ray's walk begins or continues.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkStart {
    /// Index of the ray in the batch.
    pub(super) slot: u32,
    pub(super) tet: u32,
    /// The entered face is certainly crossed by the line, and counterclockwise as seen along the ray.
    pub(super) entered: Entered,
}

/// A constrained face that a ray's line certainly crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    /// Index of the ray in the batch.
    pub(super) slot: u32,
    pub(super) face: u32,
}

/// The rays of a batch and where their walks begin; see the fields of [`WalkBatch`].
pub(crate) struct WalkRays<'a> {
    pub(crate) rays: &'a [Ray],
    pub(crate) faces: &'a [u32],
    pub(crate) leaves: &'a [u32],
}

/// The batch: its rays, where their walks begin, and their state.
pub(crate) struct WalkBatch<'a, Q> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) records: LaneRecords<'a>,
    pub(super) rays: &'a [Ray],
    /// For each ray the constrained face near which it starts, or [`NONE`].
    pub(super) faces: &'a [u32],
    /// For each ray the tet leaf that it enters from outside if it does not start near a face, or [`NONE`].
    pub(super) leaves: &'a [u32],
    pub(super) queries: &'a mut [Q],
    pub(super) walks: &'a mut [WalkState],
    /// Index of the first ray that is not yet prepared.
    next: usize,
    /// Walks that begin or continue within a leaf.
    pub(super) starts: Vec<WalkStart>,
    /// Faces that lanes have reached and that are not yet tested.
    pub(super) reached: Vec<Reached>,
    /// For each ray how often it has returned to the lanes.
    pub(super) returns: Vec<u8>,
}

impl<'a, Q: Query + Copy> WalkBatch<'a, Q> {
    /// A batch of which no ray has been walked. All slices have one element per ray.
    pub(crate) fn new(
        object: &'a ObjectView<'a>,
        records: LaneRecords<'a>,
        WalkRays { rays, faces, leaves }: WalkRays<'a>,
        queries: &'a mut [Q],
        walks: &'a mut [WalkState],
    ) -> Self {
        walks.fill(WalkState::NotWalked);
        WalkBatch {
            object,
            records,
            rays,
            faces,
            leaves,
            queries,
            walks,
            next: 0,
            starts: Vec::new(),
            reached: Vec::new(),
            returns: vec![0; rays.len()],
        }
    }

    /// Whether lanes can address all parts of an object: gathers need indices of words below 2^31.
    pub(crate) fn fits(object: &ObjectView<'_>) -> bool {
        const MAX_WORDS: usize = 1 << 31;
        object.records.len() < MAX_WORDS / 8
            && object.tet_vertices.len() < MAX_WORDS / 4
            && object.tet_faces.len() < MAX_WORDS / 8
    }

    /// Fills the empty queue with prepared rays, as far as there are any.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, s: S, queue: &mut ReadyQueue) {
        if self.reached.len() >= PENDING {
            self.test_reached_faces();
        }
        queue.rewind();
        while queue.has_space() {
            if self.starts.len() >= LANES || self.next >= self.faces.len() {
                if self.starts.is_empty() {
                    self.test_reached_faces();
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

    /// Prepares the last sixteen of `starts`. Rays that f32 cannot represent are walked in f64.
    #[inline(always)]
    fn fill_from_starts<S: Simd>(&mut self, s: S, queue: &mut ReadyQueue) {
        let first = self.starts.len().saturating_sub(LANES);
        let starts = &self.starts[first..];
        let valid = (1u32 << starts.len()) - 1;
        let mut columns = [[0; LANES]; 7];
        for (i, start) in starts.iter().enumerate() {
            let WalkStart { slot, tet, entered: Entered { face, apex, behind } } = *start;
            for (column, value) in
                columns.iter_mut().zip([slot, tet, apex, behind, face[0], face[1], face[2]])
            {
                column[i] = value;
            }
        }
        let slot = s.load_u(&columns[0]);
        let face = three!(|k| s.load_u(&columns[4 + k]));
        let mut ready = Ready::new(s, s.mask(valid), self.rays, vertices(self.object), slot, face);
        ready.lanes.words[word::TET] = s.load_u(&columns[1]);
        ready.lanes.words[word::APEX] = s.load_u(&columns[2]);
        ready.lanes.words[word::BEHIND] = s.load_u(&columns[3]);
        let able = s.mask_bits(ready.able);
        queue.push(s, able, &ready.lanes);
        let mut rest = valid & !able;
        if rest == 0 {
            return self.starts.truncate(first);
        }
        let starts = self.starts.split_off(first);
        while rest != 0 {
            let start = starts[rest.trailing_zeros() as usize];
            rest &= rest - 1;
            let line = self.line(start.slot);
            let corner =
                start.entered.face.map(|v| line.project(self.object.tet_vertices[v as usize].position));
            self.walk_alone(start.slot, TetPosition { tet: start.tet, entered: start.entered, corner });
        }
    }

    /// Prepares the next sixteen rays of the batch.
    #[inline(always)]
    fn fill_from_faces<S: Simd>(&mut self, s: S, queue: &mut ReadyQueue) {
        let first = self.next;
        let part = &self.faces[first..self.faces.len().min(first + LANES)];
        self.next += part.len();
        let mut row = [NONE; LANES];
        row[..part.len()].copy_from_slice(part);
        let row = s.load_u(&row);
        let valid = s.lt_u(row, s.splat_u(NONE));
        let mut rest = (1u32 << part.len()) - 1;
        let slot = s.load_u(&std::array::from_fn(|i| (first + i) as u32));
        if s.mask_bits(valid) == 0 {
            let leaf = self.leaves[first];
            if leaf != NONE && self.leaves[first..][..part.len()].iter().all(|&l| l == leaf) {
                rest = self.fill_from_outside(s, queue, s.mask(rest), slot, leaf);
            }
            return self.locate_all(first as u32, rest);
        }
        let faces = self.object.tet_faces;
        let (ready, able) = Ready::from_faces(s, valid, self.rays, vertices(self.object), faces, slot, row);
        let able = s.mask_bits(able);
        queue.push(s, able, &ready.lanes);
        rest &= !able;
        self.locate_all(first as u32, rest);
    }

    /// Prepares rays that all enter the same tet leaf from outside; returns the bits of those that f32 does not decide.
    #[inline(always)]
    fn fill_from_outside<S: Simd>(
        &mut self,
        s: S,
        queue: &mut ReadyQueue,
        m: S::M,
        slot: S::U,
        leaf: u32,
    ) -> u32 {
        let leaf = &self.object.tet_leaves[leaf as usize];
        let hull = &self.object.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize];
        let (ready, entered, missed) = Ready::from_hull(s, m, self.rays, vertices(self.object), hull, slot);
        let (entered, mut missed) = (s.mask_bits(entered), s.mask_bits(missed));
        queue.push(s, entered, &ready.lanes);
        let rest = s.mask_bits(m) & !entered & !missed;
        let mut slots = [0; LANES];
        s.store_u(slot, &mut slots);
        while missed != 0 {
            self.finish(slots[missed.trailing_zeros() as usize % LANES], WalkOutcome::Left);
            missed &= missed - 1;
        }
        rest
    }

    /// Locates in f64 the starts of the rays from `first` on whose bit is set.
    fn locate_all(&mut self, first: u32, mut bits: u32) {
        while bits != 0 {
            let slot = first + bits.trailing_zeros();
            bits &= bits - 1;
            if (self.faces[slot as usize] & self.leaves[slot as usize]) != NONE {
                self.locate(slot);
            }
        }
    }

    /// Locates in f64 the start of a ray: near its face, or where it enters its leaf.
    #[inline(never)]
    fn locate(&mut self, slot: u32) {
        let ray = &self.rays[slot as usize];
        let Some(line) = Line::new(ray) else { return };
        let space = self.space(slot, &line);
        let face = self.faces[slot as usize];
        // A walk from the origin finds hits with t >= 0 only.
        let located = if face != NONE && ray.tmin >= 0.0 { space.locate(face) } else { None };
        let position = match located {
            Some(position) => Ok(position),
            None if self.leaves[slot as usize] == NONE => return,
            None => space.enter_hull(),
        };
        match position {
            Ok(position) => {
                self.starts.push(WalkStart { slot, tet: position.tet, entered: position.entered });
            }
            Err(WalkOutcome::Uncertain) => self.flood(slot),
            Err(outcome) => self.finish(slot, outcome),
        }
    }
}

/// Vertices as rows of four words: x, y, z and one that is unused.
pub(super) fn vertices<'a>(object: &ObjectView<'a>) -> &'a [[f32; 4]] {
    <[[f32; 4]]>::ref_from_bytes(object.tet_vertices.as_bytes()).expect("a vertex is four words")
}
