//! Predicted and measured costs of the nodes that became tet leaves.

use super::Explained;
use crate::measure::{QueryKind, Rays, TimedRun, nanoseconds};
use bth_compile::costs::TetWalker;
use bth_compile::sampling::{SampleRay, from_surface};
use serde::Serialize;

/// Rays that start on each node.
const RAYS_PER_NODE: usize = 8192;
/// Rounds; the fastest counts.
const ROUNDS: usize = 7;

/// A tet leaf. Costs are nanoseconds per ray that starts on it; half of the rays are short.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct MeasuredNode {
    /// Index in the binary BVH.
    pub(crate) node: u32,
    /// Its triangles.
    pub(crate) triangles: u32,
    /// Mean steps of bounced rays: estimated before tetrahedralization, and counted.
    pub(crate) steps: [f64; 2],
    /// With the tetrahedra: predicted and measured.
    pub(crate) cost_tet: [f64; 2],
    /// Through the BVH alone: predicted and measured.
    pub(crate) cost_bvh: [f64; 2],
}

/// Measures the first `most` tet leaves; `None` if it was stopped.
pub(crate) fn measure(of: &Explained<'_>, most: usize, stop: impl Fn() -> bool) -> Option<Vec<MeasuredNode>> {
    let mut nodes = Vec::new();
    for (node, tets) in of.built.iter().take(most) {
        let at = &of.tree.nodes[*node as usize];
        let rows = at.first as usize..(at.first + at.count) as usize;
        let samples = from_surface(of.mesh, of.tree, rows, RAYS_PER_NODE, 41);
        let (long, short): (Vec<SampleRay>, Vec<SampleRay>) =
            samples.into_iter().partition(|ray| ray.tmax.is_infinite());
        let walker = TetWalker::new(tets);
        let walked: Vec<f64> =
            long.iter().filter_map(|ray| walker.walk(ray)).map(|w| f64::from(w.steps)).collect();
        let [long, short] = [long, short].map(|samples| Rays::new(&samples));
        let runs: [TimedRun<'_>; 4] = [
            (of.compiled, &long, QueryKind::Nearest),
            (of.compiled, &short, QueryKind::Any),
            (of.plain, &long, QueryKind::Nearest),
            (of.plain, &short, QueryKind::Any),
        ];
        let times = nanoseconds(&runs, ROUNDS, &stop)?;
        // Descendants that replaced a failed node have no prediction.
        let verdict = of.choice.verdicts.iter().find(|v| v.node == *node);
        let predicted = |value: fn(&bth_compile::costs::Verdict) -> f64| verdict.map_or(f64::NAN, value);
        nodes.push(MeasuredNode {
            node: *node,
            triangles: at.count,
            steps: [predicted(|v| v.n_avg), walked.iter().sum::<f64>() / walked.len().max(1) as f64],
            cost_tet: [predicted(|v| v.cost_tet), 0.5 * (times[0] + times[1])],
            cost_bvh: [predicted(|v| v.cost_bvh), 0.5 * (times[2] + times[3])],
        });
    }
    Some(nodes)
}
