//! The large version of the stress tests: hard rays on hard surfaces, and points inside and outside
//! of them.

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::markdown::count;
use crate::output::progress;
use crate::report::{Head, Report, Subject};
use anyhow::{Result, bail, ensure};
use bth::Isa;
use bth_tests::oracle;
use bth_tests::stress::{
    Corners, InsideStatistics, Shape, Statistics, Tiles, run, run_inside, run_tiles, shapes, tiles,
};
use bth_tests::structures::{DEFORMED, Traced, deformed, structures_named};
use clap::Args;
use rayon::prelude::*;
use serde_json::json;
use std::collections::BTreeMap;

/// `stress`.
#[derive(Debug, Args)]
pub(crate) struct Stress {
    /// Rays to trace in all, in millions; each counts once for every structure and query that it
    /// goes through. At least one round is traced: 12,288 rays of each shape through every
    /// structure, which takes minutes.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) millions: u64,
    /// Size of the shapes: the number of their triangles grows with its square.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(i32).range(1..=64))]
    pub(crate) size: i32,
    /// One of this many rays or points is compared with every triangle.
    #[arg(long, value_name = "N", default_value_t = 4000, value_parser = at_least_one)]
    pub(crate) one_in: usize,
    /// Start of the random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Only structures with this in their names, such as `deformed bvh` or `bth`.
    #[arg(long, value_name = "NAME", default_value = "")]
    pub(crate) structure: String,
    /// Tiles instead: instances that share borders exactly, at random transforms. At least one
    /// round is traced, of some million rays.
    #[arg(long, conflicts_with_all = ["size", "structure"])]
    pub(crate) tiles: bool,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
`traced`: rays over structures, queries and instruction sets. `misses`: a triangle that the line surely hits was not found; \
`leaks`: a ray from inside hit nothing; `ghosts`: a triangle that the line does not hit; `different`: bits that depend on \
structure, instruction set or batch, for points an answer that differs along another ray; `wrong`: not the answer of all \
triangles, of `compared` rays.";

/// Rays of a shape in a round: a number of batches that the instruction sets divide.
const ROUND: usize = 12 * 1024;

/// Rays from inside of each surface of tiles in a round, and as many starts.
const TILES_ROUND: usize = 1 << 18;

/// A shape, its compiled structures and what was found so far.
struct ShapeRun {
    shape: Shape,
    structures: Vec<Traced>,
    corners: Vec<Corners>,
    rays: Statistics,
    points: InsideStatistics,
}

/// Traces rounds until there are enough rays of each shape. Saves the report after every round, so
/// that it is there if the run is stopped.
pub(crate) fn measure(arguments: &Stress) -> Result<Report> {
    isa::select(arguments.run.isa.as_deref())?;
    if arguments.tiles {
        return measure_tiles(arguments);
    }
    let mut runs = Vec::new();
    for shape in shapes(arguments.size) {
        progress(format!("{}: compiling", shape.name));
        let model = shape.grid.model();
        let is_wanted = |name: &str| name.contains(&arguments.structure);
        let mut structures = structures_named(&model, shape.whole, is_wanted);
        if is_wanted(DEFORMED) {
            structures.push(deformed(&model, arguments.seed));
        }
        ensure!(!structures.is_empty(), "{}: no structure named {:?}", shape.name, arguments.structure);
        let triangles = oracle::triangles(&structures[0].scene.object(0));
        let corners = triangles.iter().map(|t| t.corners).collect();
        let (rays, points) = Default::default();
        runs.push(ShapeRun { shape, structures, corners, rays, points });
    }
    let share = arguments.millions.saturating_mul(1_000_000).div_ceil(runs.len() as u64);
    let mut round = 0;
    loop {
        let mut is_done = true;
        for (number, of) in runs.iter_mut().enumerate().filter(|(_, of)| of.rays.traced < share.max(1)) {
            let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add((number as u64) << 32 | round);
            let one_in = arguments.one_in;
            run(&of.shape, &of.structures, ROUND, one_in, seed, &mut of.rays);
            run_inside(&of.structures[0].scene, &of.corners, ROUND, one_in, seed, &mut of.points);
            is_done = false;
        }
        let lines = runs.iter().map(|of| {
            let counts = [of.corners.len() as u64, of.structures.len() as u64];
            (of.shape.name, counts, &of.rays, &of.points)
        });
        let report = report(arguments, lines);
        if is_done || !report.wrong.is_empty() {
            return Ok(report);
        }
        report.save(&arguments.run)?;
        let traced = runs.iter().map(|of| of.rays.traced).sum();
        progress(format!("{} of {} rays", count(traced), count(share.saturating_mul(runs.len() as u64))));
        round += 1;
    }
}

/// As [`measure`], for tiles; each round has other ones. Threads trace a surface each, with the
/// instruction sets in turn. Then each instruction set traces one of the surfaces again, in batches
/// that threads share.
fn measure_tiles(arguments: &Stress) -> Result<Report> {
    let isas: Vec<Isa> = Isa::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    let mut kinds = BTreeMap::<&str, (u64, Statistics)>::new();
    for round in 0.. {
        let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add(round as u64);
        let all = tiles(seed);
        let trace = |of: &Tiles, one_in, in_parallel| {
            let mut rays = Statistics::default();
            let hash = run_tiles(of, TILES_ROUND, one_in, seed, in_parallel, &mut rays);
            (hash, rays)
        };
        isas[round % isas.len()].choose()?;
        let traced: Vec<_> = all.par_iter().map(|of| trace(of, arguments.one_in, false)).collect();
        let again = round % all.len();
        for isa in &isas {
            isa.choose()?;
            let (hash, rays) = trace(&all[again], 0, true);
            let (_, sum) = kinds.entry(all[again].kind).or_default();
            sum.traced += rays.traced;
            sum.different += u64::from(hash != traced[again].0);
        }
        for (of, (_, rays)) in all.iter().zip(&traced) {
            let (triangles, sum) = kinds.entry(of.kind).or_default();
            *triangles = of.world.triangle_count() as u64;
            sum.add(rays);
        }
        let points = InsideStatistics::default();
        let report = report(
            arguments,
            kinds.iter().map(|(kind, (triangles, rays))| (*kind, [*triangles, 1], rays, &points)),
        );
        let traced = kinds.values().map(|(_, rays)| rays.traced).sum();
        if traced >= arguments.millions.saturating_mul(1_000_000) || !report.wrong.is_empty() {
            return Ok(report);
        }
        report.save(&arguments.run)?;
        progress(format!("{} of {} million rays", count(traced), arguments.millions));
    }
    bail!("no round is the last")
}

/// One table: each shape is a line. It has a name, numbers of triangles and structures, and what
/// was found.
fn report<'a>(
    arguments: &Stress,
    shapes: impl Iterator<Item = (&'a str, [u64; 2], &'a Statistics, &'a InsideStatistics)>,
) -> Report {
    let isas = Isa::ALL.iter().filter(|isa| isa.is_available()).map(|isa| isa.to_string());
    let Stress { size, one_in, seed, structure, tiles, .. } = arguments;
    let options =
        json!({ "size": size, "one_in": one_in, "seed": seed, "structure": structure, "tiles": tiles });
    let head = Head::now("stress", isas.collect::<Vec<_>>().join(" "), options);
    let mut report = Report::new(head, 1, ABOUT);
    for (name, [triangles, structures], rays, points) in shapes {
        let of = Subject { engine: name, ours: true, model: "all", threads: 1 };
        let counts = [
            ("triangles", triangles),
            ("structures", structures),
            ("rays", rays.rays),
            ("traced", rays.traced),
            ("hits", rays.hits),
            ("misses", rays.misses),
            ("leaks", rays.leaks),
            ("ghosts", rays.ghosts),
            ("different", rays.different),
            ("compared", rays.compared),
            ("wrong", rays.wrong),
            ("points", points.points),
            ("points different", points.different),
            ("points wrong", points.wrong),
        ];
        counts.into_iter().for_each(|(set, n)| report.add(&of, set, n as f64, "count"));
        report.add(&of, "error of t 99 %", rays.error_at_99_percent(), "ulp");
        report.add(&of, "error of t worst", rays.worst, "ulp");
        let defects = rays.defects() + points.defects();
        if defects > 0 {
            let examples = (&rays.examples, &points.examples);
            report.wrong.push(format!("{name}: {defects}, such as {examples:?}"));
        }
    }
    report
}
