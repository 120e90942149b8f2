//! Renders the views of a model with all structures in turn, on all threads.

use super::results::StructureRow;
use super::views::{THREAD_TILE, Views};
use crate::clock::process_cpu;
use crate::rounds::least;
use crate::tracer::{Batch, Tracer, spread};
use bth::rays::Hit;

/// A structure that is ready to render.
pub(super) struct BuiltStructure {
    /// Its name in the tables.
    pub(super) name: &'static str,
    pub(super) tracer: Box<dyn Tracer>,
    /// Wall-clock seconds to construct it on one thread.
    pub(super) seconds: f64,
    /// Bytes that traversal reads.
    pub(super) bytes: u64,
    /// Share of the triangles in tetrahedra.
    pub(super) in_tets: f64,
    /// Leaves that are tetrahedralizations.
    pub(super) leaves: usize,
}

/// What all structures of a model render, and how.
pub(super) struct Rendering<'a> {
    pub(super) views: &'a Views,
    /// Rounds of which the fastest counts.
    pub(super) rounds: usize,
    pub(super) threads: usize,
}

impl Rendering<'_> {
    /// A row for each structure; `progress` is called with the name of each view before it is rendered.
    pub(super) fn rows(&self, built: &[BuiltStructure], progress: impl Fn(&str)) -> Vec<StructureRow> {
        let mut rows: Vec<StructureRow> = built
            .iter()
            .map(|b| StructureRow {
                structure: b.name.to_owned(),
                construction: b.seconds,
                milliseconds: [0.0; 2],
                differ: [0; 2],
                bytes: b.bytes,
                in_tets: b.in_tets,
                leaves: b.leaves,
            })
            .collect();
        for (view, name) in ["far", "close"].into_iter().enumerate() {
            progress(name);
            let (seconds, differ) = self.render(built, view);
            for (row, (seconds, differ)) in rows.iter_mut().zip(seconds.into_iter().zip(differ)) {
                row.milliseconds[view] = 1e3 * seconds.unwrap_or(0.0);
                row.differ[view] = differ;
            }
        }
        rows
    }

    /// The fastest seconds of each structure, and how many pixels hit where they should miss or the other way round.
    fn render(&self, built: &[BuiltStructure], view: usize) -> (Vec<Option<f64>>, Vec<usize>) {
        let rays = &self.views.rays[view];
        let structures: Vec<usize> = (0..built.len()).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        let mut differ = vec![0; built.len()];
        let seconds = least(&structures, self.rounds, |round, &structure| {
            let batch = Batch { rays, starts: None, coherent: true };
            let trace = |b: Batch<'_>, h: &mut [Hit]| built[structure].tracer.nearest(b, h);
            // CPU time, as other jobs may take turns on the same cores.
            let before = process_cpu();
            spread(batch, &mut hits, self.threads, (THREAD_TILE * THREAD_TILE) as usize, trace);
            let seconds = (process_cpu() - before) / self.threads as f64;
            if round == 0 {
                let expected = hits.iter().zip(&self.views.expected[view]);
                differ[structure] = expected.filter(|(hit, expected)| hit.is_hit() != **expected).count();
            }
            Some(seconds)
        });
        (seconds, differ)
    }
}
