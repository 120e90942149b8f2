//! How well the cost model predicts: the estimators' errors against measured steps and times, and by how much the rules' selections
//! are slower than the best ones.

mod estimator_errors;
mod fit;
mod nodes;
pub mod results;
mod selection_regret;
mod statistics;
mod tables;

pub use estimator_errors::estimator_errors;
pub use fit::constants;
#[cfg(test)]
pub(crate) use nodes::rays;
pub use tables::{charts, markdown};

use crate::args::Costs;
use crate::isa;
use crate::model::Model;
use crate::output::{Head, Report};
use crate::progress::Progress;
use anyhow::Result;
use nodes::NodeChoice;
use results::CostsResults;
use serde_json::json;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written.
pub fn run(arguments: &Costs) -> Result<()> {
    let results = measure(arguments)?;
    Report {
        head: &results.head,
        title: "The cost model against measurements",
        body: markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: charts(&results),
    }
    .write(&arguments.output)
}

/// Measures all models.
///
/// # Errors
/// If a model cannot be used.
pub fn measure(arguments: &Costs) -> Result<CostsResults> {
    let isa = isa::select(arguments.isa.as_deref())?;
    let which = NodeChoice {
        least: arguments.least,
        most: arguments.most,
        nodes: arguments.nodes,
        rounds: arguments.rounds,
    };
    let fit_nodes = arguments.fit_nodes.unwrap_or(which.nodes);
    let options = json!({
        "least": which.least,
        "most": which.most,
        "nodes": which.nodes,
        "fit_nodes": fit_nodes,
        "rounds": which.rounds,
    });
    let progress = Progress::new();
    let all = |models: &[String], nodes: usize| -> Result<(Vec<String>, Vec<nodes::Candidate>)> {
        let (mut names, mut found) = (Vec::new(), Vec::new());
        for name in models {
            let model = Model::load(name)?;
            found.extend(nodes::candidates(&model, &NodeChoice { nodes, ..which }, &progress)?);
            names.push(model.name);
        }
        Ok((names, found))
    };
    let (fitted_on, mut candidates) = all(&arguments.fit, fit_nodes)?;
    let (judged_on, others) = all(&arguments.models, which.nodes)?;
    let fitted = candidates.len();
    candidates.extend(others);
    let mut fitted_nodes = nodes::time(candidates, which.rounds, &progress);
    let judged_nodes = fitted_nodes.split_off(fitted);
    let fitted = fitted_nodes;
    let constants = constants(&fitted)?;
    let mut regrets = Vec::new();
    for name in &arguments.small {
        regrets.push(selection_regret::measure(&Model::load(name)?, arguments.rounds, &progress)?);
    }
    Ok(CostsResults {
        head: Head::now("costs", isa, options),
        fitted_on,
        judged_on,
        constants,
        judged: estimator_errors(&constants, &judged_nodes),
        regrets,
        fitted,
        nodes: judged_nodes,
    })
}
