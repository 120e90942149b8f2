//! The charts of `speed`: ratios to Embree's single rays; where it did not run, rays per second.

use super::results::{SpeedResults, ThreadsRun};
use super::tables::sets_of;
use crate::chart::{BarChart, Scale, Series};
use crate::output::Chart;
use crate::rivals::embree;

/// The tracers that a chart has, if they were measured; the table has all. Embree's single rays are the line at 1.
const SHOWN: [&str; 8] = [
    "bth",
    "bth start",
    "bvh",
    "tets link32 start",
    "embree robust",
    "embree hq packet16",
    "tinybvh bvh8 hq",
    "obvhs cwbvh",
];

/// A chart for each number of threads, and one for each model if there are several.
pub fn draw(results: &SpeedResults) -> Vec<Chart> {
    let mut charts = Vec::new();
    for threads in results.threads() {
        let plural = if threads == 1 { "" } else { "s" };
        let on = format!("{threads} thread{plural}");
        let tracers = results.tracers(threads);
        let ratios = tracers.contains(&embree::NAME);
        let mut shown: Vec<&str> = tracers.iter().copied().filter(|t| SHOWN.contains(t)).collect();
        if shown.is_empty() {
            // None of these was selected: the first few tracers are shown instead.
            shown = tracers.into_iter().take(SHOWN.len()).collect();
        }
        if results.models.len() > 1 && ratios {
            let value = |tracer: &str, set: &str| Some(results.mean_ratio(threads, tracer, set)?.0);
            let title = format!("Means over {} models, {on}", results.models.len());
            let svg = chart(title, true, sets_of(results.models.iter()), &shown, value);
            charts.push(Chart { name: format!("means-{}", on.replace(' ', "-")), svg });
        }
        for model in &results.models {
            let Some(run) = model.runs.iter().find(|r| r.threads == threads) else { continue };
            let shown: Vec<&str> =
                shown.iter().copied().filter(|t| run.tracers.iter().any(|r| r.name == *t)).collect();
            let value = |tracer: &str, set: &str| figure(run, ratios, tracer, set);
            let title = format!("{}, {on}", model.name);
            let svg = chart(title, ratios, sets_of(std::iter::once(model)), &shown, value);
            charts.push(Chart { name: format!("{}-{}", model.name, on.replace(' ', "-")), svg });
        }
    }
    charts
}

fn figure(run: &ThreadsRun, ratios: bool, tracer: &str, set: &str) -> Option<f64> {
    if ratios {
        run.ratio(tracer, set)
    } else {
        run.tracers.iter().find(|t| t.name == tracer)?.mrays_per_s.get(set).copied()
    }
}

fn chart(
    title: String,
    ratios: bool,
    sets: Vec<&'static str>,
    tracers: &[&str],
    value: impl Fn(&str, &str) -> Option<f64>,
) -> String {
    let series = |tracer: &&str| Series {
        name: (*tracer).to_owned(),
        values: sets.iter().map(|set| value(tracer, set)).collect(),
    };
    let unit = if ratios { "rays per second over those of Embree's single rays" } else { "Mrays per second" };
    let chart = BarChart {
        title,
        unit: unit.to_owned(),
        series: tracers.iter().map(series).collect(),
        groups: sets.iter().map(|s| (*s).to_owned()).collect(),
        scale: Scale::Linear,
        line: ratios.then_some(1.0),
    };
    chart.svg()
}
