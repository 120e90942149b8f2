//! The tables of `speed`.

use super::results::{ModelSpeeds, SpeedResults, ThreadsRun};
use crate::markdown::{count, table, two_decimals};
use crate::rays::{NAMES, View, recorded};
use crate::rivals::embree;
use std::collections::BTreeMap;

/// All tables of a report.
pub fn markdown(results: &SpeedResults) -> String {
    let mut text = String::new();
    if results.models.len() > 1 {
        for threads in results.threads() {
            text.push_str(&means(results, threads));
        }
    }
    for model in &results.models {
        text.push_str(&page(model));
    }
    text
}

/// Sets that have figures, in order.
pub(super) fn sets_of<'a>(models: impl Iterator<Item = &'a ModelSpeeds> + Clone) -> Vec<&'static str> {
    let names = NAMES.into_iter().chain(recorded::NAMES);
    names.filter(|set| models.clone().any(|m| m.rays.contains_key(set))).collect()
}

fn head(first: &str, sets: &[&str], more: &[&str]) -> Vec<String> {
    [first].iter().chain(sets).chain(more).map(|s| (*s).to_owned()).collect()
}

fn on_threads(threads: usize) -> String {
    if threads == 1 { "one thread".to_owned() } else { format!("{threads} threads") }
}

fn means(results: &SpeedResults, threads: usize) -> String {
    let sets = sets_of(results.models.iter());
    let tracers = results.tracers(threads);
    if !tracers.contains(&embree::NAME) {
        return String::new();
    }
    let row = |tracer: &&str| {
        let mean = |set: &&str| {
            let Some((ratio, models)) = results.mean_ratio(threads, tracer, set) else {
                return "-".to_owned();
            };
            // Of fewer models than the others: not comparable with them.
            let all = results.runs(threads).filter(|r| r.ratio(embree::NAME, set).is_some()).count();
            if models < all { format!("{ratio:.2} ({models})") } else { format!("{ratio:.2}") }
        };
        [(*tracer).to_owned()].into_iter().chain(sets.iter().map(mean)).collect()
    };
    let rows: Vec<Vec<String>> = tracers.iter().map(row).collect();
    format!(
        "## Speed over that of Embree's single rays, {}\n\nGeometric means over {} models; in brackets: over how many, if not all.\n\n{}\n",
        on_threads(threads),
        results.models.len(),
        table(&head("tracer", &sets, &[]), &rows)
    )
}

fn page(model: &ModelSpeeds) -> String {
    let view = match model.view {
        Some(View::Outside) => "seen from outside",
        Some(View::Inside) => "seen from inside",
        None => "rays of a renderer",
    };
    let mut text = format!("## {} ({} triangles, {view})\n\n", model.name, count(model.triangles as u64));
    let share = |s: &super::results::CompiledFile| {
        format!("{} {:.2} s, {:.0} % of the triangles in tets", s.name, s.compile_s, 100.0 * s.in_tets)
    };
    if !model.structures.is_empty() {
        let compiled: Vec<String> = model.structures.iter().map(share).collect();
        text.push_str(&format!("Compiled: {}.\n\n", compiled.join("; ")));
    }
    for (set, own) in &model.own_hits {
        let (rays, own) = (count(model.rays[set] as u64), count(*own as u64));
        text.push_str(&format!("- {set}: {own} of {rays} rays hit the triangle that they start on\n"));
    }
    if !model.own_hits.is_empty() {
        text.push('\n');
    }
    for run in &model.runs {
        text.push_str(&rates(model, run));
    }
    for left_out in &model.left_out {
        text.push_str(&format!("- {}: not measured: {}\n", left_out.name, left_out.why));
    }
    if !model.left_out.is_empty() {
        text.push('\n');
    }
    text
}

fn rates(model: &ModelSpeeds, run: &ThreadsRun) -> String {
    let sets = sets_of(std::iter::once(model));
    let recorded = model.view.is_none();
    let more: &[&str] =
        if recorded { &["B/tri", "build s", "differ", "other"] } else { &["B/tri", "build s", "differ"] };
    let mut rows: Vec<Vec<String>> = Vec::new();
    for tracer in &run.tracers {
        let mut row = vec![tracer.name.clone()];
        row.extend(sets.iter().map(|set| two_decimals(tracer.mrays_per_s.get(set).copied())));
        row.push(
            tracer.bytes.map_or("?".to_owned(), |b| format!("{:.0}", b as f64 / model.triangles as f64)),
        );
        row.push(two_decimals(Some(tracer.build_s)));
        let of_sets = |counts: &BTreeMap<_, usize>| match counts.values().sum::<usize>() {
            0 => String::new(),
            n => count(n as u64),
        };
        row.push(of_sets(&tracer.differ));
        if recorded {
            row.push(of_sets(&tracer.other));
        }
        rows.push(row);
    }
    let mut last = vec!["(rays)".to_owned()];
    last.extend(sets.iter().map(|set| count(model.rays[set] as u64)));
    last.extend(more.iter().map(|_| String::new()));
    rows.push(last);
    format!(
        "Mrays per {}, {}:\n\n{}\n",
        run.clock.second(),
        on_threads(run.threads),
        table(&head("tracer", &sets, more), &rows)
    )
}
