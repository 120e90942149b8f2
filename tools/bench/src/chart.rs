//! Grouped bar charts as SVG.

use std::fmt::Write;

/// Bars of one colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// A value for each group, if there is one; positive.
    pub values: Vec<Option<f64>>,
}

/// How values become heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// From zero.
    Linear,
    /// By orders of magnitude; bars stand on the least whole one.
    Logarithmic,
}

/// A chart of groups of bars, side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct BarChart {
    /// Title.
    pub title: String,
    /// The unit of the values, or what they are.
    pub unit: String,
    /// Names below the groups.
    pub groups: Vec<String>,
    /// The bars side by side in each group.
    pub series: Vec<Series>,
    /// How values become heights.
    pub scale: Scale,
    /// Where to draw a line across, such as at 1.
    pub line: Option<f64>,
}

/// Nine colours that people with common defects of colour vision can distinguish, too (after Okabe and Ito 2008).
pub(crate) const COLOURS: [&str; 9] =
    ["#0072b2", "#56b4e9", "#009e73", "#7fcdbb", "#e69f00", "#d55e00", "#cc79a7", "#999999", "#4d4d4d"];

const BAR: f64 = 22.0;
const GAP: f64 = 26.0;
const PLOT_LEFT: f64 = 60.0;
const PLOT_TOP: f64 = 54.0;
const PLOT_HEIGHT: f64 = 280.0;
/// Width of a letter, about.
const LETTER: f64 = 6.8;

/// The vertical axis.
struct Axis {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    scale: Scale,
}

impl Axis {
    fn of(chart: &BarChart) -> Axis {
        let values = chart.series.iter().flat_map(|s| &s.values).flatten().copied().chain(chart.line);
        let (mut least, mut greatest) = (f64::INFINITY, 0f64);
        for value in values.filter(|v| *v > 0.0) {
            (least, greatest) = (least.min(value), greatest.max(value));
        }
        if greatest == 0.0 {
            (least, greatest) = (1.0, 1.0);
        }
        match chart.scale {
            Scale::Linear => {
                let step = tidy(greatest / 5.0);
                let steps = (greatest / step).ceil().max(1.0);
                let ticks = (0..=steps as u32).map(|i| f64::from(i) * step).collect();
                Axis { low: 0.0, high: steps * step, ticks, scale: chart.scale }
            }
            Scale::Logarithmic => {
                let low = least.log10().floor() as i32;
                let high = (greatest.log10().ceil() as i32).max(low + 1);
                let ticks = (low..=high).map(|e| 10f64.powi(e)).collect();
                Axis { low: 10f64.powi(low), high: 10f64.powi(high), ticks, scale: chart.scale }
            }
        }
    }

    /// Distance of a value from the top of the plot.
    fn y(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => value / self.high,
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        PLOT_TOP + PLOT_HEIGHT * (1.0 - share.clamp(0.0, 1.0))
    }
}

/// The value rounded up to 1, 2 or 5 times a power of ten.
fn tidy(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|t| *t >= value * (1.0 - 1e-9)).unwrap_or(power)
}

/// A number in about three digits.
fn short(value: f64) -> String {
    match value {
        v if v >= 99.95 => format!("{v:.0}"),
        v if v >= 9.995 => format!("{v:.1}"),
        v if v >= 0.0995 => format!("{v:.2}"),
        v => format!("{v:.3}"),
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

impl BarChart {
    /// The picture. Every bar carries its value.
    pub fn svg(&self) -> String {
        let axis = Axis::of(self);
        let longest = self.groups.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        let group = (self.series.len() as f64 * BAR).max(longest as f64 * LETTER);
        let width = (PLOT_LEFT + self.groups.len() as f64 * (group + GAP) + GAP).max(420.0);
        let legend = self.legend(width);
        let bottom = PLOT_TOP + PLOT_HEIGHT;
        let height = bottom + 34.0 + 20.0 * legend.len() as f64 + 12.0;

        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
             viewBox=\"0 0 {width:.0} {height:.0}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        text(&mut svg, 14.0, 22.0, "font-size=\"15\" font-weight=\"bold\"", &self.title);
        text(&mut svg, 14.0, 40.0, "fill=\"#555\"", &self.unit);
        for tick in &axis.ticks {
            let y = axis.y(*tick);
            line(&mut svg, (PLOT_LEFT, width - GAP), y, "stroke=\"#ddd\"");
            text(&mut svg, PLOT_LEFT - 8.0, y + 4.0, "text-anchor=\"end\" fill=\"#555\"", &tick.to_string());
        }
        for (g, name) in self.groups.iter().enumerate() {
            let middle = PLOT_LEFT + GAP + g as f64 * (group + GAP) + group / 2.0;
            // Bars without a value leave no gap.
            let value = |s: &Series| s.values.get(g).copied().flatten();
            let bars: Vec<(usize, f64)> =
                self.series.iter().enumerate().filter_map(|(i, s)| Some((i, value(s)?))).collect();
            let left = middle - bars.len() as f64 * BAR / 2.0;
            for (place, (series, value)) in bars.into_iter().enumerate() {
                let x = left + place as f64 * BAR;
                bar(&mut svg, x, axis.y(value), bottom, COLOURS[series % COLOURS.len()], value);
            }
            text(&mut svg, middle, bottom + 18.0, "text-anchor=\"middle\"", name);
        }
        line(&mut svg, (PLOT_LEFT, width - GAP), bottom, "stroke=\"#333\"");
        if let Some(value) = self.line {
            line(
                &mut svg,
                (PLOT_LEFT, width - GAP),
                axis.y(value),
                "stroke=\"#333\" stroke-dasharray=\"5 4\"",
            );
        }
        for (row, entries) in legend.iter().enumerate() {
            let y = bottom + 42.0 + 20.0 * row as f64;
            for (series, x) in entries {
                let colour = COLOURS[series % COLOURS.len()];
                let _ = writeln!(
                    svg,
                    "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"12\" height=\"12\" fill=\"{colour}\"/>",
                    y - 10.0
                );
                text(&mut svg, x + 17.0, y, "", &self.series[*series].name);
            }
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// Rows of the legend: each entry's series and left edge.
    fn legend(&self, width: f64) -> Vec<Vec<(usize, f64)>> {
        let (mut rows, mut x) = (vec![Vec::new()], PLOT_LEFT);
        for (i, series) in self.series.iter().enumerate() {
            let entry = 36.0 + LETTER * series.name.chars().count() as f64;
            if x + entry > width && x > PLOT_LEFT {
                rows.push(Vec::new());
                x = PLOT_LEFT;
            }
            rows.last_mut().expect("starts with a row").push((i, x));
            x += entry;
        }
        rows
    }
}

// Writing to a string cannot fail.
pub(crate) fn text(svg: &mut String, x: f64, y: f64, style: &str, what: &str) {
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{}</text>", escaped(what));
}

fn line(svg: &mut String, (x1, x2): (f64, f64), y: f64, style: &str) {
    let _ = writeln!(svg, "<line x1=\"{x1:.1}\" y1=\"{y:.1}\" x2=\"{x2:.1}\" y2=\"{y:.1}\" {style}/>");
}

fn bar(svg: &mut String, x: f64, top: f64, bottom: f64, colour: &str, value: f64) {
    let (width, height) = (BAR - 2.0, bottom - top);
    let _ = writeln!(
        svg,
        "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{colour}\"/>",
        x + 1.0
    );
    text(svg, x + BAR / 2.0, top - 3.0, "text-anchor=\"middle\" font-size=\"9\"", &short(value));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_that_hold_all_values() {
        let chart = |values: &[f64], scale| BarChart {
            title: String::new(),
            unit: String::new(),
            groups: Vec::new(),
            series: vec![Series { name: String::new(), values: values.iter().map(|v| Some(*v)).collect() }],
            scale,
            line: None,
        };
        assert_eq!(Axis::of(&chart(&[3.3, 0.4], Scale::Linear)).ticks, [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(Axis::of(&chart(&[0.2, 40.0], Scale::Logarithmic)).ticks, [0.1, 1.0, 10.0, 100.0]);
        assert_eq!(Axis::of(&chart(&[], Scale::Linear)).high, 1.0);
    }

    #[test]
    fn names_cannot_break_the_picture() {
        assert_eq!(escaped("a<b>&c"), "a&lt;b&gt;&amp;c");
    }
}
