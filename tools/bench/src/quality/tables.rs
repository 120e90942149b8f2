//! The page of `quality`.

use super::results::{ModelQuality, QualityResults, STEPS_OF};
use crate::markdown::{cells, count, table, two_decimals};

fn three_decimals(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |v| format!("{v:.3}"))
}

/// The page below its head.
pub fn markdown(results: &QualityResults) -> String {
    let mut text = String::from(
        "Each row is built as files are, but for the one thing that it names; `the same again` is built as files are, too, and shows \
         what chance makes of a time. Batches on one thread, CPU time, the fastest of interleaved rounds.\n\n\
         ## Over the first row, geometric means over the models\n\n\
         Times below 1 are faster. SAH: wide nodes and leaves that a random line through the box meets.\n\n",
    );
    let sets = results.sets();
    let mut head = cells(&["", "SAH", "B/tri", "building"]);
    head.extend(sets.iter().map(|s| (*s).to_owned()));
    head.push("all".to_owned());
    let names = results.models.first().map_or(&[][..], |m| &m.rows[..]);
    let rows: Vec<Vec<String>> = names
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let mut cells = vec![
                r.name.clone(),
                three_decimals(results.ratio(i, |r| Some(r.wide_visits[0] + r.wide_visits[1]))),
                two_decimals(results.ratio(i, |r| Some(r.bytes))),
                two_decimals(results.ratio(i, |r| Some(r.seconds))),
            ];
            let set = |set: &&str| three_decimals(results.ratio(i, |r| r.nanoseconds.get(*set).copied()));
            cells.extend(sets.iter().map(set));
            cells.push(three_decimals(results.time_ratio(i)));
            cells
        })
        .collect();
    text.push_str(&table(&head, &rows));
    results.models.iter().for_each(|m| text.push_str(&page(m, &sets)));
    text
}

fn page(model: &ModelQuality, sets: &[&str]) -> String {
    let seen =
        serde_json::to_value(model.view).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
    let mut text = format!(
        "\n## {} ({} triangles, seen from {seen})\n\nBuilding in CPU seconds; visits as SAH has them, then nodes and leaves of a camera ray and of a bounce; sets in ns a ray.\n\n",
        model.name,
        count(model.triangles as u64)
    );
    let mut head = cells(&[
        "",
        "building",
        "binary visits",
        "node visits",
        "leaf visits",
        "children",
        "triangles",
        "references",
        "B/tri",
        "camera",
        "bounce",
    ]);
    head.extend(sets.iter().map(|s| (*s).to_owned()));
    let rows: Vec<Vec<String>> = model
        .rows
        .iter()
        .map(|r| {
            let mut cells = vec![
                r.name.clone(),
                format!("{:.2}", r.seconds),
                format!("{:.2}", r.visits),
                format!("{:.3}", r.wide_visits[0]),
                format!("{:.3}", r.wide_visits[1]),
                format!("{:.1}", r.children),
                format!("{:.1}", r.triangles),
                format!("{:.3}", r.references),
                format!("{:.1}", r.bytes),
            ];
            cells.extend(STEPS_OF.map(|set| {
                r.steps.get(set).map_or("-".to_owned(), |[nodes, leaves]| format!("{nodes:.2} + {leaves:.2}"))
            }));
            cells.extend(
                sets.iter().map(|s| r.nanoseconds.get(s).map_or("-".to_owned(), |ns| format!("{ns:.1}"))),
            );
            cells
        })
        .collect();
    text.push_str(&table(&head, &rows));
    text
}
