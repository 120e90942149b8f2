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

/// Unit of the speed of rays from exact starts, relative to the same file and to rays that start a little off the surface.
const BESIDE: &str = "times beside";

/// Millions of rays per second that are traced as usual and start a little off the surface, for a tracer that takes exact starts.
fn rate_beside(run: &ThreadsRun, tracer: &str, set: &str) -> Option<f64> {
    let base = tracer.replace(" start", "");
    let other = run.tracers.iter().find(|t| t.name == base && t.name != tracer)?;
    other.mrays_per_s.get(format!("{set}-beside").as_str()).copied()
}

/// Tracer, whether it is ours, set, threads and unit; and the ratios of the models.
type Ratios<'a> = ((&'a str, bool, &'a str, usize, &'a str), Vec<f64>);

/// Rays per second and bytes of every tracer, what exact starts take, and means over the models.
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
    let mut ratios: Vec<Ratios> = Vec::new();
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
                    let beside = rate_beside(run, name, set).map(|other| speed / other);
                    rows.extend(beside.map(|x| row(name, ours, &model.name, set, run.threads, x, BESIDE)));
                    let embree = base.and_then(|base| base.mrays_per_s.get(set)).map(|other| speed / other);
                    for (unit, ratio) in [("times embree", embree), (BESIDE, beside)] {
                        let Some(ratio) = ratio else { continue };
                        let of = (name, ours, *set, run.threads, unit);
                        match ratios.iter_mut().find(|(key, _)| *key == of) {
                            Some((_, found)) => found.push(ratio),
                            None => ratios.push((of, vec![ratio])),
                        }
                    }
                }
            }
        }
    }
    for ((name, ours, set, threads, unit), ratios) in ratios {
        let least = ratios.iter().copied().reduce(f64::min);
        let greatest = ratios.iter().copied().reduce(f64::max);
        let Some(mean) = geometric_mean(ratios) else { continue };
        let mean = row(name, ours, "mean", set, threads, mean, unit);
        rows.push(Row { low: least, high: greatest, ..mean });
    }
    rows
}
