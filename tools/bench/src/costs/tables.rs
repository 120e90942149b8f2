//! The tables and plots of `costs`.

use super::results::{
    Constants, CostsResults, ESTIMATORS, EstimatorError, MeasuredNode, Regret, STARTS, Selection,
};
use crate::markdown::{cells, count, table};
use crate::output::Chart;
use crate::scatter::{PointSeries, Scatter};

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.digits$}"))
}

fn percent(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| format!("{:.1} %", 100.0 * v))
}

/// The page below its head.
pub fn markdown(results: &CostsResults) -> String {
    let mut text = format!(
        "Constants fitted on {} ({} nodes), estimators judged on {} ({} nodes). Each node is an object of its own, whole in \
         tetrahedra (Link32), traced in batches; steps and times are means over 8,192 rays. Rank correlation is Spearman's, \
         errors are medians of relative errors.\n\n## Estimators\n\n",
        results.fitted_on.join(", "),
        results.fitted.len(),
        results.judged_on.join(", "),
        results.nodes.len(),
    );
    text.push_str(&estimators(results));
    text.push_str("\n## Constants\n\n");
    text.push_str(&constants(&results.constants));
    text.push_str(
        "\nSizes are those of the tetrahedra and their vertices; in between what the logarithm of the size says.\n",
    );
    if !results.regrets.is_empty() {
        text.push_str(
            "\n## Regret\n\nEvery selection of the suitable nodes in the three topmost levels of small models was measured: \
             a quarter camera rays, the others bounces and ambient occlusion.\n\n",
        );
        text.push_str(&regrets(&results.regrets));
    }
    text
}

/// How well each estimator predicts.
fn estimators(results: &CostsResults) -> String {
    let head = cells(&[
        "estimator",
        "rays from",
        "µs a node",
        "steps: rank",
        "steps: error",
        "ns: rank",
        "ns: error",
    ]);
    let cells = |j: &EstimatorError| {
        vec![
            j.name.clone(),
            j.start.to_owned(),
            if j.micros > 0.0 { format!("{:.2}", j.micros) } else { "-".to_owned() },
            number(j.steps[0], 3),
            percent(j.steps[1]),
            number(j.nanoseconds[0], 3),
            percent(j.nanoseconds[1]),
        ]
    };
    table(&head, &results.judged.iter().map(cells).collect::<Vec<_>>())
}

/// The fitted constants, a row for each place where rays start.
fn constants(c: &Constants) -> String {
    let mut rows = Vec::new();
    for (start, name) in STARTS.iter().enumerate() {
        let levels =
            |e: usize| format!("{:.2} + {:.2} a level", c.levels[e][start][0], c.levels[e][start][1]);
        let [entry, hit, small, large] = c.walk[start];
        rows.push(vec![
            (*name).to_owned(),
            levels(0),
            levels(1),
            format!("{:.3}", c.area[start]),
            format!(
                "{entry:.1} + {hit:.1} for a hit + {small:.2} a step up to {:.2} MB, {large:.2} from {:.0} MB on",
                c.sizes[start][0] / 1e6,
                c.sizes[start][1] / 1e6
            ),
        ]);
    }
    let head = cells(&["rays from", "steps by face count", "by average depth", "factor of the area", "ns"]);
    table(&head, &rows)
}

/// The selections of each small model, and the mean regret of each rule.
fn regrets(regrets: &[Regret]) -> String {
    let head = cells(&["model", "triangles", "tried", "selection", "tet leaves", "ns a ray", "regret"]);
    let cells = |r: &Regret, s: &Selection| {
        vec![
            r.model.clone(),
            count(r.triangles as u64),
            r.tried.to_string(),
            s.name.clone(),
            s.nodes.len().to_string(),
            format!("{:.1}", s.nanoseconds),
            percent(Some(s.regret)),
        ]
    };
    let selections = regrets.iter().flat_map(|r| r.selections.iter().map(move |s| (r, s)));
    let mut text = table(&head, &selections.map(|(r, s)| cells(r, s)).collect::<Vec<_>>());
    for name in ["default", "paper's rule", "plain BVH"] {
        let of = regrets.iter().flat_map(|r| &r.selections).filter(|s| s.name == name);
        let values: Vec<f64> = of.map(|s| s.regret).collect();
        if !values.is_empty() {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            text.push_str(&format!("\n- Mean regret of {name}: {:.1} %.", 100.0 * mean));
        }
    }
    text.push('\n');
    text
}

/// Predicted against measured nanoseconds of each estimator, and error against run time.
pub fn charts(results: &CostsResults) -> Vec<Chart> {
    let mut charts = Vec::new();
    for (start, start_name) in STARTS.iter().enumerate() {
        let predicted = |e: usize, n: &MeasuredNode| results.constants.predict(e, start, n);
        let cloud = |e: usize| PointSeries {
            name: ESTIMATORS[e].to_owned(),
            points: results.nodes.iter().map(|n| (n.nanoseconds[start], predicted(e, n))).collect(),
            labels: Vec::new(),
        };
        let scatter = Scatter {
            title: format!("Predicted against measured, rays from {start_name}"),
            x: "measured ns a ray".to_owned(),
            y: "predicted ns a ray".to_owned(),
            series: (0..ESTIMATORS.len()).map(cloud).collect(),
            diagonal: true,
            front: false,
            radius: 2.5,
        };
        charts.push(Chart { name: format!("scatter-{start_name}"), svg: scatter.svg() });
    }
    let judged = |e: &'static str| {
        results.judged.iter().filter(move |j| j.name == e).filter_map(|j| Some((j.micros, j.nanoseconds[1]?)))
    };
    let pareto = Scatter {
        title: "Error against run time".to_owned(),
        x: "µs a node".to_owned(),
        y: "median relative error of ns".to_owned(),
        series: ESTIMATORS
            .iter()
            .map(|e| PointSeries { name: (*e).to_owned(), points: judged(e).collect(), labels: Vec::new() })
            .collect(),
        diagonal: false,
        front: false,
        radius: 6.0,
    };
    charts.push(Chart { name: "pareto".to_owned(), svg: pareto.svg() });
    charts
}
