//! The charts of `accuracy`: errors against run time or bytes, on logarithmic axes, as SVG.

use super::ORDINARY;
use crate::report::{Chart, Report, distinct};
use crate::rounds::geometric_mean;
use std::fmt::Write;

/// File, and the label of each axis.
const CHARTS: [[&str; 3]; 3] = [
    ["wrong-against-time", "ns/ray", "wrong answers per million aimed rays"],
    ["t-against-time", "ns/ray", "|Δt|/t, 99 %"],
    ["t-against-bytes", "bytes per triangle", "|Δt|/t, 99 %"],
];

const SIZE: f64 = 400.0;

/// All charts, over all models.
pub(super) fn draw(report: &Report) -> Vec<Chart> {
    let engines = distinct(report.rows.iter().map(|row| row.engine.as_str()));
    let chart = |[name, x, y]: [&str; 3]| {
        let point = |engine: &&str| {
            Some((figure(report, engine, x)?, figure(report, engine, y)?, (*engine).to_owned()))
        };
        let points = engines.iter().filter_map(point).collect();
        Chart { name: name.to_owned(), svg: svg([x, y], points) }
    };
    CHARTS.into_iter().map(chart).collect()
}

/// The figure of an axis over all models: geometric means of times and bytes, the largest error of t, the mean rate of
/// wrong answers.
fn figure(report: &Report, engine: &str, axis: &str) -> Option<f64> {
    let values = |is_it: &dyn Fn(&str) -> bool| -> Vec<f64> {
        let rows = report.rows.iter().filter(|row| row.engine == engine && is_it(&row.set));
        rows.map(|row| row.value).collect()
    };
    match axis {
        "ns/ray" => geometric_mean(values(&|set| ORDINARY.contains(&set))),
        "bytes per triangle" => geometric_mean(values(&|set| set == "bytes")),
        "|Δt|/t, 99 %" => values(&|set| set == "error of t 99 %").into_iter().reduce(f64::max),
        // Four kinds of wrong answers for each model.
        _ => {
            let rates = values(&|set| set.ends_with(" aimed"));
            Some(4.0 * rates.iter().sum::<f64>() / rates.len().max(1) as f64)
        }
    }
}

/// A scatter plot with the Pareto front. Without errors y is 0: such points are drawn below all others.
fn svg([x_label, y_label]: [&str; 2], mut points: Vec<(f64, f64, String)>) -> String {
    let smallest = points.iter().map(|p| p.1).filter(|y| *y > 0.0).fold(f64::INFINITY, f64::min);
    let floor = if smallest.is_finite() { smallest / 10.0 } else { 1.0 };
    points.iter_mut().for_each(|p| p.1 = p.1.max(floor));
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, 0f64), |(low, high), v| (low.min(v), high.max(v)));
        (low / 1.2, high * 1.2)
    };
    let (xs, ys) = (range(&mut points.iter().map(|p| p.0)), range(&mut points.iter().map(|p| p.1)));
    let place = |value: f64, (low, high): (f64, f64)| SIZE * (value / low).ln() / (high / low).ln();
    let at = |x: f64, y: f64| (60.0 + place(x, xs), 20.0 + SIZE - place(y, ys));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"620\" height=\"470\" font-family=\"sans-serif\" \
         font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <rect x=\"60\" y=\"20\" width=\"{SIZE}\" height=\"{SIZE}\" fill=\"none\" stroke=\"#999\"/>\n\
         <text x=\"260\" y=\"455\" text-anchor=\"middle\">{x_label}: {:.3e} to {:.3e}</text>\n\
         <text transform=\"translate(40 220) rotate(-90)\" text-anchor=\"middle\">{y_label}: {:.1e} to {:.1e}</text>\n",
        xs.0, xs.1, ys.0, ys.1
    );
    // Writing to a string cannot fail.
    let mut lowest = f64::INFINITY;
    for (x, y, name) in &points {
        let (left, top) = at(*x, *y);
        // Points of the front have none to their left that is as low.
        let colour = if *y < lowest { "#d55e00" } else { "#0072b2" };
        lowest = lowest.min(*y);
        let _ = writeln!(svg, "<circle cx=\"{left:.1}\" cy=\"{top:.1}\" r=\"4\" fill=\"{colour}\"/>");
        let _ = writeln!(svg, "<text x=\"{:.1}\" y=\"{:.1}\">{name}</text>", left + 6.0, top - 3.0);
    }
    svg + "</svg>\n"
}
