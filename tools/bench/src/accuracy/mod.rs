//! Run time and bytes against every kind of error, ours and rivals', on identical rays.
//!
//! `aimed_rays` makes rays through vertices and edges, `exact_answers` has the right answers, and
//! `defects` classifies the others.

pub(crate) mod aimed_rays;
mod defects;
mod exact_answers;

use crate::args::{Models, RunOptions, at_least_one};
use crate::clock::Clock;
use crate::contenders;
use crate::isa;
use crate::model::Model;
use crate::names::Names;
use crate::output::progress;
use crate::rays::{self, Finder, RaySet};
use crate::report::{Head, Report};
use crate::rivals::RIVALS;
use crate::rounds::medians;
use crate::structures::{self, KINDS, Kind};
use crate::tracer::{Answers, Contender};
use aimed_rays::Target;
use anyhow::Result;
use bth::rays::Hit;
use clap::Args;
use defects::{KINDS as DEFECTS, Neighbours, quantile};
use exact_answers::{Exact, Geometry};
use serde_json::json;

/// `accuracy`.
#[derive(Debug, Args)]
pub(crate) struct Accuracy {
    #[command(flatten)]
    pub(crate) models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 50_000, value_parser = at_least_one)]
    pub(crate) rays: usize,
    /// Rounds, after one that warms up; the median counts.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Only these tracers; a star at the end matches any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) tracers: Names,
    /// One of this many rays is compared with every triangle in exact arithmetic.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = at_least_one)]
    pub(crate) one_in: usize,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
CPU time for the nearest hit, medians of interleaved rounds. Wrong answers, for ordinary rays and for rays aimed exactly at \
vertices and middles of edges, by exact arithmetic. `false_misses`: nothing was \
found; `leaks`: the nearest triangle was passed through; `ghosts`: a triangle that the ray does not hit; `wrong_neighbours`: \
the same, but it shares a vertex with the right one. `error of t`: against the source, over all sets.";

/// Ordinary sets: the run time of a tracer is the geometric mean over these.
const ORDINARY: [&str; 3] = ["primary", "diffuse-beside", "random"];
/// Rays of a set in a quick run.
const QUICK_RAYS: usize = 2000;

/// The structures that are measured; free directions serve only rays from starts.
fn kinds() -> Vec<Kind> {
    KINDS.into_iter().filter(|kind| !kind.is_free()).collect()
}

/// Measures all models.
pub(crate) fn measure(arguments: &Accuracy) -> Result<Report> {
    let names: Vec<&str> =
        kinds().iter().map(|kind| kind.name).chain(RIVALS.iter().map(|r| r.name)).collect();
    arguments.tracers.check("--tracer", &names)?;
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let rays = if arguments.run.quick { QUICK_RAYS } else { arguments.rays };
    let options = json!({ "rays": rays, "rounds": rounds, "one_in": arguments.one_in });
    let mut report = Report::new(Head::now("accuracy", isa, options), rounds, ABOUT);
    for which in &arguments.models.models {
        let model = Model::load(which)?;
        measure_model(&model, arguments, rays, &names, &mut report)?;
    }
    for unit in ["ns/ray", "B/triangle"] {
        report.add_means(unit);
    }
    Ok(report)
}

/// A ray set and its exact answers.
type AnsweredSet = (RaySet, Vec<Exact>);

fn measure_model(
    model: &Model,
    arguments: &Accuracy,
    rays: usize,
    names: &[&str],
    report: &mut Report,
) -> Result<()> {
    progress(format!("{}: compiling the BVH", model.name));
    let bvh = structures::compile(model, &structures::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;
    let finder = Finder::new(model, &scene);
    let mut tracers = contenders::build(model, &kinds(), &bvh, &arguments.tracers, 1, report)?;
    tracers.retain(|tracer| names.contains(&&*tracer.name));
    let geometry = Geometry::new(&bvh.bytes)?;

    progress(format!("{}: making rays", model.name));
    let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
    let options = rays::Options { size, most: rays, view: arguments.models.view };
    let (_, mut sets) = rays::sets(&finder, &options);
    sets.retain(|set| ORDINARY.contains(&set.name));
    sets.extend([Target::Vertices, Target::Edges].map(|target| aimed_rays::set(model, target, rays)));
    let mut answered_sets = Vec::new();
    for set in sets.into_iter().filter(|set| !set.rays.is_empty()) {
        progress(format!("{}: exact answers to {}", model.name, set.name));
        let exact = geometry.answers(&set, arguments.one_in)?;
        answered_sets.push((set, exact));
    }
    for (set, _) in &answered_sets {
        progress(format!("{}: timing {}", model.name, set.name));
        let mut answers = Answers::empty(false, set.rays.len());
        let seconds = medians(&tracers, report.rounds, |_, tracer| {
            Some(Clock::ThreadCpu.time(|| answers.trace(&*tracer.tracer, set.batch())))
        });
        for (tracer, seconds) in tracers.iter().zip(seconds) {
            let ns = seconds.unwrap_or(f64::NAN) * 1e9 / set.rays.len() as f64;
            report.add(&tracer.subject(model, 1), set.name, ns, "ns/ray");
        }
    }
    for tracer in &tracers {
        progress(format!("{}: errors of {}", model.name, tracer.name));
        add_errors(model, tracer, &geometry, &answered_sets, report);
    }
    contenders::add_sizes(report, model, 1, &tracers);
    Ok(())
}

/// Adds wrong answers and errors of t.
fn add_errors(
    model: &Model,
    tracer: &Contender,
    geometry: &Geometry,
    answered_sets: &[AnsweredSet],
    report: &mut Report,
) {
    let of = tracer.subject(model, 1);
    let neighbours = Neighbours(&model.mesh.triangles);
    let (mut counts, mut rays) = ([[0; 4]; 2], [0; 2]);
    let [mut relative, mut ulp] = [Vec::new(), Vec::new()];
    for (set, exact) in answered_sets {
        let mut hits = vec![Hit::MISS; set.rays.len()];
        tracer.tracer.nearest(set.batch(), &mut hits);
        let aimed = usize::from(!ORDINARY.contains(&set.name));
        rays[aimed] += set.rays.len();
        defects::count(&mut counts[aimed], geometry, &neighbours, &set.rays, exact, &hits);
        let [r, u] = defects::errors_of_t(&neighbours, exact, &hits);
        relative.extend(r);
        ulp.extend(u);
    }
    for ((name, counts), rays) in ["ordinary", "aimed"].into_iter().zip(counts).zip(rays) {
        for (kind, count) in DEFECTS.into_iter().zip(counts) {
            let per_million = count as f64 * 1e6 / rays.max(1) as f64;
            report.add(&of, &format!("{kind} {name}"), per_million, "per million rays");
            if tracer.ours && count > 0 {
                report.wrong.push(format!("{} on {}: {kind}", tracer.name, model.name));
            }
        }
    }
    report.add(&of, "error of t 99 %", quantile(relative, 0.99), "relative");
    report.add(&of, "error of t worst", quantile(ulp, 1.0), "ulp");
}
