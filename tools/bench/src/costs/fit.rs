//! The constants of the cost model: fitted on measured nodes, and what they predict for others.

use super::results::{Constants, MeasuredNode};
use anyhow::{Context, Result};
use bth_compile::costs::{Walk, fit};

/// Candidates for the smaller and the larger size, in bytes, between which the cost of a step changes: for each kind of rays the
/// pair that fits best is taken.
const SIZES: [[f64; 4]; 2] = [[2.5e5, 5e5, 1e6, 2e6], [4e6, 8e6, 1.6e7, 3.2e7]];

/// Fits the constants.
///
/// # Errors
/// If the nodes are too few or too much alike.
pub fn constants(nodes: &[MeasuredNode]) -> Result<Constants> {
    let fitted = || {
        let levels = |estimator: usize, start: usize| {
            let row = |n: &MeasuredNode| ([1.0, n.estimates[estimator][start]], n.steps[start]);
            fit(&nodes.iter().map(row).collect::<Vec<_>>())
        };
        let area = |start: usize| {
            let row = |n: &MeasuredNode| ([n.estimates[2][start]], n.steps[start]);
            fit(&nodes.iter().map(row).collect::<Vec<_>>())
        };
        let mean =
            |start: usize| nodes.iter().map(|n| n.hits[start]).sum::<f64>() / nodes.len().max(1) as f64;
        let (outside, surface) = (best_walk(nodes, 0)?, best_walk(nodes, 1)?);
        Some(Constants {
            levels: [[levels(0, 0)?, levels(0, 1)?], [levels(1, 0)?, levels(1, 1)?]],
            area: [area(0)?[0], area(1)?[0]],
            walk: [outside.0, surface.0],
            hits: [mean(0), mean(1)],
            sizes: [outside.1, surface.1],
        })
    };
    fitted().context("too few nodes to fit constants on")
}

/// The pair of sizes that fits best, and the costs of a walk for it.
fn best_walk(nodes: &[MeasuredNode], start: usize) -> Option<([f64; 4], [f64; 2])> {
    let mut best: Option<(f64, [f64; 4], [f64; 2])> = None;
    for sizes in SIZES[0].iter().flat_map(|small| SIZES[1].map(|large| [*small, large])) {
        let Some(walk) = walk(nodes, sizes, start) else { continue };
        let off = |n: &MeasuredNode| {
            let predicted = cost(walk, n.steps[start], n.hits[start], n.bytes, sizes);
            (predicted / n.nanoseconds[start] - 1.0).powi(2)
        };
        let error = nodes.iter().map(off).sum::<f64>();
        if best.is_none_or(|b| error < b.0) {
            best = Some((error, walk, sizes));
        }
    }
    best.map(|(_, walk, sizes)| (walk, sizes))
}

fn cost([entry, hit, small, large]: [f64; 4], steps: f64, hits: f64, bytes: f64, sizes: [f64; 2]) -> f64 {
    Walk { entry, hit, step: [small, large] }.cost(steps, hits, bytes, sizes)
}

/// Costs of a walk, for these sizes.
fn walk(nodes: &[MeasuredNode], sizes: [f64; 2], start: usize) -> Option<[f64; 4]> {
    let row = |n: &MeasuredNode| {
        let share = share(n.bytes, sizes);
        let steps = n.steps[start];
        ([1.0, n.hits[start], steps * (1.0 - share), steps * share], n.nanoseconds[start])
    };
    fit(&nodes.iter().map(row).collect::<Vec<_>>())
}

/// Where a size lies between two others on a logarithmic scale, from 0 to 1, as in [`Walk::cost`].
fn share(bytes: f64, sizes: [f64; 2]) -> f64 {
    ((bytes / sizes[0]).max(1.0).log2() / (sizes[1] / sizes[0]).log2()).clamp(0.0, 1.0)
}

impl Constants {
    /// Steps that an estimator predicts for a node.
    pub fn steps(&self, estimator: usize, start: usize, node: &MeasuredNode) -> f64 {
        let estimate = node.estimates[estimator][start];
        match estimator {
            0 | 1 => {
                let [least, per_level] = self.levels[estimator][start];
                least + per_level * estimate
            }
            2 => self.area[start] * estimate,
            _ => estimate,
        }
    }

    /// Nanoseconds that an estimator predicts for a ray through a node.
    pub fn predict(&self, estimator: usize, start: usize, node: &MeasuredNode) -> f64 {
        let hits = if estimator == 3 { node.sampled_hits[start] } else { self.hits[start] };
        self.nanoseconds(start, self.steps(estimator, start, node), hits, node.bytes)
    }

    /// Nanoseconds of a ray of so many steps, if such a share of rays ends at triangles.
    pub fn nanoseconds(&self, start: usize, steps: f64, hits: f64, bytes: f64) -> f64 {
        cost(self.walk[start], steps, hits, bytes, self.sizes[start])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::costs::estimator_errors::estimator_errors;
    use crate::costs::results::ESTIMATORS;

    fn node(triangles: u32, bytes: f64) -> MeasuredNode {
        let levels = f64::from(triangles).log2() / 2.0;
        let steps = [3.0 + 4.0 * levels, 1.0 + 3.0 * levels];
        let share = share(bytes, [5e5, 8e6]);
        let hits = [0.5 + 0.01 * f64::from(triangles.ilog2() % 5); 2];
        MeasuredNode {
            model: "m".into(),
            node: triangles,
            triangles,
            bytes,
            steps,
            hits,
            sampled_hits: hits,
            nanoseconds: steps.map(|s| 40.0 + 20.0 * hits[0] + s * (2.0 + share)),
            estimates: [[levels; 2], [levels * 1.1; 2], steps.map(|s| s / 1.25), steps],
            micros: [1.0; ESTIMATORS.len()],
        }
    }

    #[test]
    fn constants_of_exact_nodes_predict_them() {
        let nodes: Vec<MeasuredNode> = (8..20).map(|i| node(1 << i, 1e5 * f64::from(1 << (i - 8)))).collect();
        let constants = constants(&nodes).unwrap();
        assert!((constants.area[0] - 1.25).abs() < 1e-9, "{constants:?}");
        for errors in estimator_errors(&constants, &nodes) {
            // Only these two have the share of rays that end at triangles.
            let exact = ["sampling", "measured steps"].contains(&errors.name.as_str());
            assert!(errors.nanoseconds[0].unwrap() > 0.99, "{errors:?}");
            assert!(errors.nanoseconds[1].unwrap() < if exact { 1e-6 } else { 0.02 }, "{errors:?}");
        }
    }
}
