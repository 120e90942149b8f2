//! The tables and plots of `costs`.

use super::record::{CostsRecord, ESTIMATORS, Node, STARTS};
use crate::markdown::{count, table};
use crate::output::Chart;
use crate::scatter::{Cloud, Scatter};

fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|c| (*c).to_owned()).collect()
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.digits$}"))
}

fn percent(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| format!("{:.1} %", 100.0 * v))
}

/// The page below its head.
pub fn markdown(record: &CostsRecord) -> String {
    let mut text = format!(
        "Constants fitted on {} ({} nodes), estimators judged on {} ({} nodes). Each node is an object of its own, whole in \
         tetrahedra (Link32), traced in batches; steps and times are means over 8,192 rays. Rank correlation is Spearman's, \
         errors are medians of relative errors.\n\n## Estimators\n\n",
        record.fitted_on.join(", "),
        record.fitted.len(),
        record.judged_on.join(", "),
        record.nodes.len(),
    );
    let head =
        row(&["estimator", "rays from", "µs a node", "steps: rank", "steps: error", "ns: rank", "ns: error"]);
    let rows: Vec<Vec<String>> = record
        .judged
        .iter()
        .map(|j| {
            vec![
                j.name.clone(),
                j.start.to_owned(),
                if j.micros > 0.0 { format!("{:.2}", j.micros) } else { "-".to_owned() },
                number(j.steps[0], 3),
                percent(j.steps[1]),
                number(j.nanoseconds[0], 3),
                percent(j.nanoseconds[1]),
            ]
        })
        .collect();
    text.push_str(&table(&head, &rows));
    text.push_str("\n## Constants\n\n");
    let c = &record.constants;
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
    let head = row(&["rays from", "steps by face count", "by average depth", "factor of the area", "ns"]);
    text.push_str(&table(&head, &rows));
    text.push_str(
        "\nSizes are those of the tetrahedra and their vertices; in between what the logarithm of the size says.\n",
    );
    if !record.regrets.is_empty() {
        text.push_str(
            "\n## Regret\n\nEvery selection of the suitable nodes in the three topmost levels of small models was measured: \
             a quarter camera rays, the others bounces and ambient occlusion with hints.\n\n",
        );
        let head = row(&["model", "triangles", "tried", "selection", "tet leaves", "ns a ray", "regret"]);
        let rows: Vec<Vec<String>> = record
            .regrets
            .iter()
            .flat_map(|r| {
                r.selections.iter().map(|s| {
                    vec![
                        r.model.clone(),
                        count(r.triangles as u64),
                        r.tried.to_string(),
                        s.name.clone(),
                        s.nodes.len().to_string(),
                        format!("{:.1}", s.nanoseconds),
                        percent(Some(s.regret)),
                    ]
                })
            })
            .collect();
        text.push_str(&table(&head, &rows));
        for name in ["default", "paper's rule", "plain BVH"] {
            let of = record.regrets.iter().flat_map(|r| &r.selections).filter(|s| s.name == name);
            let regrets: Vec<f64> = of.map(|s| s.regret).collect();
            if !regrets.is_empty() {
                let mean = regrets.iter().sum::<f64>() / regrets.len() as f64;
                text.push_str(&format!("\n- Mean regret of {name}: {:.1} %.", 100.0 * mean));
            }
        }
        text.push('\n');
    }
    text
}

/// Predicted against measured nanoseconds of each estimator, and error against run time.
pub fn charts(record: &CostsRecord) -> Vec<Chart> {
    let mut charts = Vec::new();
    for (start, start_name) in STARTS.iter().enumerate() {
        let predicted = |e: usize, n: &Node| record.constants.predict(e, start, n);
        let cloud = |e: usize| Cloud {
            name: ESTIMATORS[e].to_owned(),
            points: record.nodes.iter().map(|n| (n.nanoseconds[start], predicted(e, n))).collect(),
            labels: Vec::new(),
        };
        let scatter = Scatter {
            title: format!("Predicted against measured, rays from {start_name}"),
            x: "measured ns a ray".to_owned(),
            y: "predicted ns a ray".to_owned(),
            clouds: (0..ESTIMATORS.len()).map(cloud).collect(),
            diagonal: true,
            front: false,
            radius: 2.5,
        };
        charts.push(Chart { name: format!("scatter-{start_name}"), svg: scatter.svg() });
    }
    let judged = |e: &'static str| {
        record.judged.iter().filter(move |j| j.name == e).filter_map(|j| Some((j.micros, j.nanoseconds[1]?)))
    };
    let pareto = Scatter {
        title: "Error against run time".to_owned(),
        x: "µs a node".to_owned(),
        y: "median relative error of ns".to_owned(),
        clouds: ESTIMATORS
            .iter()
            .map(|e| Cloud { name: (*e).to_owned(), points: judged(e).collect(), labels: Vec::new() })
            .collect(),
        diagonal: false,
        front: false,
        radius: 6.0,
    };
    charts.push(Chart { name: "pareto".to_owned(), svg: pareto.svg() });
    charts
}
