//! Rays per second of our structures and the rivals, on identical rays.

use crate::args::{Models, RunOptions, at_least_one};
use crate::clock::Clock;
use crate::contenders;
use crate::isa;
use crate::model::Model;
use crate::names::Names;
use crate::output::progress;
use crate::rays::{self, Finder, RaySet, recorded};
use crate::records::Row;
use crate::report::{Head, Report};
use crate::rivals::{RIVALS, embree};
use crate::rounds::medians;
use crate::structures::{self, KINDS, Use};
use crate::tracer::{Answers, Contender, Starting};
use anyhow::Result;
use clap::Args;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// `speed`.
#[derive(Debug, Args)]
pub(crate) struct Speed {
    #[command(flatten)]
    pub(crate) models: Models,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = at_least_one)]
    pub(crate) rays: usize,
    /// Rounds, after one that warms up; the median counts.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Numbers of threads to trace on: CPU time is measured for 1, wall-clock time for more.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1", value_parser = at_least_one)]
    pub(crate) threads: Vec<usize>,
    /// Only these tracers; a star at the end matches any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) tracers: Names,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) sets: Names,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
`Mrays/s`: million rays per second, of CPU time for one thread, of the wall clock for more; medians of interleaved \
rounds. `times embree`: speed relative to Embree's single rays. `times beside`: speed of rays from exact starts \
relative to the same file and rays that start a little off the surface. `differ`: answers that are not the plain \
BVH's, for ours in any bit, for rivals in hit or miss. `bytes`: what traversal reads.";

/// Unit of rates.
const RATE: &str = "Mrays/s";
/// Unit of the speed of rays from exact starts relative to rays that start a little off the
/// surface.
const BESIDE: &str = "times beside";

/// Measures all models.
pub(crate) fn measure(arguments: &Speed) -> Result<Report> {
    check_names(arguments)?;
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let options = json!({
        "rays": arguments.rays, "rounds": rounds, "quick": arguments.run.quick, "rays_per_batch": structures::BATCH,
    });
    let mut report = Report::new(Head::now("speed", isa, options), rounds, ABOUT);
    for which in &arguments.models.models {
        measure_model(which, arguments, &mut report)?;
    }
    add_beside(&mut report);
    report.add_means(BESIDE);
    report.add_ratios(embree::NAME, RATE);
    Ok(report)
}

fn check_names(arguments: &Speed) -> Result<()> {
    let own = KINDS.iter().flat_map(|k| k.uses().map(|(name, _)| name));
    let all: Vec<String> = own.chain(RIVALS.iter().map(|r| r.name.to_owned())).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    arguments.tracers.check("--tracer", &all)?;
    let sets = [rays::NAMES.as_slice(), &recorded::NAMES].concat();
    arguments.sets.check("--set", &sets)
}

fn measure_model(which: &str, arguments: &Speed, report: &mut Report) -> Result<()> {
    let model = Model::load(which)?;
    progress(format!("{}: compiling the BVH", model.name));
    let bvh = structures::compile(&model, &structures::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;

    progress(format!("{}: making rays", model.name));
    let mut sets = if Path::new(which).is_dir() {
        recorded::sets(Path::new(which), &model, arguments.rays)?
    } else {
        let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
        let options = rays::Options { size, most: arguments.rays, view: arguments.models.view };
        let (view, sets) = rays::sets(&Finder::new(&model, &scene), &options);
        report.notes.push(format!("{}: {} triangles, seen from {view:?}", model.name, model.triangles()));
        sets
    };
    sets.retain(|s| arguments.sets.select(s.name) && s.rays.len() >= rays::FEWEST_TIMED);
    let expected = sets.iter().map(|set| Expected::new(&bvh.bytes, set)).collect::<Result<Vec<_>>>()?;
    let counts: Vec<String> = sets.iter().map(|set| format!("{} {}", set.rays.len(), set.name)).collect();
    report.notes.push(format!("{}: rays: {}", model.name, counts.join(", ")));

    let most_threads = arguments.threads.iter().copied().max().unwrap_or(1);
    let contenders = contenders::build(&model, &KINDS, &bvh, &arguments.tracers, most_threads, report)?;
    for &threads in &arguments.threads {
        for (set, expected) in sets.iter().zip(&expected) {
            progress(format!("{}: {} on {threads} thread(s)", model.name, set.name));
            let measured = measure_set(set, expected, &contenders, report.rounds, threads);
            for (contender, [rate, differ]) in contenders.iter().zip(measured) {
                let of = contender.subject(&model, threads);
                for (what, value, unit) in [("", rate, RATE), (" differ", differ, "rays")] {
                    if value > 0.0 {
                        report.add(&of, &format!("{}{what}", set.name), value, unit);
                    }
                }
                if contender.ours && differ > 0.0 {
                    report.wrong.push(format!("{} on {}, {}", contender.name, model.name, set.name));
                }
            }
        }
        contenders::add_sizes(report, &model, threads, &contenders);
    }
    Ok(())
}

/// Shortest round on several threads, in seconds, so that starting the threads takes little of it.
const SHORTEST_ROUND: f64 = 0.1;

/// Million rays per second of each contender (0 if it does not trace the set), and answers that are
/// not the expected ones.
fn measure_set(
    set: &RaySet,
    expected: &Expected,
    contenders: &[Contender],
    rounds: usize,
    threads: usize,
) -> Vec<[f64; 2]> {
    let clock = Clock::for_threads(threads);
    let mut answers = Answers::empty(set.any, set.rays.len());
    // What the first round, which does not count, finds: differences, and how often the rays are
    // traced in other rounds.
    let mut first: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let times = medians(contenders, rounds, |round, contender| {
        let starting = contender.tracer.starting();
        let needs_starts = matches!(starting, Starting::RejectOwn | Starting::OnSurface);
        if needs_starts && set.starts.is_none() {
            return None;
        }
        let passes = first.get(&contender.name).map_or(1, |(_, passes)| *passes);
        let seconds = clock.time(|| contender.trace(set.batch(), &mut answers, threads, passes));
        if round == 0 {
            let is_timed = threads > 1 && rounds > 1;
            let passes = if is_timed { (SHORTEST_ROUND / seconds).ceil().max(1.0) as usize } else { 1 };
            let differ = expected.of(starting).differences(&answers, contender.ours);
            first.insert(contender.name.clone(), (differ, passes));
        }
        Some(seconds / passes as f64)
    });
    let figures = contenders.iter().zip(times).map(|(contender, seconds)| {
        let differ = first.get(&contender.name).map_or(0, |(differ, _)| *differ);
        [seconds.map_or(0.0, |seconds| set.rays.len() as f64 / seconds / 1e6), differ as f64]
    });
    figures.collect()
}

/// Adds the speed of exact starts relative to rays that start a little off the surface.
fn add_beside(report: &mut Report) {
    let rates = || report.rows.iter().filter(|row| row.unit == RATE);
    let ratios = rates().filter_map(|row| {
        let (base, set) = (row.engine.replace(" start", ""), format!("{}-beside", row.set));
        let is_base =
            |r: &&Row| r.engine == base && r.set == set && r.model == row.model && r.threads == row.threads;
        let other = rates().filter(|_| base != row.engine).find(is_base)?;
        Some(Row { value: row.value / other.value, unit: BESIDE.to_owned(), ..row.clone() })
    });
    let ratios: Vec<_> = ratios.collect();
    report.rows.extend(ratios);
}

/// The exact answers to a set: from the origins of its rays, in f32 and in f64; and if it has
/// starts, without hits on the triangle there, and from the exact starts.
struct Expected {
    at_origin: Answers,
    in_f64: Answers,
    others: Option<[Answers; 2]>,
}

impl Expected {
    fn new(bvh: &[u8], set: &RaySet) -> Result<Expected> {
        let of = |usage| -> Result<Answers> {
            let mut answers = Answers::empty(set.any, set.rays.len());
            answers.trace(&*structures::tracer(bvh, usage)?, set.batch());
            Ok(answers)
        };
        let others = match set.starts {
            Some(_) => Some([of(Use::Own)?, of(Use::StartSingle)?]),
            None => None,
        };
        Ok(Expected { at_origin: of(Use::Batch)?, in_f64: of(Use::WideSingle)?, others })
    }

    /// The answers that a tracer has to give.
    fn of(&self, starting: Starting) -> &Answers {
        match (starting, &self.others) {
            (Starting::RejectOwn, Some([without_own, _])) => without_own,
            (Starting::OnSurface, Some([_, on_surface])) => on_surface,
            (Starting::InF64, _) => &self.in_f64,
            _ => &self.at_origin,
        }
    }
}
