//! The tables of `accuracy`.

use super::defects::Defects;
use super::results::{AccuracyResults, Errors, ModelErrors, ORDINARY, TracerSummary};
use crate::markdown::{cells, count, table};

/// All tables of a report.
pub fn markdown(results: &AccuracyResults) -> String {
    let mut text = String::from(LEGEND);
    if results.models.len() > 1 {
        text.push_str(&summary(results));
    }
    for model in &results.models {
        text.push_str(&page(model));
    }
    text
}

const LEGEND: &str = "\
*ns*: CPU nanoseconds a ray for the nearest hit, geometric mean over `primary`, `diffuse-beside` and `random` rays; *aimed*: over \
rays that pass exactly through vertices and middles of edges, as the errors per million of them. *Missed*: nothing was \
found though something is hit; *leaked*: the nearest triangle was passed through, one behind it was found; *ghost*: a \
triangle that the ray does not meet; *neighbour*: the same, but it shares a vertex with the right one. All are decided in \
exact arithmetic, against the triangles as they are stored. *|Δt|*: error of t against the source in exact arithmetic \
(median, 99 %, greatest), over all sets. *RMSE*, *1-SSIM*: of a picture with shadows, brightness 0 to 1, against the exact \
one. Chart points on the lowest line have no error at all.\n\n";

/// Per million; in full where it is less than ten.
fn per_million(n: u64, of: u64) -> String {
    match (n, of) {
        (0, _) | (_, 0) => "0".to_owned(),
        _ => match n as f64 * 1e6 / of as f64 {
            rate if rate < 10.0 => format!("{rate:.1}"),
            rate => count(rate.round() as u64),
        },
    }
}

fn kinds(d: &Defects) -> [String; 4] {
    [d.false_misses, d.leaks, d.ghosts, d.wrong_neighbours].map(|n| per_million(n, d.rays))
}

fn short(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

fn bytes(value: Option<f64>) -> String {
    value.map_or("?".to_owned(), |b| format!("{b:.1}"))
}

fn summary(results: &AccuracyResults) -> String {
    let row = |s: &TracerSummary<'_>| {
        let name = if s.models < results.models.len() {
            format!("{} ({})", s.name, s.models)
        } else {
            s.name.to_owned()
        };
        vec![
            name,
            format!("{:.0}", s.nanoseconds),
            bytes(s.bytes_per_triangle),
            per_million(s.ordinary.all(), s.ordinary.rays),
            per_million(s.aimed.all(), s.aimed.rays),
            short(s.t_relative),
            short(s.t_ulp),
            short(s.rmse),
            short(s.dissimilarity),
        ]
    };
    let rows: Vec<Vec<String>> = results.summaries().iter().map(row).collect();
    let names = ["tracer", "ns", "B/tri", "wrong", "aimed", "Δt/t, 99 %", "ulp, greatest", "RMSE", "1-SSIM"];
    format!(
        "## All models\n\nGeometric means of ns and bytes, wrong answers of all kinds per million, the worst of the other \
         errors; in brackets: over how many of the {} models, if not all.\n\n{}\n",
        results.models.len(),
        table(&cells(&names), &rows)
    )
}

fn page(model: &ModelErrors) -> String {
    let mut text = format!("## {} ({} triangles)\n\n", model.name, count(model.triangles as u64));
    let wrong = |e: &Errors| {
        let mut row = vec![e.name.clone(), format!("{:.0}", e.mean_nanoseconds())];
        let set = |set: &&str| e.nanoseconds.get(*set).map_or("-".to_owned(), |ns| format!("{ns:.0}"));
        row.extend(ORDINARY.iter().map(set));
        row.push(bytes(e.bytes_per_triangle));
        row.extend(kinds(&e.ordinary));
        row.extend(kinds(&e.aimed));
        row
    };
    let names = [
        "tracer",
        "ns",
        "primary",
        "diffuse-beside",
        "random",
        "B/tri",
        "missed",
        "leaked",
        "ghost",
        "neighbour",
        "aimed: missed",
        "leaked",
        "ghost",
        "neighbour",
    ];
    let rows: Vec<Vec<String>> = model.tracers.iter().map(wrong).collect();
    text.push_str(&table(&cells(&names), &rows));
    text.push('\n');
    let errors = |e: &Errors| {
        let mut row = vec![e.name.clone()];
        row.extend([e.t_relative, e.t_ulp].iter().flat_map(|s| [s.median, s.most, s.max].map(short)));
        row.extend([e.rmse, e.dissimilarity].map(short));
        row
    };
    let names =
        ["tracer", "Δt/t: median", "99 %", "greatest", "ulp: median", "99 %", "greatest", "RMSE", "1-SSIM"];
    let rows: Vec<Vec<String>> = model.tracers.iter().map(errors).collect();
    text.push_str(&table(&cells(&names), &rows));
    text.push('\n');
    let sets: Vec<String> = model.rays.iter().map(|(set, n)| format!("{} {set}", count(*n as u64))).collect();
    text.push_str(&format!("Rays: {}.\n\n", sets.join(", ")));
    for left_out in &model.left_out {
        text.push_str(&format!("- {}: not measured: {}\n", left_out.name, left_out.why));
    }
    if !model.left_out.is_empty() {
        text.push('\n');
    }
    text
}
