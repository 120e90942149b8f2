//! Rays per second of our structures and the rivals, on identical rays.

mod charts;
mod contenders;
pub mod results;
mod tables;

pub use charts::draw;
pub use results::{ModelSpeeds, SpeedResults, ThreadsRun};
pub use tables::markdown;

use crate::args::Speed;
use crate::clock::Clock;
use crate::model::Model;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet, recorded};
use crate::rounds::medians;
use crate::tracer::{Contender, Starting, Tracer};
use crate::{rivals, structures};
use anyhow::{Result, bail, ensure};
use bth::rays::{Hit, PrimitiveRef, Start};
use std::collections::BTreeMap;
use std::path::Path;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written, and, when all is written, if one of
/// our own structures gave another answer than the plain BVH.
pub fn run(arguments: &Speed) -> Result<()> {
    check_names(arguments)?;
    let results = measure(arguments)?;
    for model in &results.models {
        for left_out in &model.left_out {
            note(&format!("{}: {}: not measured: {}", model.name, left_out.name, left_out.why));
        }
    }
    Report {
        head: &results.head,
        title: "Rays per second",
        body: markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: draw(&results),
    }
    .write(&arguments.run.output)?;
    let wrong = results.models.iter().flat_map(|m| m.runs.iter().map(move |r| (m, r)));
    let wrong: Vec<String> = wrong
        .flat_map(|(model, run)| run.wrong().map(move |name| format!("{} on {}", name, model.name)))
        .collect();
    ensure!(wrong.is_empty(), "answers differ from those of the plain BVH: {}", wrong.join(", "));
    Ok(())
}

/// Measures all models.
///
/// # Errors
/// If a model cannot be used.
pub fn measure(arguments: &Speed) -> Result<SpeedResults> {
    let (head, rounds) = Head::of_ray_sets("speed", &arguments.run, arguments.rays, arguments.rounds)?;
    let mut results = SpeedResults { head, models: Vec::new() };
    let progress = Progress::new();
    for which in &arguments.models.models {
        results.models.push(measure_model(which, arguments, rounds, &progress)?);
    }
    Ok(results)
}

fn check_names(arguments: &Speed) -> Result<()> {
    let own = structures::KINDS.iter().flat_map(|k| k.uses().map(|(name, _)| name));
    let all: Vec<String> = own.chain(rivals::RIVALS.iter().map(|r| r.name.to_owned())).collect();
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

fn measure_model(which: &str, arguments: &Speed, rounds: usize, progress: &Progress) -> Result<ModelSpeeds> {
    let model = Model::load(which)?;
    progress.show(format!("{}: compiling the BVH", model.name));
    let bvh = structures::compile(&model, &structures::BVH)?;
    let scene = bth::from_bytes(&bvh.bytes)?;

    progress.show(format!("{}: making rays", model.name));
    let (view, mut sets) = if Path::new(which).is_dir() {
        (None, recorded::sets(Path::new(which), &model, &scene, arguments.rays)?)
    } else {
        let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
        let options = rays::Options { size, most: arguments.rays, view: arguments.models.seen_from.view() };
        let (view, sets) = rays::sets(&Finder::new(&model, &scene), &options);
        (Some(view), sets)
    };
    sets.retain(|s| arguments.sets.select(s.name) && s.rays.len() >= rays::FEWEST_TIMED);
    let expected = sets.iter().map(|set| Expected::new(&bvh.bytes, set)).collect::<Result<Vec<_>>>()?;
    let own_hits = sets.iter().zip(&expected);
    let own_hits = own_hits.filter_map(|(s, e)| Some((s.name, e.own_hits(s.starts.as_ref()?)))).collect();

    let most_threads = arguments.threads.iter().copied().max().unwrap_or(1);
    let (contenders, notes) = contenders::build(&model, bvh, &arguments.tracers, most_threads, progress)?;
    let mut runs = Vec::new();
    for &threads in &arguments.threads {
        let mut run = ThreadsRun::new(threads, &contenders);
        for (set, expected) in sets.iter().zip(&expected) {
            progress.show(format!("{}: {} on {threads} thread(s)", model.name, set.name));
            measure_set(set, expected, &contenders, rounds, &mut run, view.is_none());
        }
        runs.push(run);
    }
    Ok(ModelSpeeds {
        name: model.name.clone(),
        triangles: model.triangles(),
        view,
        rays: sets.iter().map(|s| (s.name, s.rays.len())).collect(),
        own_hits,
        structures: notes.structures,
        left_out: notes.left_out,
        runs,
    })
}

/// Least seconds of a round on several threads, so that starting them takes little of it.
const LEAST_SECONDS: f64 = 0.1;

fn measure_set(
    set: &RaySet,
    expected: &Expected,
    contenders: &[Contender],
    rounds: usize,
    run: &mut ThreadsRun,
    count_others: bool,
) {
    let clock = Clock::for_threads(run.threads);
    let mut hits = vec![Hit::MISS; set.rays.len()];
    let mut found = vec![false; set.rays.len()];
    let mut differ: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    // The first round, which is not counted, tells how often the rays are traced in the others.
    let mut passes: BTreeMap<String, usize> = BTreeMap::new();
    let times = medians(contenders, rounds, |round, contender| {
        if contender.tracer.starting() != Starting::AtOrigin && set.starts.is_none() {
            return None;
        }
        let again = passes.get(&contender.name).copied().unwrap_or(1);
        let seconds = clock.time(|| {
            if set.any {
                contender.any(set.batch(), &mut found, run.threads, again);
            } else {
                contender.nearest(set.batch(), &mut hits, run.threads, again);
            }
        });
        if round == 0 {
            let expected = expected.of(contender.tracer.starting());
            let counts = [expected.differ(contender.ours, &hits, &found), expected.other(&hits)];
            differ.insert(contender.name.clone(), counts);
            if run.threads > 1 && rounds > 1 {
                passes.insert(contender.name.clone(), (LEAST_SECONDS / seconds).ceil().max(1.0) as usize);
            }
        }
        Some(seconds / again as f64)
    });
    for (row, seconds) in run.tracers.iter_mut().zip(times) {
        if let Some(seconds) = seconds {
            row.mrays_per_s.insert(set.name, set.rays.len() as f64 / seconds / 1e6);
        }
        if let Some(&[count, other]) = differ.get(&row.name) {
            row.differ.insert(set.name, count);
            if count_others && !set.any {
                row.other.insert(set.name, other);
            }
        }
    }
}

/// The exact answers to a set: from the origins of its rays; and if it knows starts, without hits on the triangle there, and from
/// the exact starts.
struct Expected {
    at_origin: Answers,
    others: Option<[Answers; 2]>,
}

impl Expected {
    fn new(bvh: &[u8], set: &RaySet) -> Result<Expected> {
        let of = |usage| Ok::<_, anyhow::Error>(Answers::of(&*structures::tracer(bvh, usage)?, set));
        let others = match set.starts {
            Some(_) => Some([of(structures::Use::Own)?, of(structures::Use::StartSingle)?]),
            None => None,
        };
        Ok(Expected { at_origin: of(structures::Use::Batch)?, others })
    }

    /// The answers that a tracer has to give.
    fn of(&self, starting: Starting) -> &Answers {
        match (starting, &self.others) {
            (Starting::RejectOwn, Some([without_own, _])) => without_own,
            (Starting::OnSurface, Some([_, on_surface])) => on_surface,
            _ => &self.at_origin,
        }
    }

    /// How many rays hit the triangle that they start on; for any hit: how many hit nothing else.
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

/// The exact answers to a set.
pub(crate) enum Answers {
    Nearest(Vec<Hit>),
    Any(Vec<bool>),
}

impl Answers {
    pub(crate) fn of(tracer: &dyn Tracer, set: &RaySet) -> Answers {
        if set.any {
            let mut found = vec![false; set.rays.len()];
            tracer.any(set.batch(), &mut found);
            Answers::Any(found)
        } else {
            let mut hits = vec![Hit::MISS; set.rays.len()];
            tracer.nearest(set.batch(), &mut hits);
            Answers::Nearest(hits)
        }
    }

    /// How many rays hit another triangle.
    fn other(&self, hits: &[Hit]) -> usize {
        let Answers::Nearest(expected) = self else { return 0 };
        let is_other = |(a, b): &(&Hit, &Hit)| a.is_hit() && b.is_hit() && a.primitive != b.primitive;
        expected.iter().zip(hits).filter(is_other).count()
    }

    /// How many answers differ: of ours in any bit, of rivals in whether something is hit.
    pub(crate) fn differ(&self, ours: bool, hits: &[Hit], found: &[bool]) -> usize {
        let bits = |h: &Hit| -> ([u32; 3], PrimitiveRef) { ([h.t, h.u, h.v].map(f32::to_bits), h.primitive) };
        match self {
            Answers::Any(expected) => expected.iter().zip(found).filter(|(a, b)| a != b).count(),
            Answers::Nearest(expected) => {
                let same =
                    |a: &Hit, b: &Hit| if ours { bits(a) == bits(b) } else { a.is_hit() == b.is_hit() };
                expected.iter().zip(hits).filter(|(a, b)| !same(a, b)).count()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_answers_are_counted_to_the_last_bit_for_ours() {
        let hit = Hit { t: 1.0, u: 0.25, v: 0.5, primitive: PrimitiveRef { instance: 0, triangle: 7 } };
        let nudged = Hit { u: 0.25f32.next_up(), ..hit };
        let expected = Answers::Nearest(vec![hit, hit, Hit::MISS, Hit::MISS]);
        let hits = [hit, nudged, Hit::MISS, hit];
        assert_eq!(expected.differ(true, &hits, &[]), 2);
        assert_eq!(expected.differ(false, &hits, &[]), 1);
        assert_eq!(Answers::Any(vec![true, false]).differ(false, &[], &[true, true]), 1);
    }
}
