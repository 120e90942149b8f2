//! Tables and charts of `load`.

use super::results::{LoadResults, ModelStarts};
use crate::chart::{BarChart, Scale, Series};
use crate::markdown::{cells, count, seconds, table};
use crate::output::Chart;
use crate::rivals::embree;

/// What the summary and the charts show.
const SHOWN: [&str; 5] = ["bth map warm", "bth map cold", "bth read warm", "bth read cold", "bvh map warm"];

pub(super) fn on_threads(threads: usize) -> String {
    format!("{threads} thread{}", if threads == 1 { "" } else { "s" })
}

fn threads(results: &LoadResults) -> Vec<usize> {
    results.models.first().map_or(Vec::new(), |m| m.runs.iter().map(|r| r.threads).collect())
}

/// All tables of a report.
pub fn markdown(results: &LoadResults) -> String {
    let mut text = format!(
        "Wall-clock time from before the file is opened, or from before the build begins with the triangles in memory, \
         until the first {} camera rays are traced, each in a process of its own; medians of interleaved rounds. \
         `map`: mapped; `read`: read and checked; `cold`: the file's pages were dropped from memory first.\n\n",
        count(results.rays as u64)
    );
    for threads in threads(results) {
        text.push_str(&summary(results, threads));
    }
    for model in &results.models {
        text.push_str(&page(model));
    }
    text
}

pub(super) fn factor(value: Option<f64>) -> String {
    match value {
        None => "-".to_owned(),
        Some(v) if v >= 10.0 => format!("{v:.0}×"),
        Some(v) => format!("{v:.1}×"),
    }
}

fn summary(results: &LoadResults, threads: usize) -> String {
    let mut head = cells(&["model", "triangles", "Embree"]);
    head.extend(cells(&SHOWN));
    let mut rows = Vec::new();
    for model in &results.models {
        let Some(run) = model.runs.iter().find(|r| r.threads == threads) else { continue };
        let base = run.starts.iter().find(|(name, _)| name == embree::NAME).map(|(_, t)| t.total_s);
        let mut cells = vec![model.name.clone(), count(model.triangles as u64), seconds(base)];
        cells.extend(SHOWN.iter().map(|name| factor(run.faster(name))));
        rows.push(cells);
    }
    format!("## Times faster than Embree's build, {}\n\n{}\n", on_threads(threads), table(&head, &rows))
}

fn page(model: &ModelStarts) -> String {
    let sizes: Vec<String> = model
        .file_bytes
        .iter()
        .map(|(name, bytes)| format!("{name} {:.1} MiB", *bytes as f64 / 1048576.0))
        .collect();
    let mut text = format!(
        "## {} ({} triangles)\n\nFiles: {}.\n\n",
        model.name,
        count(model.triangles as u64),
        sizes.join(", ")
    );
    let head =
        cells(&["start", "ready", "first hit", "all rays", "CPU", "than Embree's build", "MiB from storage"]);
    for run in &model.runs {
        let mut rows = Vec::new();
        for (name, times) in &run.starts {
            rows.push(vec![
                name.clone(),
                seconds(Some(times.ready_s)),
                seconds(Some(times.first_hit_s)),
                seconds(Some(times.total_s)),
                seconds(Some(times.cpu_s)),
                factor(run.faster(name)),
                times.storage_bytes.map_or("?".to_owned(), |b| format!("{:.1}", b as f64 / 1048576.0)),
            ]);
        }
        text.push_str(&format!("{}:\n\n{}\n", on_threads(run.threads), table(&head, &rows)));
        if run.starts.iter().any(|(n, t)| n.ends_with("cold") && t.storage_bytes == Some(0)) {
            text.push_str("Cold starts read nothing from storage: the folder is in memory, or the system kept the pages.\n\n");
        }
    }
    for (name, why) in &model.left_out {
        text.push_str(&format!("- {name}: not measured: {why}\n\n"));
    }
    text
}

/// A chart for each number of threads; none where Embree did not run.
pub fn draw(results: &LoadResults) -> Vec<Chart> {
    let mut charts = Vec::new();
    for threads in threads(results) {
        let runs: Vec<_> = results
            .models
            .iter()
            .filter_map(|m| Some((&m.name, m.runs.iter().find(|r| r.threads == threads)?)))
            .filter(|(_, run)| run.faster(embree::NAME).is_some())
            .collect();
        if runs.is_empty() {
            continue;
        }
        let series = |name: &&str| Series {
            name: (*name).to_owned(),
            values: runs.iter().map(|(_, run)| run.faster(name)).collect(),
        };
        let chart = BarChart {
            title: format!("Load against rebuild, {}", on_threads(threads)),
            unit: format!(
                "times faster than Embree's build, first {} rays included; logarithmic",
                count(results.rays as u64)
            ),
            groups: runs.iter().map(|(name, _)| (*name).clone()).collect(),
            series: SHOWN.iter().map(series).collect(),
            scale: Scale::Logarithmic,
            line: Some(1.0),
        };
        charts.push(Chart { name: on_threads(threads).replace(' ', "-"), svg: chart.svg() });
    }
    charts
}
