//! Fits the constants on some models and judges the estimators on others.

use super::record::{Constants, ESTIMATORS, Judged, Node, STARTS};
use super::statistics::{median_error, rank_correlation};
use crate::rounds::median;
use anyhow::{Context, Result};
use bth_compile::costs::{Walk, fit};

/// Sizes between which the cost of a step changes, bytes: of both kinds of rays those are taken that fit best.
const SIZES: [[f64; 4]; 2] = [[2.5e5, 5e5, 1e6, 2e6], [4e6, 8e6, 1.6e7, 3.2e7]];

/// Fits the constants.
///
/// # Errors
/// If the nodes are too few or too much alike.
pub fn constants(nodes: &[Node]) -> Result<Constants> {
    let fitted = || {
        let levels = |estimator: usize, start: usize| {
            let row = |n: &Node| ([1.0, n.estimates[estimator][start]], n.steps[start]);
            fit(&nodes.iter().map(row).collect::<Vec<_>>())
        };
        let area = |start: usize| {
            let row = |n: &Node| ([n.estimates[2][start]], n.steps[start]);
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

/// Costs of a walk, and the sizes with which they fit best.
fn best_walk(nodes: &[Node], start: usize) -> Option<([f64; 4], [f64; 2])> {
    let mut best: Option<(f64, [f64; 4], [f64; 2])> = None;
    for sizes in SIZES[0].iter().flat_map(|small| SIZES[1].map(|large| [*small, large])) {
        let Some(walk) = walk(nodes, sizes, start) else { continue };
        let off = |n: &Node| {
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
fn walk(nodes: &[Node], sizes: [f64; 2], start: usize) -> Option<[f64; 4]> {
    let row = |n: &Node| {
        let share = share(n.bytes, sizes);
        let steps = n.steps[start];
        ([1.0, n.hits[start], steps * (1.0 - share), steps * share], n.nanoseconds[start])
    };
    fit(&nodes.iter().map(row).collect::<Vec<_>>())
}

/// Where a size lies between two, 0 to 1, by its logarithm: as [`Walk::cost`] has it.
fn share(bytes: f64, sizes: [f64; 2]) -> f64 {
    ((bytes / sizes[0]).max(1.0).log2() / (sizes[1] / sizes[0]).log2()).clamp(0.0, 1.0)
}

impl Constants {
    /// Steps that an estimator predicts for a node.
    pub fn steps(&self, estimator: usize, start: usize, node: &Node) -> f64 {
        let said = node.estimates[estimator][start];
        match estimator {
            0 | 1 => {
                let [least, per_level] = self.levels[estimator][start];
                least + per_level * said
            }
            2 => self.area[start] * said,
            _ => said,
        }
    }

    /// Nanoseconds that an estimator predicts for a ray through a node.
    pub fn predict(&self, estimator: usize, start: usize, node: &Node) -> f64 {
        let hits = if estimator == 3 { node.sampled_hits[start] } else { self.hits[start] };
        self.nanoseconds(start, self.steps(estimator, start, node), hits, node.bytes)
    }

    /// Nanoseconds of a ray of so many steps, if such a share of rays ends at triangles.
    pub fn nanoseconds(&self, start: usize, steps: f64, hits: f64, bytes: f64) -> f64 {
        cost(self.walk[start], steps, hits, bytes, self.sizes[start])
    }
}

/// Judges every estimator, and the cost of a step by itself.
pub fn judge(constants: &Constants, nodes: &[Node]) -> Vec<Judged> {
    let mut judged = Vec::new();
    for (start, start_name) in STARTS.into_iter().enumerate() {
        for (row, name) in ESTIMATORS.iter().copied().chain(["measured steps"]).enumerate() {
            let exact = row == ESTIMATORS.len();
            let steps = |n: &Node| if exact { n.steps[start] } else { constants.steps(row, start, n) };
            let of_steps: Vec<(f64, f64)> = nodes.iter().map(|n| (steps(n), n.steps[start])).collect();
            let of_time: Vec<(f64, f64)> = nodes
                .iter()
                .map(|n| match exact {
                    true => constants.nanoseconds(start, n.steps[start], n.hits[start], n.bytes),
                    false => constants.predict(row, start, n),
                })
                .zip(nodes.iter().map(|n| n.nanoseconds[start]))
                .collect();
            let micros = if exact { None } else { median(nodes.iter().map(|n| n.micros[row]).collect()) };
            judged.push(Judged {
                name: name.to_owned(),
                start: start_name,
                micros: micros.unwrap_or(0.0),
                steps: [rank_correlation(&of_steps), median_error(&of_steps)],
                nanoseconds: [rank_correlation(&of_time), median_error(&of_time)],
            });
        }
    }
    judged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(triangles: u32, bytes: f64) -> Node {
        let levels = f64::from(triangles).log2() / 2.0;
        let steps = [3.0 + 4.0 * levels, 1.0 + 3.0 * levels];
        let share = share(bytes, [5e5, 8e6]);
        let hits = [0.5 + 0.01 * f64::from(triangles.ilog2() % 5); 2];
        Node {
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
        let nodes: Vec<Node> = (8..20).map(|i| node(1 << i, 1e5 * f64::from(1 << (i - 8)))).collect();
        let constants = constants(&nodes).unwrap();
        assert!((constants.area[0] - 1.25).abs() < 1e-9, "{constants:?}");
        for judged in judge(&constants, &nodes) {
            // Only two of them know how many rays end at triangles.
            let exact = ["sampling", "measured steps"].contains(&judged.name.as_str());
            assert!(judged.nanoseconds[0].unwrap() > 0.99, "{judged:?}");
            assert!(judged.nanoseconds[1].unwrap() < if exact { 1e-6 } else { 0.02 }, "{judged:?}");
        }
    }
}
