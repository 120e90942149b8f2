//! Chooses the rays of a batch that are prepared next for the lanes: walks that return to them, or
//! the next rays of the batch.

use super::lanes::{three, word};
use super::queue::{PreparedQueue, PreparedWalks};
use super::walk::{Entered, TetPosition, WalkOutcome};
use super::walks::{WalkStart, Walks, vertices};
use crate::intersect::line::Line;
use crate::simd::{LANES, Part, Simd};

/// Fills the empty queue with prepared rays, until it is full or no rays are left but those that
/// reach a face which is not yet tested. It depends on no query, so it is compiled once per
/// instruction set.
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
            if walks.starts.len() < LANES && walks.next < walks.rays.len() {
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
    /// Prepares the last sixteen of `starts`, or all if there are fewer. Rays that f32 cannot
    /// represent are walked in f64.
    #[inline(always)]
    fn fill_from_starts<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
        let first = self.starts.len().saturating_sub(LANES);
        let starts = &self.starts[first..];
        let valid = (1u32 << starts.len()) - 1;
        let mut columns = [[0; LANES]; 6];
        for (i, start) in starts.iter().enumerate() {
            let WalkStart { ray, tet, entered: Entered { face, apex } } = *start;
            for (column, value) in columns.iter_mut().zip([ray, tet, apex, face[0], face[1], face[2]]) {
                column[i] = value;
            }
        }
        let ray = s.load_u(&columns[0]);
        let face = three!(|k| s.load_u(&columns[3 + k]));
        let mut prepared = PreparedWalks::new(s, s.mask(valid), self.rays, vertices(self.object), ray, face);
        prepared.lanes.words[word::TET] = s.load_u(&columns[1]);
        prepared.lanes.words[word::APEX] = s.load_u(&columns[2]);
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

    /// Prepares the next sixteen rays of the batch, or the last ones. Entries that f32 does not
    /// decide are found in f64.
    #[inline(always)]
    fn fill_from_batch<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue) {
        let first = self.next;
        let count = (self.rays.len() - first).min(LANES);
        self.next += count;
        let ray = s.load_u(&std::array::from_fn(|i| (first + i) as u32));
        let mut rest = self.fill_from_outside(s, queue, s.mask((1u32 << count) - 1), ray);
        while rest != 0 {
            self.enter_hull(first as u32 + rest.trailing_zeros());
            rest &= rest - 1;
        }
    }

    /// Prepares rays that enter the tet leaf from outside. Returns the bits of the rays that f32
    /// does not decide.
    #[inline(always)]
    fn fill_from_outside<S: Simd>(&mut self, s: S, queue: &mut PreparedQueue, m: S::M, ray: S::U) -> u32 {
        let leaf = &self.object.tet_leaves[self.leaf as usize];
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

    /// Finds in f64 where a ray enters the leaf.
    #[inline(never)]
    fn enter_hull(&mut self, ray: u32) {
        let Some(line) = Line::new(&self.rays[ray as usize]) else { return };
        match self.walker(&line).enter_hull() {
            Ok(position) => {
                self.starts.push(WalkStart { ray, tet: position.tet, entered: position.entered });
            }
            Err(WalkOutcome::Uncertain) => self.without_lanes.push((ray, None)),
            Err(outcome) => self.finish(ray, outcome),
        }
    }
}
