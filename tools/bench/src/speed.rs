//! Rays per second of our structures and the rivals, on identical rays.

use crate::args::{Models, RunOptions, at_least_one};
use crate::clock::Clock;
use crate::contenders;
use crate::isa;
use crate::model::Model;
use crate::names::Names;
use crate::progress;
use crate::rays::{self, Finder, RaySet, recorded};
use crate::records::Row;
use crate::report::{Head, Report};
use crate::rivals::{RIVALS, embree};
use crate::rounds::medians;
use crate::structures::{self, KINDS, Use};
use crate::tracer::{Answers, Contender, Starting};
use anyhow::{Result, bail};
use bth::rays::Start;
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
    /// Rounds of which the median counts; one more comes before and warms up.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Numbers of threads to trace on: CPU time is measured for 1, wall-clock time for more.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1", value_parser = at_least_one)]
    pub(crate) threads: Vec<usize>,
    /// Only these tracers; a star at the end stands for any ending.
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
BVH's, for ours in any bit, for rivals in hit or miss. `other`: nearest hits of a renderer's rays on another triangle. \
`bytes`: what traversal reads.";

/// Unit of rates.
const RATE: &str = "Mrays/s";
/// Unit of the speed of rays from exact starts relative to rays that start a little off the surface.
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
    if let Some(name) = arguments.tracers.unknown(&all).first() {
        bail!("--tracer {name}: there are {}", all.join(", "));
    }
    let sets = [rays::NAMES.as_slice(), &recorded::NAMES].concat();
    if let Some(name) = arguments.sets.unknown(&sets).first() {
        bail!("--set {name}: there are {}", sets.join(", "));
    }
    Ok(())
}

fn measure_model(which: &str, arguments: &Speed, report: &mut Report) -> Result<()> {
    let model = Model::load(which)?;
    progress::show(format!("{}: compiling the BVH", model.name));
    let bvh = structures::compile(&model, &structures::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;

    progress::show(format!("{}: making rays", model.name));
    let is_recorded = Path::new(which).is_dir();
    let mut sets = if is_recorded {
        recorded::sets(Path::new(which), &model, &scene, arguments.rays)?
    } else {
        let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
        let options = rays::Options { size, most: arguments.rays, view: arguments.models.seen_from.view() };
        let (view, sets) = rays::sets(&Finder::new(&model, &scene), &options);
        report.notes.push(format!("{}: {} triangles, seen from {view}", model.name, model.triangles()));
        sets
    };
    sets.retain(|s| arguments.sets.select(s.name) && s.rays.len() >= rays::FEWEST_TIMED);
    let expected = sets.iter().map(|set| Expected::new(&bvh.bytes, set)).collect::<Result<Vec<_>>>()?;
    for (set, expected) in sets.iter().zip(&expected) {
        let own = set.starts.as_ref().map_or(0, |starts| expected.own_hits(starts));
        let text = format!("{}: {}: {} rays", model.name, set.name, set.rays.len());
        let own = if own > 0 {
            format!(", {own} of which hit only their own triangle or hit it first")
        } else {
            String::new()
        };
        report.notes.push(text + &own);
    }

    let most_threads = arguments.threads.iter().copied().max().unwrap_or(1);
    let contenders = contenders::build(&model, &KINDS, &bvh, &arguments.tracers, most_threads, report)?;
    for &threads in &arguments.threads {
        for (set, expected) in sets.iter().zip(&expected) {
            progress::show(format!("{}: {} on {threads} thread(s)", model.name, set.name));
            for (contender, measured) in
                contenders.iter().zip(measure_set(set, expected, &contenders, report.rounds, threads))
            {
                let Some(measured) = measured else { continue };
                let of = contender.subject(&model, threads);
                report.add(&of, set.name, measured.rate, RATE);
                if measured.differ > 0 {
                    report.add(&of, &format!("{} differ", set.name), measured.differ as f64, "rays");
                    if contender.ours {
                        report.wrong.push(format!("{} on {}, {}", contender.name, model.name, set.name));
                    }
                }
                if is_recorded && measured.other > 0 {
                    report.add(&of, &format!("{} other", set.name), measured.other as f64, "rays");
                }
            }
        }
        contenders::add_sizes(report, &model, threads, &contenders);
    }
    Ok(())
}

/// What was measured of a contender with a set.
#[derive(Clone, Copy)]
struct SetFigures {
    /// Million rays per second.
    rate: f64,
    /// Answers that are not the expected ones.
    differ: usize,
    /// Nearest hits on another triangle.
    other: usize,
}

/// Shortest round on several threads, in seconds, so that starting the threads takes little of it.
const SHORTEST_ROUND: f64 = 0.1;

fn measure_set(
    set: &RaySet,
    expected: &Expected,
    contenders: &[Contender],
    rounds: usize,
    threads: usize,
) -> Vec<Option<SetFigures>> {
    let clock = Clock::for_threads(threads);
    let mut answers = Answers::empty(set.any, set.rays.len());
    let mut counts: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    // The first round, which does not count, decides how often the rays are traced in the others.
    let mut passes: BTreeMap<String, usize> = BTreeMap::new();
    let times = medians(contenders, rounds, |round, contender| {
        let starting = contender.tracer.starting();
        if starting != Starting::AtOrigin && set.starts.is_none() {
            return None;
        }
        let again = passes.get(&contender.name).copied().unwrap_or(1);
        let seconds = clock.time(|| contender.trace(set.batch(), &mut answers, threads, again));
        if round == 0 {
            counts.insert(contender.name.clone(), expected.of(starting).compare(&answers, contender.ours));
            if threads > 1 && rounds > 1 {
                passes.insert(contender.name.clone(), (SHORTEST_ROUND / seconds).ceil().max(1.0) as usize);
            }
        }
        Some(seconds / again as f64)
    });
    let figures = contenders.iter().zip(times).map(|(contender, seconds)| {
        let [differ, other] = counts.get(&contender.name).copied().unwrap_or_default();
        Some(SetFigures { rate: set.rays.len() as f64 / seconds? / 1e6, differ, other })
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

/// The exact answers to a set: from the origins of its rays; and if it has starts, without hits on the triangle
/// there, and from the exact starts.
struct Expected {
    at_origin: Answers,
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
        Ok(Expected { at_origin: of(Use::Batch)?, others })
    }

    /// The answers that a tracer has to give.
    fn of(&self, starting: Starting) -> &Answers {
        match (starting, &self.others) {
            (Starting::RejectOwn, Some([without_own, _])) => without_own,
            (Starting::OnSurface, Some([_, on_surface])) => on_surface,
            _ => &self.at_origin,
        }
    }

    /// Counts rays that hit the triangle that they start on; for any hit: that hit nothing else.
    fn own_hits(&self, starts: &[Start]) -> usize {
        match (&self.at_origin, self.of(Starting::RejectOwn)) {
            (Answers::Nearest(hits), _) => {
                hits.iter().zip(starts).filter(|(h, own)| h.is_hit() && h.primitive == own.primitive).count()
            }
            (Answers::Any(all), Answers::Any(others)) => {
                all.iter().zip(others).filter(|(all, other)| **all && !**other).count()
            }
            _ => 0,
        }
    }
}
