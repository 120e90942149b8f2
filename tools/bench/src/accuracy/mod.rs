//! Run time and bytes against every kind of error, ours and rivals', on identical rays.
//!
//! `truth` has the exact answers, `judge` compares, `aimed` makes the rays that tracers lose and `picture` what a
//! person would see of it all; `subjects` are compared.

pub mod aimed;
mod charts;
pub mod judge;
pub mod picture;
pub mod record;
mod subjects;
mod tables;
pub mod truth;

pub use charts::draw;
pub use tables::markdown;

use crate::args::Accuracy;
use crate::clock::Clock;
use crate::model::Model;
use crate::output::{Head, Record, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rounds::medians;
use crate::{isa, ours};
use aimed::Target;
use anyhow::{Result, bail, ensure};
use bth::Isa;
use bth::rays::Hit;
use judge::{Defects, Neighbours, Spread};
use picture::Motif;
use record::{AIMED, AccuracyRecord, Errors, ModelErrors, ORDINARY};
use serde_json::json;
use std::collections::BTreeMap;
use subjects::{Subject, Subjects};
use truth::Exact;

/// Pixels of the cameras that rays are taken from, and of the pictures; a quick run has fewer.
const SIZE: (u32, u32) = (1024, 576);
const PICTURE: (u32, u32) = (512, 288);
const QUICK_SIZE: (u32, u32) = (128, 72);
/// Rays of a set in a quick run.
const QUICK_RAYS: usize = 2000;

/// Measures, prints and writes the record.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written, and, when all is written, if one of our own
/// answers was wrong that has to be right.
pub fn run(arguments: &Accuracy) -> Result<()> {
    let names = subjects::names();
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    if let Some(name) = arguments.tracers.unknown(&known).first() {
        bail!("--tracer {name}: there are {}", names.join(", "));
    }
    isa::select(None)?;
    let available: Vec<String> =
        Isa::ALL.iter().filter(|isa| isa.is_available()).map(Isa::to_string).collect();
    let rounds = if arguments.quick { 1 } else { arguments.rounds };
    let rays = if arguments.quick { QUICK_RAYS } else { arguments.rays };
    let options = json!({ "rays": rays, "rounds": rounds, "one_in": arguments.one_in });
    let head = Head::now("accuracy", available.join(", "), options);
    let mut record = AccuracyRecord { head, models: Vec::new() };
    let mut wrong = Vec::new();
    let progress = Progress::new();
    for which in &arguments.models.models {
        let model = Model::load(which)?;
        record.models.push(measure(&model, arguments, rays, rounds, &progress, &mut wrong)?);
    }
    drop(progress);
    for model in &record.models {
        for left_out in &model.left_out {
            note(&format!("{}: {}: not measured: {}", model.name, left_out.name, left_out.why));
        }
    }
    Record {
        head: &record.head,
        title: "Run time against error",
        body: markdown(&record),
        json: serde_json::to_value(&record)?,
        charts: draw(&record),
    }
    .write(&arguments.output)?;
    ensure!(wrong.is_empty(), "wrong answers that have to be right: {}", wrong.join(", "));
    Ok(())
}

/// A set, its exact answers by geometry, and whether it is aimed.
struct Question {
    set: RaySet,
    truths: Vec<Vec<Exact>>,
}

impl Question {
    fn is_aimed(&self) -> bool {
        AIMED.contains(&self.set.name)
    }
}

fn measure(
    model: &Model,
    arguments: &Accuracy,
    rays: usize,
    rounds: usize,
    progress: &Progress,
    wrong: &mut Vec<String>,
) -> Result<ModelErrors> {
    progress.say(format!("{}: compiling the BVH", model.name));
    let bvh = ours::compile(model, &ours::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;
    let finder = Finder::new(model, &scene);
    let all = Subjects::build(model, &bvh, &arguments.tracers, progress)?;

    progress.say(format!("{}: making rays", model.name));
    let size = if arguments.quick { QUICK_SIZE } else { SIZE };
    let (_, mut sets) =
        rays::sets(&finder, &rays::Options { size, most: rays, view: arguments.models.view() });
    sets.retain(|set| ORDINARY.contains(&set.name));
    sets.extend([Target::Vertices, Target::Edges].map(|target| aimed::set(model, target, rays)));
    let mut questions = Vec::new();
    for set in sets.into_iter().filter(|set| !set.rays.is_empty()) {
        progress.say(format!("{}: exact answers to {}", model.name, set.name));
        let truths =
            all.geometries.iter().map(|g| g.answers(&set, arguments.one_in)).collect::<Result<_>>()?;
        questions.push(Question { set, truths });
    }

    let mut times: Vec<BTreeMap<&'static str, f64>> = vec![BTreeMap::new(); all.subjects.len()];
    for question in &questions {
        progress.say(format!("{}: timing {}", model.name, question.set.name));
        for (times, seconds) in times.iter_mut().zip(time(&all.subjects, &question.set, rounds)) {
            let count = question.set.rays.len() as f64;
            times.extend(seconds.map(|s| (question.set.name, s * 1e9 / count)));
        }
    }
    let motif = Motif::new(&finder, model, if arguments.quick { QUICK_SIZE } else { PICTURE });
    let expected = motif.draw(model, &all.geometries[0]);
    let mut tracers = Vec::new();
    for (subject, nanoseconds) in all.subjects.iter().zip(times) {
        progress.say(format!("{}: errors of {}", model.name, subject.name));
        let mut errors = errors(model, subject, &all, &questions)?;
        errors.nanoseconds = nanoseconds;
        let picture = motif.draw(model, &*subject.contender.tracer);
        errors.rmse = expected.rmse(&picture);
        errors.dissimilarity = expected.dissimilarity(&picture);
        if subject.exact && errors.ordinary.all() + errors.aimed.all() > 0 {
            wrong.push(format!("{} on {}", subject.name, model.name));
        }
        tracers.push(errors);
    }
    Isa::best().choose()?;
    let rays = questions.iter().map(|q| (q.set.name, q.set.rays.len())).collect();
    Ok(ModelErrors {
        name: model.name.clone(),
        triangles: model.triangles(),
        rays,
        tracers,
        left_out: all.left_out,
    })
}

/// Seconds that the nearest hits of a set take, in interleaved rounds.
fn time(subjects: &[Subject], set: &RaySet, rounds: usize) -> Vec<Option<f64>> {
    let clock = Clock::for_threads(1);
    let mut hits = vec![Hit::MISS; set.rays.len()];
    medians(subjects, rounds, |_, subject| {
        subject.isa.map_or(Ok(()), Isa::choose).ok()?;
        Some(clock.time(|| subject.contender.nearest(set.batch(), &mut hits, 1)))
    })
}

/// Everything but run time and picture.
fn errors(model: &Model, subject: &Subject, all: &Subjects, questions: &[Question]) -> Result<Errors> {
    subject.isa.map_or(Ok(()), Isa::choose)?;
    let neighbours = Neighbours(&model.mesh.triangles);
    let [mut ordinary, mut aimed] = [Defects::default(); 2];
    let [mut relative, mut ulp] = [Vec::new(), Vec::new()];
    for question in questions {
        let rays = &question.set.rays;
        let mut hits = vec![Hit::MISS; rays.len()];
        subject.contender.nearest(question.set.batch(), &mut hits, 1);
        let geometry = &all.geometries[subject.geometry];
        let truth = &question.truths[subject.geometry];
        let found = judge::defects(geometry, &neighbours, rays, truth, &hits);
        if question.is_aimed() { &mut aimed } else { &mut ordinary }.add(&found);
        // Displacement of the stored triangles shows against the source.
        let [r, u] = judge::errors_of_t(&neighbours, &question.truths[0], &hits);
        relative.extend(r);
        ulp.extend(u);
    }
    let bytes = subject.contender.bytes;
    Ok(Errors {
        name: subject.name.clone(),
        group: subject.group,
        bytes_per_triangle: bytes.map(|bytes| bytes as f64 / model.triangles() as f64),
        nanoseconds: BTreeMap::new(),
        ordinary,
        aimed,
        t_relative: Spread::of(relative),
        t_ulp: Spread::of(ulp),
        rmse: 0.0,
        dissimilarity: 0.0,
    })
}
