//! Scatter plots on logarithmic axes as SVG.

use crate::chart::{COLOURS, text};
use std::fmt::Write;

/// Points of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct PointSeries {
    /// Its name in the legend.
    pub name: String,
    /// Positive x and y.
    pub points: Vec<(f64, f64)>,
    /// The label of each point, or empty.
    pub labels: Vec<String>,
}

/// A plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Title.
    pub title: String,
    /// What x is.
    pub x: String,
    /// What y is.
    pub y: String,
    /// What is drawn.
    pub series: Vec<PointSeries>,
    /// Whether to draw the line of equal x and y.
    pub diagonal: bool,
    /// Whether to draw the Pareto front: the points that no other is both left of and below of.
    pub front: bool,
    /// Radius of a point.
    pub radius: f64,
}

const PLOT_LEFT: f64 = 70.0;
const PLOT_TOP: f64 = 40.0;
const PLOT_SIZE: f64 = 400.0;

/// Least and greatest value of an axis, a little widened; 1 to 10 without values.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| *v > 0.0 && v.is_finite())
        .fold((f64::INFINITY, 0f64), |(low, high), v| (low.min(v), high.max(v)));
    if high == 0.0 { (1.0, 10.0) } else { (low / 1.2, high * 1.2) }
}

/// 1, 2 and 5 times powers of ten within a range; powers only where there are many.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let few = high / low < 200.0;
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let steps: &[f64] = if few { &[1.0, 2.0, 5.0] } else { &[1.0] };
    powers
        .flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)))
        .filter(|tick| (low..=high).contains(tick))
        .collect()
}

/// The text of a tick; tiny numbers have an exponent.
fn written(tick: f64) -> String {
    if tick < 1e-3 { format!("{tick:.0e}") } else { tick.to_string() }
}

/// Corners of the stairs below which no point lies: the points that no other is both left of and below of, from left to
/// right, and between two of them the inner corner.
fn stairs(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = points.collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut corners: Vec<(f64, f64)> = Vec::new();
    for (x, y) in points {
        match corners.last() {
            Some((_, last)) if y >= *last => {}
            Some((_, last)) => {
                let corner = (x, *last);
                corners.extend([corner, (x, y)]);
            }
            None => corners.push((x, y)),
        }
    }
    corners
}

impl Scatter {
    /// The picture, as SVG.
    pub fn svg(&self) -> String {
        let all = || self.series.iter().flat_map(|c| &c.points);
        let (mut xs, mut ys) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
        if self.diagonal {
            xs = (xs.0.min(ys.0), xs.1.max(ys.1));
            ys = xs;
        }
        let place = |value: f64, (low, high): (f64, f64)| (value / low).ln() / (high / low).ln();
        let at = |(x, y): (f64, f64)| {
            (PLOT_LEFT + PLOT_SIZE * place(x, xs), PLOT_TOP + PLOT_SIZE * (1.0 - place(y, ys)))
        };
        let (width, height) = (PLOT_LEFT + PLOT_SIZE + 190.0, PLOT_TOP + PLOT_SIZE + 60.0);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        text(&mut svg, 14.0, 22.0, "font-size=\"15\" font-weight=\"bold\"", &self.title);
        let mut rule = |from: (f64, f64), to: (f64, f64), style: &str| {
            let _ = writeln!(
                svg,
                "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" {style}/>",
                from.0, from.1, to.0, to.1
            );
        };
        for tick in ticks(xs) {
            rule(at((tick, ys.0)), at((tick, ys.1)), "stroke=\"#ddd\"");
        }
        for tick in ticks(ys) {
            rule(at((xs.0, tick)), at((xs.1, tick)), "stroke=\"#ddd\"");
        }
        if self.diagonal {
            rule(at((xs.0, xs.0)), at((xs.1, xs.1)), "stroke=\"#333\" stroke-dasharray=\"5 4\"");
        }
        if self.front {
            let corners = stairs(all().copied());
            for pair in corners.windows(2) {
                rule(at(pair[0]), at(pair[1]), "stroke=\"#999\" stroke-dasharray=\"3 3\"");
            }
        }
        for tick in ticks(xs) {
            text(
                &mut svg,
                at((tick, ys.0)).0,
                PLOT_TOP + PLOT_SIZE + 16.0,
                "text-anchor=\"middle\" fill=\"#555\"",
                &written(tick),
            );
        }
        for tick in ticks(ys) {
            text(
                &mut svg,
                PLOT_LEFT - 6.0,
                at((xs.0, tick)).1 + 4.0,
                "text-anchor=\"end\" fill=\"#555\"",
                &written(tick),
            );
        }
        text(
            &mut svg,
            PLOT_LEFT + PLOT_SIZE / 2.0,
            PLOT_TOP + PLOT_SIZE + 40.0,
            "text-anchor=\"middle\"",
            &self.x,
        );
        let turned =
            format!("text-anchor=\"middle\" transform=\"rotate(-90 16 {0:.0})\"", PLOT_TOP + PLOT_SIZE / 2.0);
        text(&mut svg, 16.0, PLOT_TOP + PLOT_SIZE / 2.0, &turned, &self.y);
        self.draw_series(&mut svg, at);
        svg.push_str("</svg>\n");
        svg
    }

    /// Draws the points with their labels, and the legend. `at` maps a point to its place in the picture.
    fn draw_series(&self, svg: &mut String, at: impl Fn((f64, f64)) -> (f64, f64)) {
        for (row, cloud) in self.series.iter().enumerate() {
            let colour = COLOURS[row % COLOURS.len()];
            let mut dot = |(x, y): (f64, f64), radius: f64| {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{colour}\" fill-opacity=\"0.7\"/>"
                );
            };
            cloud.points.iter().for_each(|p| dot(at(*p), self.radius));
            let places = cloud.points.iter().map(|p| at(*p));
            let named: Vec<_> = places.zip(&cloud.labels).collect();
            let y = PLOT_TOP + 14.0 + 20.0 * row as f64;
            dot((PLOT_LEFT + PLOT_SIZE + 20.0, y - 4.0), 5.0);
            text(svg, PLOT_LEFT + PLOT_SIZE + 32.0, y, "", &cloud.name);
            for ((x, y), label) in named {
                text(svg, x + self.radius + 2.0, y - 3.0, "font-size=\"9\" fill=\"#333\"", label);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_lies_in_the_plot_and_ticks_in_the_range() {
        let cloud = PointSeries {
            name: "a<b".into(),
            points: vec![(1.0, 30.0), (250.0, 3.0)],
            labels: vec!["c".into()],
        };
        let plot = Scatter {
            title: "t".into(),
            x: "x".into(),
            y: "y".into(),
            series: vec![cloud],
            diagonal: true,
            front: false,
            radius: 3.0,
        };
        let svg = plot.svg();
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(svg.contains("a&lt;b") && svg.contains(">c</text>"));
        assert_eq!(ticks((1.0, 12.0)), [1.0, 2.0, 5.0, 10.0]);
        assert_eq!(ticks((1.0, 1e4)), [1.0, 10.0, 100.0, 1e3, 1e4]);
        assert_eq!(range(std::iter::empty()), (1.0, 10.0));
    }

    #[test]
    fn no_point_lies_below_the_stairs() {
        let points = [(3.0, 3.0), (1.0, 5.0), (2.0, 6.0), (4.0, 1.0), (4.0, 2.0)];
        let corners = [(1.0, 5.0), (3.0, 5.0), (3.0, 3.0), (4.0, 3.0), (4.0, 1.0)];
        assert_eq!(stairs(points.into_iter()), corners);
    }
}
