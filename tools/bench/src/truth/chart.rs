//! The chart: wrong answers per million against nanoseconds for a query, both logarithmic. A large
//! panel shows the means of the sets in f32, the ones at its right the sets in f64, and small ones
//! each of the others. Engines have numbers; ours is red, and others that take f64 are hollow.

use super::sets::Set;
use super::{Line, Outcome};
use std::fmt::Write as _;

const WIDTH: f64 = 1000.0;
const TALL_WIDTH: f64 = 320.0;
const LARGE_HEIGHT: f64 = 500.0;
const SMALL_HEIGHT: f64 = 235.0;
const COLUMNS: usize = 4;
/// Decades of wrong answers per million, above two rows for none.
const DECADES: i32 = 6;

const HEAD: &str = "\
<style>text { font: 9px sans-serif; fill: #555 } .large text { font-size: 12px } path { stroke: #ddd } \
text.title { font: bold 13px sans-serif; fill: black } .e { text-anchor: end } .m { text-anchor: middle } \
text.in { fill: #2f5d8a } circle { fill: #2f5d8a; stroke: #2f5d8a; stroke-width: 1.5 } .m.single { fill: white } \
circle.double { fill: white } .ours circle { stroke: #d6204e; fill: #d6204e } text.in.ours { fill: #d6204e; \
font-weight: bold } .ours .m { fill: white }</style>
<text x=\"20\" y=\"32\" style=\"font: bold 20px sans-serif; fill: black\">Wrong answers against time</text>
<text x=\"20\" y=\"53\" style=\"font-size: 13px\">down: fewer wrong answers · left: faster · filled: takes f32 · \
hollow: takes f64 · red: bth</text>
";

/// A rectangle that a dot or a label covers: left, top, right, bottom.
type Area = [f64; 4];

/// An engine in a panel: wrong answers per million, and nanoseconds.
struct Point<'a>(&'a Line<'a>, f64, f64);

/// Where a panel is, the decades of its nanoseconds, and if it is the large one.
#[derive(Clone, Copy)]
struct Panel {
    area: Area,
    decades: (i32, i32),
    is_large: bool,
}

/// The chart as SVG.
pub(super) fn draw(sets: &[Set], lines: &[Line<'_>]) -> String {
    let small = sets.iter().filter(|set| set.single).count();
    let below = LARGE_HEIGHT + 70.0;
    let height = below + small.div_ceil(COLUMNS) as f64 * SMALL_HEIGHT;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n{HEAD}"
    );
    let times = || lines.iter().flat_map(|line| line.answered().map(|outcome| outcome.ns));
    let (least, most) = (times().fold(1e9, f64::min).max(1.0), times().fold(10.0, f64::max));
    let decades = (least.log10().floor() as i32, most.log10().ceil() as i32);
    let wide = if small < sets.len() { WIDTH - TALL_WIDTH } else { WIDTH };
    let large = Panel { area: [0.0, 60.0, wide, 60.0 + LARGE_HEIGHT], decades, is_large: true };
    let mean = |line| Line::mean(line, sets).map(|(wrong, ns)| Point(line, wrong, ns));
    let title = "the sets in f32 that an engine answers, mean";
    large.draw(&mut svg, title, lines.iter().filter_map(mean).collect());
    let (mut cell, mut next_top) = (0, 60.0);
    let tall = LARGE_HEIGHT / (sets.len() - small).max(1) as f64;
    for (i, set) in sets.iter().enumerate() {
        let (mut area, mut title) =
            ([wide, next_top, WIDTH, next_top + tall], format!("{}, in f64", set.name));
        if !set.single {
            next_top += tall;
        } else {
            let width = WIDTH / COLUMNS as f64;
            let (x, y) = ((cell % COLUMNS) as f64 * width, below + (cell / COLUMNS) as f64 * SMALL_HEIGHT);
            (area, title) = ([x, y, x + width, y + SMALL_HEIGHT], set.name.to_owned());
            cell += 1;
        }
        let points = lines.iter().filter_map(|line| {
            let Outcome { judgement, ns } = line.outcomes[i].as_ref().ok()?;
            Some(Point(line, judgement.per_million(), *ns))
        });
        Panel { area, is_large: false, ..large }.draw(&mut svg, &title, points.collect());
    }
    svg + "</svg>\n"
}

fn text(svg: &mut String, class: &str, [x, y]: [f64; 2], what: &str) {
    let _ = writeln!(svg, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{what}</text>");
}

/// A power of ten as people write it.
fn decade(exponent: i32) -> String {
    let (thousands, unit) = [(0, ""), (3, "k"), (6, "M"), (9, "G")][(exponent / 3).clamp(0, 3) as usize];
    format!("{}{unit}", 10f64.powi(exponent - thousands))
}

impl Panel {
    fn draw(self, svg: &mut String, title: &str, mut points: Vec<Point<'_>>) {
        let [left, top, right, bottom] = self.area;
        let [inset, under, radius] = if self.is_large { [60.0, 42.0, 9.0] } else { [38.0, 28.0, 6.5] };
        let (left, top, right, bottom) = (left + inset, top + 26.0, right - 12.0, bottom - under);
        let _ = writeln!(svg, "<g class=\"{}\">", if self.is_large { "large" } else { "small" });
        // The lowest two rows are for none.
        let row = (bottom - top) / f64::from(DECADES + 2);
        let up = |wrong: f64| match wrong {
            0.0 => bottom - row,
            _ => bottom - row * (2.0 + wrong.log10().clamp(0.0, f64::from(DECADES))),
        };
        let (first, last) = self.decades;
        let along =
            |ns: f64| left + (right - left) * (ns.log10() - f64::from(first)) / f64::from(last - first);
        let (width, none) = (right - left, up(1.0));
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{none:.1}\" width=\"{width}\" height=\"{:.1}\" fill=\"#e9f5ec\"/>",
            2.0 * row
        );
        text(svg, "e", [left - 5.0, up(0.0) + 4.0], "0");
        for exponent in 0..=DECADES {
            let y = up(10f64.powi(exponent));
            let _ = writeln!(svg, "<path d=\"M{left} {y:.1}H{right}\"/>");
            text(svg, "e", [left - 5.0, y + 4.0], &decade(exponent));
        }
        for exponent in first..=last {
            let x = along(10f64.powi(exponent));
            let _ = writeln!(svg, "<path d=\"M{x:.1} {top}V{bottom}\"/>");
            text(svg, "m", [x, bottom + 14.0], &decade(exponent));
        }
        text(svg, "title", [left, top - 8.0], title);
        if self.is_large {
            text(
                svg,
                "m",
                [(left + right) / 2.0, bottom + 34.0],
                "nanoseconds of processor time for a query",
            );
            let _ = writeln!(
                svg,
                "<g transform=\"translate({} {}) rotate(-90)\">",
                left - 44.0,
                (top + bottom) / 2.0
            );
            text(svg, "m", [0.0; 2], "wrong answers per million");
            svg.push_str("</g>\n");
        }
        // Ours is drawn last, above the others.
        points.sort_by_key(|Point(line, ..)| std::cmp::Reverse(line.number));
        let mut taken: Vec<Area> = Vec::new();
        let mut placed = Vec::new();
        for Point(line, wrong, ns) in &points {
            // Dots that would cover each other move a little up or down.
            let (x, y) = (along(*ns), up(*wrong));
            let most = if *wrong == 0.0 { row - radius } else { radius };
            let area = |step: f64| [x - radius, y + step - radius, x + radius, y + step + radius];
            let mut steps = (0..=most as u32).flat_map(|step| [f64::from(step), -f64::from(step)]);
            let free = |step: &f64| !taken.iter().any(|other| overlap(&area(*step), other));
            let step = steps.find(free).unwrap_or(0.0);
            taken.push(area(step));
            placed.push((line, [x, y + step]));
        }
        for (line, [x, y]) in placed {
            let ours = if line.engine.is_ours() { "ours" } else { "" };
            let input = if line.engine.single { "single" } else { "double" };
            let _ = writeln!(
                svg,
                "<g class=\"{ours}\"><circle class=\"{input}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>"
            );
            text(svg, &format!("m in {input}"), [x, y + 0.45 * radius], &line.number.to_string());
            svg.push_str("</g>\n");
            if self.is_large {
                let area = label(&line.engine.name, [x, y], &taken, right);
                text(svg, &format!("in {ours}"), [area[0], area[3] - 3.0], &line.engine.name);
                taken.push(area);
            }
        }
        svg.push_str("</g>\n");
    }
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// The place of a label next to a dot where it covers nothing, if there is one.
fn label(name: &str, [x, y]: [f64; 2], taken: &[Area], right: f64) -> Area {
    let width = 7.0 * name.len() as f64;
    let sides = [(12.0, -7.0), (-12.0 - width, -7.0), (-width / 2.0, -25.0), (-width / 2.0, 11.0)];
    let corners = [9, 16, 23, 30, 37].into_iter().flat_map(|far| {
        let (right, left, off) = (9.0, -9.0 - width, f64::from(far));
        [(right, -off - 12.0), (right, off - 2.0), (left, -off - 12.0), (left, off - 2.0)]
    });
    let at = |(dx, dy): (f64, f64)| [x + dx, y + dy, x + dx + width, y + dy + 14.0];
    let mut places = sides.into_iter().chain(corners).map(at);
    places
        .find(|area| area[2] < right && !taken.iter().any(|other| overlap(area, other)))
        .unwrap_or(at(sides[0]))
}
