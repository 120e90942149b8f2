//! Run time and bytes against every kind of error, ours and rivals', on identical rays.
//!
//! `contenders` lists and builds what is compared, `aimed_rays` makes rays through vertices and edges, `exact_answers`
//! has the right answers, `defects` classifies the others, and `picture` measures how far an image is from the exact one.

pub mod aimed_rays;
mod charts;
mod contenders;
pub mod defects;
pub mod exact_answers;
pub mod picture;
pub mod results;
mod tables;

pub use charts::draw;
pub use tables::markdown;

use crate::args::Accuracy;
use crate::clock::Clock;
use crate::model::Model;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rounds::medians;
use crate::{isa, structures};
use aimed_rays::Target;
use anyhow::{Result, bail, ensure};
use bth::Isa;
use bth::rays::Hit;
use contenders::{MeasuredTracer, MeasuredTracers};
use defects::{Defects, ErrorQuantiles, Neighbours};
use exact_answers::Exact;
use picture::PictureSetup;
use results::{AIMED, AccuracyResults, Errors, ModelErrors, ORDINARY};
use serde_json::json;
use std::collections::BTreeMap;

/// Pixels of the pictures that are compared; a quick run has fewer.
const PICTURE: (u32, u32) = (512, 288);
/// Rays of a set in a quick run.
const QUICK_RAYS: usize = 2000;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written, and, when all is written, if one of our own
/// answers was wrong that has to be right.
pub fn run(arguments: &Accuracy) -> Result<()> {
    let names = contenders::names();
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
    let mut results = AccuracyResults { head, models: Vec::new() };
    let mut wrong = Vec::new();
    let progress = Progress::new();
    for which in &arguments.models.models {
        let model = Model::load(which)?;
        results.models.push(measure(&model, arguments, rays, rounds, &progress, &mut wrong)?);
    }
    drop(progress);
    for model in &results.models {
        for left_out in &model.left_out {
            note(&format!("{}: {}: not measured: {}", model.name, left_out.name, left_out.why));
        }
    }
    Report {
        head: &results.head,
        title: "Run time against error",
        body: markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: draw(&results),
    }
    .write(&arguments.output)?;
    ensure!(wrong.is_empty(), "wrong answers that have to be right: {}", wrong.join(", "));
    Ok(())
}

/// A ray set and its exact answers for each geometry.
struct AnsweredSet {
    set: RaySet,
    /// For each geometry.
    exact_answers: Vec<Vec<Exact>>,
}

impl AnsweredSet {
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
    progress.show(format!("{}: compiling the BVH", model.name));
    let bvh = structures::compile(model, &structures::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;
    let finder = Finder::new(model, &scene);
    let all = MeasuredTracers::build(model, &bvh, &arguments.tracers, progress)?;

    progress.show(format!("{}: making rays", model.name));
    let size = if arguments.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
    let (_, mut sets) =
        rays::sets(&finder, &rays::Options { size, most: rays, view: arguments.models.seen_from.view() });
    sets.retain(|set| ORDINARY.contains(&set.name));
    sets.extend([Target::Vertices, Target::Edges].map(|target| aimed_rays::set(model, target, rays)));
    let mut answered_sets = Vec::new();
    for set in sets.into_iter().filter(|set| !set.rays.is_empty()) {
        progress.show(format!("{}: exact answers to {}", model.name, set.name));
        let exact_answers =
            all.geometries.iter().map(|g| g.answers(&set, arguments.one_in)).collect::<Result<_>>()?;
        answered_sets.push(AnsweredSet { set, exact_answers });
    }

    let mut times: Vec<BTreeMap<&'static str, f64>> = vec![BTreeMap::new(); all.tracers.len()];
    for answered_set in &answered_sets {
        progress.show(format!("{}: timing {}", model.name, answered_set.set.name));
        for (times, seconds) in times.iter_mut().zip(time(&all.tracers, &answered_set.set, rounds)) {
            let count = answered_set.set.rays.len() as f64;
            times.extend(seconds.map(|s| (answered_set.set.name, s * 1e9 / count)));
        }
    }
    let picture_setup =
        PictureSetup::new(&finder, model, if arguments.quick { rays::QUICK_PICTURE_SIZE } else { PICTURE });
    let expected = picture_setup.draw(model, &all.geometries[0]);
    let mut rows = Vec::new();
    for (tracer, nanoseconds) in all.tracers.iter().zip(times) {
        progress.show(format!("{}: errors of {}", model.name, tracer.name));
        let mut errors = errors(model, tracer, &all, &answered_sets)?;
        errors.nanoseconds = nanoseconds;
        let picture = picture_setup.draw(model, &*tracer.contender.tracer);
        errors.rmse = expected.rmse(&picture);
        errors.dissimilarity = expected.dissimilarity(&picture);
        if tracer.exact && errors.ordinary.all() + errors.aimed.all() > 0 {
            wrong.push(format!("{} on {}", tracer.name, model.name));
        }
        rows.push(errors);
    }
    Isa::best().choose()?;
    let rays = answered_sets.iter().map(|q| (q.set.name, q.set.rays.len())).collect();
    Ok(ModelErrors {
        name: model.name.clone(),
        triangles: model.triangles(),
        rays,
        tracers: rows,
        left_out: all.left_out,
    })
}

/// Seconds that the nearest hits of a set take, in interleaved rounds.
fn time(tracers: &[MeasuredTracer], set: &RaySet, rounds: usize) -> Vec<Option<f64>> {
    let clock = Clock::for_threads(1);
    let mut hits = vec![Hit::MISS; set.rays.len()];
    medians(tracers, rounds, |_, tracer| {
        tracer.isa.map_or(Ok(()), Isa::choose).ok()?;
        Some(clock.time(|| tracer.contender.nearest(set.batch(), &mut hits, 1, 1)))
    })
}

/// Everything but run time and picture.
fn errors(
    model: &Model,
    tracer: &MeasuredTracer,
    all: &MeasuredTracers,
    answered_sets: &[AnsweredSet],
) -> Result<Errors> {
    tracer.isa.map_or(Ok(()), Isa::choose)?;
    let neighbours = Neighbours(&model.mesh.triangles);
    let [mut ordinary, mut aimed] = [Defects::default(); 2];
    let [mut relative, mut ulp] = [Vec::new(), Vec::new()];
    for answered_set in answered_sets {
        let rays = &answered_set.set.rays;
        let mut hits = vec![Hit::MISS; rays.len()];
        tracer.contender.nearest(answered_set.set.batch(), &mut hits, 1, 1);
        let geometry = &all.geometries[tracer.geometry];
        let truth = &answered_set.exact_answers[tracer.geometry];
        let found = defects::defects(geometry, &neighbours, rays, truth, &hits);
        if answered_set.is_aimed() { &mut aimed } else { &mut ordinary }.add(&found);
        // Errors of t are relative to the source, so that moved vertices count as errors.
        let [r, u] = defects::errors_of_t(&neighbours, &answered_set.exact_answers[0], &hits);
        relative.extend(r);
        ulp.extend(u);
    }
    let bytes = tracer.contender.bytes;
    Ok(Errors {
        name: tracer.name.clone(),
        group: tracer.group,
        bytes_per_triangle: bytes.map(|bytes| bytes as f64 / model.triangles() as f64),
        nanoseconds: BTreeMap::new(),
        ordinary,
        aimed,
        t_relative: ErrorQuantiles::of(relative),
        t_ulp: ErrorQuantiles::of(ulp),
        rmse: 0.0,
        dissimilarity: 0.0,
    })
}
