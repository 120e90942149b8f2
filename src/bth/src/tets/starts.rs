//! Which rays of a batch are prepared next for the lanes: walks that return to them, or the next rays of the batch, whose starts
//! are located.

use super::lanes::{three, word};
use super::queue::{PreparedQueue, PreparedWalks};
use super::records::Entered;
use super::walk::{TetPosition, WalkOutcome};
use super::walks::{WalkStart, Walks, vertices};
use crate::intersect::line::Line;
use crate::simd::{LANES, Part, Simd};
use bth_format::layout::NONE;

/// Fills the empty queue with prepared rays, until it is full or no rays are left but those that reach a face which is not yet
/// tested. It depends on no query, so it is compiled once per instruction set.
pub(super) struct Fill<'a, 'b> {
    pub(super) walks: &'a mut Walks<'b>,
    pub(super) queue: &'a mut PreparedQueue,
}

impl<S: Simd> Part<S> for Fill<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run(self, s: S) {
        let Fill { walks, queue } = self;
        queue.rewind();
        while queue.has_space() {
            if walks.starts.len() < LANES && walks.next < walks.faces.len() {
                walks.fill_from_batch(s, queue);
            } else if walks.starts.is_empty() {
                return;
            } else {
                walks.fill_from_starts(s, queue);
            }
        }
    }
}

impl Walks<'_> {
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
        while rest != 0 {
            let start = self.starts[first + rest.trailing_zeros() as usize];
            rest &= rest - 1;
            let line = self.line(start.ray);
            let corner =
                start.entered.face.map(|v| line.project(self.object.tet_vertices[v as usize].position));
            let position = TetPosition { tet: start.tet, entered: start.entered, corner };
            self.without_lanes.push((start.ray, Some(position)));
        }
        self.starts.truncate(first);
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
            if self.sole_leaf != NONE {
                rest = self.fill_from_outside(s, queue, s.mask(rest), ray);
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

    /// Prepares rays that enter the sole tet leaf from outside. Returns the bits of the rays that f32 does not decide.
    #[inline(always)]
    fn fill_from_outside<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue, m: S::M, ray: S::U) -> u32 {
        let leaf = &self.object.tet_leaves[self.sole_leaf as usize];
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
            if (self.faces[ray as usize] & self.sole_leaf) != NONE {
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
            None if self.sole_leaf == NONE => return,
            None => walker.enter_hull(),
        };
        match position {
            Ok(position) => {
                self.starts.push(WalkStart { ray, tet: position.tet, entered: position.entered });
            }
            Err(WalkOutcome::Uncertain) => self.without_lanes.push((ray, None)),
            Err(outcome) => self.finish(ray, outcome),
        }
    }
}
