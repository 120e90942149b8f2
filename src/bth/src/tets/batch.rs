//! Tet walks of a batch of rays, in one or several tet leaves: the state of the batch, and the choice of the rays that are
//! prepared next.
//!
//! The kernel is in [`super::rounds`]; the decisions that its f32 lanes leave open are made in [`super::decide`].

use super::lanes::{three, word};
use super::queue::{PreparedQueue, PreparedWalks};
use super::records::{Entered, LaneRecords};
use super::walk::{TetPosition, WalkOutcome};
use crate::intersect::line::Line;
use crate::query::Query;
use crate::rays::Ray;
use crate::simd::{LANES, Simd};
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use zerocopy::{FromBytes, IntoBytes};

/// When this many faces have been reached, they are tested together in f64.
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
    pub(super) ray: u32,
    pub(super) tet: u32,
    /// The line certainly crosses the entered face, whose corners are counterclockwise as seen along the ray.
    pub(super) entered: Entered,
}

/// A constrained face that a ray's line certainly crosses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reached {
    /// Index of the ray in the batch.
    pub(super) ray: u32,
    /// Index of the face in the object's constrained faces.
    pub(super) face: u32,
}

/// The rays of a batch and where their walks begin, as in the fields of [`WalkBatch`].
pub(crate) struct WalkRays<'a> {
    pub(crate) rays: &'a [Ray],
    pub(crate) faces: &'a [u32],
    pub(crate) leaves: &'a [u32],
}

/// A batch of rays with the starts and the states of their walks. All slices have one element per ray.
pub(crate) struct WalkBatch<'a, Q> {
    pub(super) object: &'a ObjectView<'a>,
    pub(super) records: LaneRecords<'a>,
    /// The rays, in object space.
    pub(super) rays: &'a [Ray],
    /// For each ray the constrained face near which it starts, or [`NONE`].
    pub(super) faces: &'a [u32],
    /// For each ray the tet leaf that it enters from outside if it does not start near a face, or [`NONE`].
    pub(super) leaves: &'a [u32],
    /// For each ray its query, which receives the hits.
    pub(super) queries: &'a mut [Q],
    /// For each ray the state of its walk.
    pub(super) walks: &'a mut [WalkState],
    /// Index of the first ray that is not yet prepared.
    next: usize,
    /// Located starts of walks, and walks that return to the lanes, which are not yet prepared.
    pub(super) starts: Vec<WalkStart>,
    /// Faces that lanes have reached and that are not yet tested.
    pub(super) reached: Vec<Reached>,
    /// For each ray the number of times that it has returned to the lanes.
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

    /// Whether lanes can address the tetrahedra of an object: gathers need indices of words below 2^31.
    pub(crate) fn fits(object: &ObjectView<'_>) -> bool {
        const MAX_WORDS: usize = 1 << 31;
        object.records.len() < MAX_WORDS / 8
            && object.tet_vertices.len() < MAX_WORDS / 4
            && object.tet_faces.len() < MAX_WORDS / 8
    }

    /// Fills the empty queue with prepared rays, until it is full or no rays are left.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
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
                self.fill_from_batch(s, queue);
            }
        }
    }

    /// Prepares the last sixteen of `starts`, or all if there are fewer. Rays that f32 cannot represent are walked in f64.
    #[inline(always)]
    fn fill_from_starts<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
        let first = self.starts.len().saturating_sub(LANES);
        let starts = &self.starts[first..];
        let valid = (1u32 << starts.len()) - 1;
        let mut columns = [[0; LANES]; 7];
        for (i, start) in starts.iter().enumerate() {
            let WalkStart { ray, tet, entered: Entered { face, apex, behind } } = *start;
            for (column, value) in columns.iter_mut().zip([ray, tet, apex, behind, face[0], face[1], face[2]])
            {
                column[i] = value;
            }
        }
        let ray = s.load_u(&columns[0]);
        let face = three!(|k| s.load_u(&columns[4 + k]));
        let mut prepared = PreparedWalks::new(s, s.mask(valid), self.rays, vertices(self.object), ray, face);
        prepared.lanes.words[word::TET] = s.load_u(&columns[1]);
        prepared.lanes.words[word::APEX] = s.load_u(&columns[2]);
        prepared.lanes.words[word::BEHIND] = s.load_u(&columns[3]);
        let representable = s.mask_bits(prepared.representable);
        queue.push(s, representable, &prepared.lanes);
        let mut rest = valid & !representable;
        if rest == 0 {
            return self.starts.truncate(first);
        }
        let starts = self.starts.split_off(first);
        while rest != 0 {
            let start = starts[rest.trailing_zeros() as usize];
            rest &= rest - 1;
            let line = self.line(start.ray);
            let corner =
                start.entered.face.map(|v| line.project(self.object.tet_vertices[v as usize].position));
            self.walk_in_f64(start.ray, TetPosition { tet: start.tet, entered: start.entered, corner });
        }
    }

    /// Prepares the next sixteen rays of the batch, or the last ones. Starts that f32 does not decide are located in f64.
    #[inline(always)]
    fn fill_from_batch<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
        let first = self.next;
        let part = &self.faces[first..self.faces.len().min(first + LANES)];
        self.next += part.len();
        let mut face = [NONE; LANES];
        face[..part.len()].copy_from_slice(part);
        let face = s.load_u(&face);
        let valid = s.lt_u(face, s.splat_u(NONE));
        let mut rest = (1u32 << part.len()) - 1;
        let ray = s.load_u(&std::array::from_fn(|i| (first + i) as u32));
        if s.mask_bits(valid) == 0 {
            let leaf = self.leaves[first];
            if leaf != NONE && self.leaves[first..][..part.len()].iter().all(|&l| l == leaf) {
                rest = self.fill_from_outside(s, queue, s.mask(rest), ray, leaf);
            }
            return self.locate_all(first as u32, rest);
        }
        let faces = self.object.tet_faces;
        let (prepared, representable) =
            PreparedWalks::from_faces(s, valid, self.rays, vertices(self.object), faces, ray, face);
        let representable = s.mask_bits(representable);
        queue.push(s, representable, &prepared.lanes);
        rest &= !representable;
        self.locate_all(first as u32, rest);
    }

    /// Prepares rays that all enter the same tet leaf from outside. Returns the bits of the rays that f32 does not decide.
    #[inline(always)]
    fn fill_from_outside<S: Simd>(
        &mut self,
        s: S,
        queue: &mut PreparedQueue,
        m: S::M,
        ray: S::U,
        leaf: u32,
    ) -> u32 {
        let leaf = &self.object.tet_leaves[leaf as usize];
        let hull = &self.object.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize];
        let (prepared, entered, missed) =
            PreparedWalks::from_hull(s, m, self.rays, vertices(self.object), hull, ray);
        let (entered, mut missed) = (s.mask_bits(entered), s.mask_bits(missed));
        queue.push(s, entered, &prepared.lanes);
        let rest = s.mask_bits(m) & !entered & !missed;
        let mut ray_indices = [0; LANES];
        s.store_u(ray, &mut ray_indices);
        while missed != 0 {
            self.finish(ray_indices[missed.trailing_zeros() as usize % LANES], WalkOutcome::Left);
            missed &= missed - 1;
        }
        rest
    }

    /// Locates in f64 the starts of the rays `first + i` for which bit i is set.
    fn locate_all(&mut self, first: u32, mut bits: u32) {
        while bits != 0 {
            let ray = first + bits.trailing_zeros();
            bits &= bits - 1;
            if (self.faces[ray as usize] & self.leaves[ray as usize]) != NONE {
                self.locate(ray);
            }
        }
    }

    /// Locates in f64 the start of a ray's walk: near its face, or where the ray enters its leaf.
    #[inline(never)]
    fn locate(&mut self, ray: u32) {
        let object_ray = &self.rays[ray as usize];
        let Some(line) = Line::new(object_ray) else { return };
        let walker = self.walker(ray, &line);
        let face = self.faces[ray as usize];
        // A walk from the origin would miss hits with t < 0.
        let located = if face != NONE && object_ray.tmin >= 0.0 { walker.locate(face) } else { None };
        let position = match located {
            Some(position) => Ok(position),
            None if self.leaves[ray as usize] == NONE => return,
            None => walker.enter_hull(),
        };
        match position {
            Ok(position) => {
                self.starts.push(WalkStart { ray, tet: position.tet, entered: position.entered });
            }
            Err(WalkOutcome::Uncertain) => self.flood(ray),
            Err(outcome) => self.finish(ray, outcome),
        }
    }
}

/// The object's tet vertices as rows of four words: x, y, z and an unused word.
pub(super) fn vertices<'a>(object: &ObjectView<'a>) -> &'a [[f32; 4]] {
    <[[f32; 4]]>::ref_from_bytes(object.tet_vertices.as_bytes()).expect("a vertex is four words")
}
