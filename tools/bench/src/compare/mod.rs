//! Whether one build of `libbth.so` is faster than another, measured in one interleaved run.
//!
//! Both builds are loaded into this process and trace the same rays through the same model in turn, so that other work of the
//! machine affects both alike. The ratio of a round is the new build's CPU time over the old one's; a set's figure is the
//! median over the rounds. The verdict is that of the geometric mean over the models, by the interval in which it lies with 95 %
//! confidence (bootstrap over the rounds): builds that are the same must not be told apart by noise.

mod compiled_model;
mod library;
mod report;

pub use report::{Comparison, ModelComparison, SetComparison, Verdict};

use self::compiled_model::CompiledModel;
use self::library::{Build, OpenedByBuild};
use crate::args::Compare;
use crate::clock::Clock;
use crate::isa;
use crate::output::{print_and_save, write};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rounds::quartiles;
use anyhow::{Result, bail, ensure};
use bth::rays::{Hit, Ray};

/// Seconds of CPU time that a turn takes at least; small sets are traced several times a turn, as the clock is too coarse for
/// shorter ones.
const TURN_SECONDS: f64 = 0.02;

/// Measures, prints and writes the comparison; returns whether a set is slower than `--worse` allows.
///
/// # Errors
/// If a library, model or option cannot be used, or if the builds give different answers.
pub fn run(arguments: &Compare) -> Result<Verdict> {
    if let Some(name) = arguments.sets.unknown(&rays::NAMES).first() {
        bail!("--set {name}: there are {}", rays::NAMES.join(", "));
    }
    let names = arguments.isa.as_deref().map(|names| names.split_once(',').unwrap_or((names, names)));
    let [old, new] = [Build::load(&arguments.old)?, Build::load(&arguments.new)?];
    if let Some((first, second)) = names {
        let any_model = CompiledModel::load("torus-knot:320")?;
        let [old_file, new_file] = &any_model.files;
        for (build, file, isa) in [(&old, old_file, first), (&new, new_file, second)] {
            isa::select_for_libraries(isa)?;
            // A build reads the environment when it traces for the first time.
            build.open(file)?.any(&[Ray::new([0.0; 3], [1.0; 3])], &mut [false], 1);
        }
        ensure!(
            first == second || old.is_other_than(&new),
            "two instruction sets need two files: copy the library"
        );
    }
    let progress = Progress::new();
    let mut comparison = Comparison { batch: arguments.batch, worse: arguments.worse, models: Vec::new() };
    for which in &arguments.models {
        comparison.models.push(model(which, arguments, [&old, &new], &progress)?);
    }
    drop(progress);
    print_and_save(&comparison.markdown(), || {
        let Some(path) = &arguments.json else { return Ok(()) };
        let text = format!("{:#}\n", serde_json::to_value(&comparison)?);
        write(path, &text)
    })?;
    let differing = comparison.differing();
    ensure!(differing.is_empty(), "the builds give different answers: {}", differing.join(", "));
    Ok(comparison.verdict())
}

fn model(
    which: &str,
    arguments: &Compare,
    builds: [&Build; 2],
    progress: &Progress,
) -> Result<ModelComparison> {
    progress.show(format!("{which}: compiling"));
    let compiled = CompiledModel::load(which)?;
    let model = &compiled.model;
    progress.show(format!("{}: making rays", model.name));
    let size = if arguments.quick { rays::QUICK_PICTURE_SIZE } else { rays::PICTURE_SIZE };
    let options = rays::Options { size, most: arguments.rays, view: arguments.seen_from.view() };
    let (_, mut sets) = rays::sets(&Finder::new(model, &compiled.scene), &options);
    sets.retain(|set| {
        set.name != "miss" && arguments.sets.select(set.name) && set.rays.len() >= rays::FEWEST_TIMED
    });

    let [old, new] = &compiled.files;
    let opened = [builds[0].open(old)?, builds[1].open(new)?];
    let mut out = ModelComparison { name: model.name.clone(), sets: Vec::new() };
    for set in &sets {
        progress.show(format!("{}: {}", model.name, set.name));
        out.sets.push(compare(set, &opened, arguments));
    }
    Ok(out)
}

/// Times one set with both builds, round by round.
fn compare(set: &RaySet, builds: &[OpenedByBuild<'_>; 2], arguments: &Compare) -> SetComparison {
    let (batch, rounds) = (arguments.batch, if arguments.quick { 1 } else { arguments.rounds });
    let rays = &set.rays;
    let mut hits = [vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]];
    let mut found = [vec![false; rays.len()], vec![false; rays.len()]];
    let mut seconds = [Vec::new(), Vec::new()];
    let mut passes = 1;
    for round in 0..=rounds {
        let mut of_round = [0.0; 2];
        // Each build goes first in every other round.
        for turn in 0..2 {
            let which = (turn + round) % 2;
            of_round[which] = Clock::ThreadCpu.time(|| {
                for _ in 0..passes {
                    if set.any {
                        builds[which].any(rays, &mut found[which], batch);
                    } else {
                        builds[which].nearest(rays, &mut hits[which], batch);
                    }
                }
            }) / passes as f64;
        }
        // The first round warms up the caches; its time decides how many passes later turns take.
        if round > 0 {
            seconds[0].push(of_round[0]);
            seconds[1].push(of_round[1]);
        } else if !arguments.quick {
            passes = (TURN_SECONDS / of_round[0].max(1e-6)).ceil() as usize;
        }
    }
    let ratios: Vec<f64> = seconds[1].iter().zip(&seconds[0]).map(|(new, old)| new / old).collect();
    let ns = |seconds: &[f64]| quartiles(seconds.to_vec())[1] * 1e9 / rays.len() as f64;
    let bits =
        |h: &Hit| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.primitive.instance, h.primitive.triangle];
    let [low, ratio, high] = quartiles(ratios.clone());
    SetComparison {
        name: set.name.to_owned(),
        rays: rays.len(),
        old_ns: ns(&seconds[0]),
        new_ns: ns(&seconds[1]),
        ratio,
        low,
        high,
        ratios,
        same: found[0] == found[1] && hits[0].iter().zip(&hits[1]).all(|(a, b)| bits(a) == bits(b)),
    }
}
