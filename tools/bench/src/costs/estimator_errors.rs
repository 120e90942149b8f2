//! How well the estimators predict steps and times of nodes that were not fitted on.

use super::results::{Constants, ESTIMATORS, EstimatorError, MeasuredNode, STARTS};
use super::statistics::{median_error, rank_correlation};
use crate::rounds::median;

/// The errors of every estimator, and in the rows `measured steps` those of the cost of a step alone.
pub fn estimator_errors(constants: &Constants, nodes: &[MeasuredNode]) -> Vec<EstimatorError> {
    let mut errors = Vec::new();
    for (start, start_name) in STARTS.into_iter().enumerate() {
        for (row, name) in ESTIMATORS.iter().copied().chain(["measured steps"]).enumerate() {
            let exact = row == ESTIMATORS.len();
            let steps =
                |n: &MeasuredNode| if exact { n.steps[start] } else { constants.steps(row, start, n) };
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
            errors.push(EstimatorError {
                name: name.to_owned(),
                start: start_name,
                micros: micros.unwrap_or(0.0),
                steps: [rank_correlation(&of_steps), median_error(&of_steps)],
                nanoseconds: [rank_correlation(&of_time), median_error(&of_time)],
            });
        }
    }
    errors
}
