//! What morph targets add to positions, by chunks of vertices.
//!
//! A target may move few vertices, and a file may have any number of targets that move none. The
//! deltas are therefore divided among the chunks once for each pose, so that a chunk visits only
//! targets that move some of its vertices: the time is linear in the number of deltas.

use bth_format::DeformationView;

/// Vertices that are computed together, in memory that stays in the first-level cache.
pub(super) const CHUNK: usize = 256;

/// The deltas of a target within a chunk; at least one.
#[derive(Clone, Copy, Debug)]
pub(super) struct MorphRun<'a> {
    weight: f64,
    /// The rows of positions, ascending; `None` where there is a delta for each row of the chunk.
    rows: Option<&'a [u32]>,
    deltas: &'a [[f32; 3]],
}

impl MorphRun<'_> {
    /// Adds the deltas by their weight to the positions of the chunk.
    #[inline(always)]
    pub(super) fn add_to(&self, positions: &mut [[f64; 4]]) {
        match self.rows {
            None => {
                for (position, delta) in positions.iter_mut().zip(self.deltas) {
                    add(position, self.weight, delta);
                }
            }
            Some(rows) => {
                for (row, delta) in rows.iter().zip(self.deltas) {
                    add(&mut positions[*row as usize % CHUNK], self.weight, delta);
                }
            }
        }
    }
}

#[inline(always)]
fn add(position: &mut [f64; 4], weight: f64, delta: &[f32; 3]) {
    for k in 0..3 {
        position[k] += weight * f64::from(delta[k]);
    }
}

/// The runs of all chunks of an object in a pose.
#[derive(Debug)]
pub(super) struct MorphRuns<'a> {
    /// Chunk after chunk, of each in the order of the targets.
    runs: Vec<MorphRun<'a>>,
    /// For each chunk where its runs end; empty without targets.
    ends: Vec<u32>,
}

impl<'a> MorphRuns<'a> {
    /// The runs of an object's targets whose weight is not 0.
    #[inline(never)]
    pub(super) fn new(deformation: &DeformationView<'a>, weights: &[f64], vertices: usize) -> Self {
        // How many runs chunks have, then where they begin, then, as they are filled, where they
        // end. Without targets no memory is needed.
        let mut ends = vec![0u32; if weights.is_empty() { 0 } else { vertices.div_ceil(CHUNK) }];
        each_run(deformation, weights, &mut |chunk, _| ends[chunk] += 1);
        let mut count = 0;
        for end in &mut ends {
            (*end, count) = (count, count + *end);
        }
        let mut runs = vec![MorphRun { weight: 0.0, rows: None, deltas: &[] }; count as usize];
        each_run(deformation, weights, &mut |chunk, run| {
            runs[ends[chunk] as usize] = run;
            ends[chunk] += 1;
        });
        MorphRuns { runs, ends }
    }

    /// The runs of a chunk.
    #[inline(always)]
    pub(super) fn of_chunk(&self, chunk: usize) -> &[MorphRun<'a>] {
        let Some(end) = self.ends.get(chunk) else { return &[] };
        let first = chunk.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.runs[first as usize..*end as usize]
    }
}

/// Passes on each run with its chunk. The runs of a chunk come in the order of the targets, which
/// fixes how sums are rounded.
fn each_run<'a>(
    deformation: &DeformationView<'a>,
    weights: &[f64],
    give: &mut dyn FnMut(usize, MorphRun<'a>),
) {
    for (target, &weight) in weights.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
        let morph = deformation.morph(target);
        let mut from = 0;
        while from < morph.deltas.len() {
            let (chunk, to) = match morph.rows {
                None => (from / CHUNK, morph.deltas.len().min(from + CHUNK)),
                Some(rows) => {
                    let chunk = rows[from] as usize / CHUNK;
                    (chunk, from + rows[from..].partition_point(|row| *row as usize / CHUNK == chunk))
                }
            };
            let rows = morph.rows.map(|rows| &rows[from..to]);
            give(chunk, MorphRun { weight, rows, deltas: &morph.deltas[from..to] });
            from = to;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_format::layout::{Deformation, Morph, NONE};

    /// A chunk visits the targets that move some of its vertices and no others, however many there
    /// are.
    #[test]
    fn chunks_have_runs_of_targets_that_move_their_vertices() {
        let vertices = 3 * CHUNK + 7;
        let morph = |deltas: usize, first_delta: u32, first_row: u32| Morph {
            deltas: deltas as u32,
            first_delta,
            first_row,
            reserved: 0,
        };
        // A target for every vertex, many for none, one for two chunks, and one whose weight is 0.
        let mut morphs = vec![morph(vertices, 0, NONE)];
        morphs.extend((0..1000).map(|_| morph(0, vertices as u32, 0)));
        morphs.extend([morph(3, 0, 0), morph(vertices, 0, NONE)]);
        let deltas = vec![[1.0; 3]; vertices];
        let rows = [5, CHUNK as u32 - 1, 3 * CHUNK as u32];
        let targets = morphs.len();
        let counts = [Deformation { joints: 0, influence_sets: 0, targets: targets as u32, reserved: 0 }];
        let view = DeformationView {
            rows: &counts,
            morphs: &morphs,
            morph_rows: &rows,
            deltas: &deltas,
            ..DeformationView::default()
        };
        let mut weights = vec![2.0; targets];
        weights[targets - 1] = 0.0;
        let runs = MorphRuns::new(&view, &weights, vertices);
        let deltas_of = |chunk: usize| -> Vec<usize> {
            runs.of_chunk(chunk).iter().map(|run| run.deltas.len()).collect()
        };
        let found: Vec<Vec<usize>> = (0..5).map(deltas_of).collect();
        assert_eq!(found, [vec![CHUNK, 2], vec![CHUNK], vec![CHUNK], vec![7, 1], vec![]]);
        assert!(MorphRuns::new(&DeformationView::default(), &[], vertices).of_chunk(0).is_empty());
    }
}
