//! The charts of `accuracy`: what is paid, in time or bytes, against what is wrong.

use super::contenders::GROUPS;
use super::results::{AccuracyResults, TracerSummary};
use crate::output::Chart;
use crate::scatter::{PointSeries, Scatter};

/// The two quantities of a chart; tracers of which one is not known are left out.
struct Axes {
    name: &'static str,
    title: &'static str,
    x: (&'static str, fn(&TracerSummary<'_>) -> Option<f64>),
    y: (&'static str, fn(&TracerSummary<'_>) -> f64),
}

fn time(s: &TracerSummary<'_>) -> Option<f64> {
    Some(s.nanoseconds)
}

fn bytes(s: &TracerSummary<'_>) -> Option<f64> {
    s.bytes_per_triangle
}

fn aimed(s: &TracerSummary<'_>) -> f64 {
    s.aimed.all() as f64 * 1e6 / s.aimed.rays.max(1) as f64
}

const CHARTS: [Axes; 4] = [
    Axes {
        name: "wrong-against-time",
        title: "Wrong answers against run time",
        x: ("ns a ray", time),
        y: ("wrong answers per million aimed rays", aimed),
    },
    Axes {
        name: "t-against-time",
        title: "Error of t against run time",
        x: ("ns a ray", time),
        y: ("|Δt|/t, 99 %", |s| s.t_relative),
    },
    Axes {
        name: "t-against-bytes",
        title: "Error of t against bytes",
        x: ("bytes a triangle", bytes),
        y: ("|Δt|/t, 99 %", |s| s.t_relative),
    },
    Axes {
        name: "picture-against-bytes",
        title: "Error of a picture against bytes",
        x: ("bytes a triangle", bytes),
        y: ("RMSE", |s| s.rmse),
    },
];

/// All charts, over all models.
pub fn draw(results: &AccuracyResults) -> Vec<Chart> {
    let summaries = results.summaries();
    let chart = |axes: &Axes| Chart { name: axes.name.to_owned(), svg: scatter(axes, &summaries).svg() };
    CHARTS.iter().map(chart).collect()
}

fn scatter(axes: &Axes, summaries: &[TracerSummary<'_>]) -> Scatter {
    // Zero has no place on a logarithmic axis: it is drawn on the lowest line, well below the least error.
    let least = summaries.iter().map(axes.y.1).filter(|y| *y > 0.0).fold(f64::INFINITY, f64::min);
    let floor = if least.is_finite() { least / 10.0 } else { 1.0 };
    let cloud = |group: &&str| {
        let own = summaries.iter().filter(|s| s.group == *group);
        let placed: Vec<(String, (f64, f64))> = own
            .filter_map(|s| Some((s.name.to_owned(), ((axes.x.1)(s)?, (axes.y.1)(s).max(floor)))))
            .collect();
        let (labels, points) = placed.into_iter().unzip();
        PointSeries { name: (*group).to_owned(), points, labels }
    };
    Scatter {
        title: axes.title.to_owned(),
        x: axes.x.0.to_owned(),
        y: axes.y.0.to_owned(),
        series: GROUPS.iter().map(cloud).filter(|c| !c.points.is_empty()).collect(),
        diagonal: false,
        front: true,
        radius: 5.0,
    }
}
