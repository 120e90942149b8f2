//! Compares the speed of two builds of `libbth.so` in one interleaved run.
//!
//! Both builds are loaded into this process and trace the same rays through the same model in turn,
//! so that other work of the machine affects both alike. Noise must not tell equal builds apart.

mod compiled_model;
mod library;
mod verdict;

pub(crate) use verdict::Verdict;

use self::compiled_model::CompiledModel;
use self::library::{Build, OpenedByBuild};
use self::verdict::SetRatios;
use crate::args::{RunOptions, at_least_one, share};
use crate::clock::Clock;
use crate::isa;
use crate::names::Names;
use crate::output::progress;
use crate::rays::{self, Finder, RaySet, View};
use crate::report::{Head, Report, Subject};
use crate::rounds::quartiles;
use crate::tracer::Answers;
use anyhow::{Result, ensure};
use bth::rays::Ray;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// `compare`.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The build to compare with: a libbth.so.
    pub(crate) old: PathBuf,
    /// The build that may be faster.
    pub(crate) new: PathBuf,
    /// Model files, models of `bth-scenes list` by NAME or NAME:FACES, or compiled .bth files,
    /// which are used as they are. If OLD and NEW read different versions of the format:
    /// `OLD.bth,NEW.bth`, the model as compiled for each of them.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Put the cameras outside of the models, or inside as is right for rooms; by default each
    /// model decides.
    #[arg(long, value_name = "WHERE")]
    pub(crate) view: Option<View>,
    /// Rays of a set, at most (about).
    #[arg(long, value_name = "N", default_value_t = 65_536, value_parser = at_least_one)]
    pub(crate) rays: usize,
    /// Rounds, after one that warms up; the median counts.
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Rays in a call; 1 for one ray a call.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = at_least_one)]
    pub(crate) batch: usize,
    /// Only these ray sets.
    #[arg(long = "set", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) sets: Names,
    /// A set is slower when its mean over the models is certainly (95 %) greater by more than this,
    /// such as `1%`.
    #[arg(long, value_name = "P%", default_value = "1%", value_parser = share)]
    pub(crate) worse: f64,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
CPU time of a ray on one thread, medians of interleaved rounds, and the ratio new / old of these rounds. The verdict on a \
set is by the 95 % interval of its geometric mean over the models.";

/// Shortest turn, in seconds of CPU time. Small sets are traced several times a turn, as the clock
/// is too coarse for shorter ones.
const SHORTEST_TURN: f64 = 0.02;

/// Measures, prints and writes the comparison; returns the verdict by `--worse`.
pub(crate) fn run(arguments: &Compare) -> Result<Verdict> {
    arguments.sets.check("--set", &rays::NAMES)?;
    let builds = [Build::load(&arguments.old)?, Build::load(&arguments.new)?];
    if let Some(names) = &arguments.run.isa {
        choose_isas(names, &builds)?;
    }
    let rounds = arguments.run.rounds(arguments.rounds);
    let options = json!({ "rays": arguments.rays, "rounds": rounds, "batch": arguments.batch });
    let isa = arguments.run.isa.clone().unwrap_or_else(|| "best".to_owned());
    let mut report = Report::new(Head::now("compare", isa, options), rounds, ABOUT);
    let mut ratios = SetRatios::default();
    for which in &arguments.models {
        measure_model(which, arguments, &builds, &mut report, &mut ratios)?;
    }
    let verdict = ratios.judge(arguments.worse, &mut report.notes);
    report.finish(&arguments.run)?;
    Ok(verdict)
}

/// Makes the builds use an instruction set, or each its own.
fn choose_isas(names: &str, builds: &[Build; 2]) -> Result<()> {
    let (old, new) = names.split_once(',').unwrap_or((names, names));
    let any_model = CompiledModel::load("torus-knot:320")?;
    for ((build, file), isa) in builds.iter().zip(&any_model.files).zip([old, new]) {
        isa::select_for_libraries(isa)?;
        // A build reads the environment when it traces for the first time.
        build.open(file)?.trace(&[Ray::new([0.0; 3], [1.0; 3])], &mut Answers::empty(true, 1), 1);
    }
    let apart = old == new || builds[0].is_other_than(&builds[1]);
    ensure!(apart, "two instruction sets need two files: copy the library");
    Ok(())
}

fn measure_model(
    which: &str,
    arguments: &Compare,
    builds: &[Build; 2],
    report: &mut Report,
    ratios: &mut SetRatios,
) -> Result<()> {
    progress(format!("{which}: compiling"));
    let compiled = CompiledModel::load(which)?;
    let model = &compiled.model;
    progress(format!("{}: making rays", model.name));
    let size = if arguments.run.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
    let options = rays::Options { size, most: arguments.rays, view: arguments.view };
    let (_, mut sets) = rays::sets(&Finder::new(model, &compiled.scene), &options);
    sets.retain(|set| arguments.sets.select(set.name) && set.rays.len() >= rays::FEWEST_TIMED);
    let opened = [builds[0].open(&compiled.files[0])?, builds[1].open(&compiled.files[1])?];
    for set in &sets {
        progress(format!("{}: {}", model.name, set.name));
        let (seconds, same) = time(set, &opened, arguments.batch, report.rounds);
        let of = |engine| Subject { engine, ours: true, model: &model.name, threads: 1 };
        for (engine, seconds) in ["old", "new"].into_iter().zip(&seconds) {
            let median = quartiles(seconds.clone())[1];
            report.add(&of(engine), set.name, median * 1e9 / set.rays.len() as f64, "ns/ray");
        }
        let each: Vec<f64> = seconds[1].iter().zip(&seconds[0]).map(|(new, old)| new / old).collect();
        let [low, ratio, high] = quartiles(each.clone());
        report.add(&of("new / old"), set.name, ratio, "ns/ray");
        if let Some(row) = report.rows.last_mut() {
            (row.unit, row.low, row.high) = ("ratio".to_owned(), Some(low), Some(high));
        }
        ratios.add(set.name, each);
        if !same {
            report.wrong.push(format!("the builds differ on {} {}", model.name, set.name));
        }
    }
    Ok(())
}

/// Times one set with both builds, round by round. Returns the seconds of each round, and true if
/// all answers have the same bits.
fn time(set: &RaySet, builds: &[OpenedByBuild<'_>; 2], batch: usize, rounds: usize) -> ([Vec<f64>; 2], bool) {
    let mut answers = [(); 2].map(|()| Answers::empty(set.any, set.rays.len()));
    let mut seconds = [Vec::new(), Vec::new()];
    let mut passes = 1;
    for round in 0..=rounds {
        let mut of_round = [0.0; 2];
        // Each build goes first in every other round.
        for turn in 0..2 {
            let which = (turn + round) % 2;
            of_round[which] = Clock::ThreadCpu.time(|| {
                (0..passes).for_each(|_| builds[which].trace(&set.rays, &mut answers[which], batch))
            }) / passes as f64;
        }
        // The first round warms up the caches; its time decides how many passes later turns take.
        if round > 0 {
            seconds.iter_mut().zip(of_round).for_each(|(all, time)| all.push(time));
        } else if rounds > 1 {
            passes = (SHORTEST_TURN / of_round[0].max(1e-6)).ceil() as usize;
        }
    }
    (seconds, answers[0].differences(&answers[1], true) == 0)
}
