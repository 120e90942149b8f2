//! The large version of the stress tests: hard rays on hard surfaces, and points inside and outside of closed models.

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::markdown::count;
use crate::model::Model;
use crate::progress::Progress;
use crate::report::{Head, Report, Subject};
use crate::structures;
use anyhow::{Result, ensure};
use bth::{Isa, Scene};
use bth_tests::oracle;
use bth_tests::stress::{Corners, InsideStatistics, Shape, Statistics, is_closed, run_inside, shapes};
use bth_tests::structures::{DEFORMED, Traced, deformed, structures_named};
use clap::Args;
use serde_json::json;

/// `stress`.
#[derive(Debug, Args)]
pub struct Stress {
    /// Closed models: checks points inside and outside of them, instead of rays on the shapes.
    #[arg(value_name = "MODEL")]
    pub models: Vec<String>,
    /// Rays or points in all, in millions; a ray counts once for every structure and query that it goes through. At least
    /// one round is traced: 12,288 rays of each shape through every structure, which takes minutes.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub millions: u64,
    /// Size of the shapes: the number of their triangles grows with its square.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(i32).range(1..=64))]
    pub size: i32,
    /// One of this many rays or points is compared with every triangle.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = at_least_one)]
    pub one_in: usize,
    /// Start of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Only structures with this in their names, such as `deformed bvh` or `bth`.
    #[arg(long, value_name = "NAME", default_value = "")]
    pub structure: String,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub run: RunOptions,
}

const ABOUT: &str = "\
Every ray goes through every structure of its shape, as nearest and any hit, a part also from starts and alone, with the \
instruction sets in turn: `traced` counts all of these. Each tenth of the rays is of a kind: exactly at vertices; at \
middles of edges; along edges; in planes of faces; along axes with zeros of either sign; with directions of 2^±60 and \
2^-149; with ranges that end at, just before and just behind a vertex; from the surface; from inside; from anywhere. \
`misses`: a triangle that the line surely hits was not found; `leaks`: a ray from inside hit nothing; `ghosts`: a triangle \
that the line does not hit; `different`: bits that depend on structure, instruction set or batch, for points an answer \
that differs along another ray; `wrong`: not the answer of all triangles, of `compared` rays or points. All are decided \
in integers.";

/// Rays of a shape in a round: a number of batches that the instruction sets divide.
const ROUND: usize = 12 * 1024;

/// What is checked, and what was found so far.
enum Subjects {
    Rays { shape: Shape, structures: Vec<Traced>, found: Statistics },
    Points { name: String, scene: Scene, corners: Vec<Corners>, found: InsideStatistics },
}

/// Traces rounds until there are enough rays or points of each shape or model. Saves the report after every round, so
/// that it is there if the run is stopped.
///
/// # Errors
/// If a model cannot be compiled or is not closed, no structure has the wanted name, or the report cannot be written.
pub fn measure(arguments: &Stress) -> Result<Report> {
    isa::select(arguments.run.isa.as_deref())?;
    let progress = Progress::new();
    let mut subjects = subjects(arguments, &progress)?;
    let share = arguments.millions.saturating_mul(1_000_000).div_ceil(subjects.len() as u64);
    for round in 0u64.. {
        let mut is_done = true;
        for (number, subject) in subjects.iter_mut().enumerate().filter(|(_, s)| s.traced() < share) {
            let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add((number as u64) << 32 | round);
            subject.trace(arguments.one_in, seed);
            is_done = false;
        }
        let report = report(arguments, &subjects);
        if is_done || !report.wrong.is_empty() {
            return Ok(report);
        }
        report.save(&arguments.run)?;
        let all: u64 = subjects.iter().map(Subjects::traced).sum();
        progress.show(format!("{} of {}", count(all), count(share.saturating_mul(subjects.len() as u64))));
    }
    unreachable!("rounds go on until all is done")
}

fn subjects(arguments: &Stress, progress: &Progress) -> Result<Vec<Subjects>> {
    let mut subjects = Vec::new();
    for which in &arguments.models {
        progress.show(format!("{which}: compiling"));
        let model = Model::load(which)?;
        let scene = bth::from_bytes(&structures::compile(&model, &structures::BVH)?.bytes)?;
        let corners: Vec<Corners> = oracle::triangles(&scene.object(0)).iter().map(|t| t.corners).collect();
        ensure!(is_closed(&corners), "{}: not closed: some edge has more triangles on one side", model.name);
        subjects.push(Subjects::Points {
            name: model.name,
            scene,
            corners,
            found: InsideStatistics::default(),
        });
    }
    if !subjects.is_empty() {
        return Ok(subjects);
    }
    for shape in shapes(arguments.size) {
        progress.show(format!("{}: compiling", shape.name));
        let model = shape.grid.model();
        let is_wanted = |name: &str| name.contains(&arguments.structure);
        let mut structures = structures_named(&model, shape.whole, is_wanted);
        if is_wanted(DEFORMED) {
            structures.push(deformed(&model, arguments.seed));
        }
        ensure!(!structures.is_empty(), "{}: no structure named {:?}", shape.name, arguments.structure);
        subjects.push(Subjects::Rays { shape, structures, found: Statistics::default() });
    }
    Ok(subjects)
}

impl Subjects {
    fn name(&self) -> &str {
        match self {
            Subjects::Rays { shape, .. } => shape.name,
            Subjects::Points { name, .. } => name,
        }
    }

    fn traced(&self) -> u64 {
        match self {
            Subjects::Rays { found, .. } => found.traced,
            Subjects::Points { found, .. } => found.points,
        }
    }

    fn trace(&mut self, one_in: usize, seed: u64) {
        match self {
            Subjects::Rays { shape, structures, found } => {
                bth_tests::stress::run(shape, structures, ROUND, one_in, seed, found);
            }
            Subjects::Points { scene, corners, found, .. } => {
                run_inside(scene, corners, 8 * ROUND, one_in, seed, found);
            }
        }
    }

    /// The counts, and the number of wrong answers with examples.
    fn counts(&self) -> (Vec<(&'static str, f64)>, u64, String) {
        let triangles = |n: usize| ("triangles", n as f64);
        match self {
            Subjects::Rays { shape, structures, found } => {
                let mut counts =
                    vec![triangles(shape.grid.triangles.len()), ("structures", structures.len() as f64)];
                let numbers = [
                    ("rays", found.rays),
                    ("traced", found.traced),
                    ("hits", found.hits),
                    ("misses", found.misses),
                    ("leaks", found.leaks),
                    ("ghosts", found.ghosts),
                    ("different", found.different),
                    ("compared", found.compared),
                    ("wrong", found.wrong),
                ];
                counts.extend(numbers.map(|(name, n)| (name, n as f64)));
                counts.push(("error of t 99 %, ulp", found.error_at_99_percent()));
                counts.push(("error of t worst, ulp", found.worst));
                (counts, found.defects(), format!("{:?}", found.examples))
            }
            Subjects::Points { corners, found, .. } => {
                let numbers = [
                    ("points", found.points),
                    ("inside", found.inside),
                    ("aimed", found.aimed),
                    ("different", found.different),
                    ("compared", found.compared),
                    ("wrong", found.wrong),
                ];
                let counts = numbers.into_iter().map(|(name, n)| (name, n as f64));
                let counts = std::iter::once(triangles(corners.len())).chain(counts).collect();
                (counts, found.defects(), format!("{:?}", found.examples))
            }
        }
    }
}

/// The report: a row for each shape or model.
fn report(arguments: &Stress, subjects: &[Subjects]) -> Report {
    let isas = Isa::ALL.iter().filter(|isa| isa.is_available()).map(|isa| isa.to_string());
    let Stress { size, one_in, seed, structure, .. } = arguments;
    let options = json!({ "size": size, "one_in": one_in, "seed": seed, "structure": structure });
    let head = Head::now("stress", isas.collect::<Vec<_>>().join(" "), options);
    let mut report = Report::new(head, 1, ABOUT);
    for subject in subjects {
        // One table: each shape is a line.
        let of = Subject { engine: subject.name(), ours: true, model: "all", threads: 1 };
        let (counts, defects, examples) = subject.counts();
        counts.into_iter().for_each(|(set, value)| report.add(&of, set, value, "count"));
        if defects > 0 {
            report.wrong.push(format!("{}: {defects}, such as {examples}", subject.name()));
        }
    }
    report
}
