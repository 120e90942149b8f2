//! Measures what a definition names.

use super::definition::{Definition, Measurement};
use super::row::Row;
use crate::args::{Models, RunOptions, SeenFrom, Speed};
use crate::machine;
use crate::names::Names;
use crate::output::note;
use crate::rivals::embree;
use crate::rounds::geometric_mean;
use crate::speed::{self, SpeedResults, ThreadsRun};
use anyhow::{Result, bail};
use std::path::Path;

/// The rows of a definition, measured now.
///
/// # Errors
/// If a model or name of the definition cannot be used, or it is not measured by this program.
pub(super) fn measure(definition: &Definition, models: &Path, quick: bool) -> Result<Vec<Row>> {
    match definition.measurement {
        Measurement::Speed => {}
        Measurement::External => {
            bail!("{}: rows are entered by hand: {}", definition.benchmark, definition.about)
        }
    }
    let model = |name: &String| {
        let file = models.join(name);
        if file.exists() {
            return Some(file.to_string_lossy().into_owned());
        }
        if name.ends_with('/') {
            note(&format!(
                "{name}: no such folder of recorded rays: skipped (tools/bench/record_rays/run makes it)"
            ));
            return None;
        }
        Some(name.clone())
    };
    let models: Vec<String> = definition.models.iter().filter_map(model).collect();
    if models.is_empty() {
        return Ok(Vec::new());
    }
    let names = |names: &[String]| names.join(",").parse::<Names>().unwrap_or_default();
    let arguments = Speed {
        models: Models { models, seen_from: SeenFrom::default() },
        rays: definition.rays,
        rounds: definition.rounds,
        threads: definition.threads.clone(),
        tracers: names(&definition.tracers),
        sets: names(&definition.sets),
        run: RunOptions { quick, ..RunOptions::default() },
    };
    Ok(rows_of_speed(&definition.benchmark, definition.rounds, &speed::measure(&arguments)?))
}

/// Unit of the speed of rays that say where they start, relative to the same rays through the same file that do not.
const UNHINTED: &str = "times unhinted";

/// Millions of rays per second of the tracer that is told nothing and else is the same, for a tracer that is told where rays start.
fn rate_without_hints(run: &ThreadsRun, tracer: &str, set: &str) -> Option<f64> {
    let base = tracer.strip_suffix(" from")?;
    run.tracers.iter().find(|t| t.name == base)?.mrays_per_s.get(set).copied()
}

/// Rays per second and bytes of every tracer, what hints are worth, and means over the models relative to Embree where it was measured.
fn rows_of_speed(benchmark: &str, rounds: usize, record: &SpeedResults) -> Vec<Row> {
    let commit = record.head.commit.clone().or_else(machine::commit).unwrap_or_else(|| "?".to_owned());
    let commit = commit.split(' ').next().unwrap_or("?").to_owned();
    let row =
        |engine: &str, ours: bool, model: &str, set: &str, threads: usize, value: f64, unit: &str| Row {
            commit: commit.clone(),
            benchmark: benchmark.to_owned(),
            engine: engine.to_owned(),
            model: model.to_owned(),
            set: set.to_owned(),
            threads,
            isa: if ours { record.head.isa.clone() } else { "-".to_owned() },
            value,
            unit: unit.to_owned(),
            low: None,
            high: None,
            rounds,
        };
    let mut rows = Vec::new();
    let mut ratios: Vec<(String, bool, String, usize, Vec<f64>)> = Vec::new();
    for model in &record.models {
        for run in &model.runs {
            let base = run.tracers.iter().find(|t| t.name == embree::NAME);
            for tracer in &run.tracers {
                let (name, ours) = (tracer.name.as_str(), tracer.ours);
                if let Some(bytes) = tracer.bytes {
                    let each = bytes as f64 / model.triangles as f64;
                    rows.push(row(name, ours, &model.name, "bytes", run.threads, each, "B/triangle"));
                }
                for (set, speed) in &tracer.mrays_per_s {
                    rows.push(row(name, ours, &model.name, set, run.threads, *speed, "Mrays/s"));
                    if let Some(without) = rate_without_hints(run, name, set) {
                        let gain = speed / without;
                        rows.push(row(name, ours, &model.name, set, run.threads, gain, UNHINTED));
                    }
                    let Some(other) = base.and_then(|base| base.mrays_per_s.get(set)) else { continue };
                    let of = |r: &&mut (String, bool, String, usize, Vec<f64>)| {
                        r.0 == name && r.2 == *set && r.3 == run.threads
                    };
                    match ratios.iter_mut().find(of) {
                        Some(found) => found.4.push(speed / other),
                        None => {
                            let first = vec![speed / other];
                            ratios.push((name.to_owned(), ours, (*set).to_owned(), run.threads, first));
                        }
                    }
                }
            }
        }
    }
    for (name, ours, set, threads, ratios) in ratios {
        let least = ratios.iter().copied().reduce(f64::min);
        let greatest = ratios.iter().copied().reduce(f64::max);
        let Some(mean) = geometric_mean(ratios) else { continue };
        let mean = row(&name, ours, "mean", &set, threads, mean, "times embree");
        rows.push(Row { low: least, high: greatest, ..mean });
    }
    rows
}
