//! The large version of the stress tests, with a report (`bth-bench stress`).

use crate::args::Stress;
use crate::markdown::{count, table};
use crate::output::{Head, Report};
use crate::progress::Progress;
use anyhow::{Result, ensure};
use bth_tests::stress::{Shape, Statistics, run as trace, shapes};
use bth_tests::structures::{DEFORMED, Traced, deformed, structures_named};
use serde_json::{Value, json};

/// Rays of a shape in a round: a number of batches that the instruction sets divide.
const ROUND: usize = 12 * 1024;

/// A shape, its compiled structures and what was found so far.
struct ShapeRun {
    shape: Shape,
    structures: Vec<Traced>,
    statistics: Statistics,
}

/// Traces rounds of all shapes until enough rays of each are traced. The report is written after every round, so that it is
/// there also if the run is stopped.
///
/// # Errors
/// If anything was wrong with any answer, or the report cannot be written.
pub fn run(arguments: &Stress) -> Result<()> {
    let progress = Progress::new();
    let start = std::time::Instant::now();
    let shapes = shapes(arguments.size);
    let share = arguments.millions.saturating_mul(1_000_000).div_ceil(shapes.len() as u64);
    let compiled = shapes.into_iter().map(|shape| {
        progress.show(format!("{}: compiling", shape.name));
        let model = shape.grid.model();
        let is_wanted = |name: &str| name.contains(&arguments.structure);
        let mut structures = structures_named(&model, shape.whole, is_wanted);
        if is_wanted(DEFORMED) {
            structures.push(deformed(&model, arguments.seed));
        }
        ensure!(
            !structures.is_empty(),
            "{} has no structure that is named {:?}",
            shape.name,
            arguments.structure
        );
        Ok(ShapeRun { shape, structures, statistics: Statistics::default() })
    });
    let mut runs = compiled.collect::<Result<Vec<ShapeRun>>>()?;
    let mut round = 0;
    loop {
        let mut traced = false;
        for (number, run) in runs.iter_mut().enumerate().filter(|(_, run)| run.statistics.traced < share) {
            let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add((number as u64) << 32 | round);
            trace(&run.shape, &run.structures, ROUND, arguments.one_in, seed, &mut run.statistics);
            traced = true;
        }
        let all = total(&runs);
        let seconds = start.elapsed().as_secs();
        if !traced {
            drop(progress);
            return report(arguments, &runs, &all, seconds, true);
        }
        report(arguments, &runs, &all, seconds, false)?;
        progress.show(format!(
            "{} of {} rays",
            count(all.traced),
            count(share.saturating_mul(runs.len() as u64))
        ));
        ensure!(all.defects() == 0, "{} wrong answers, such as {:#?}", all.defects(), all.examples);
        round += 1;
    }
}

fn total(runs: &[ShapeRun]) -> Statistics {
    let mut all = Statistics::default();
    runs.iter().for_each(|run| all.add(&run.statistics));
    all
}

fn report(
    arguments: &Stress,
    runs: &[ShapeRun],
    all: &Statistics,
    seconds: u64,
    is_last: bool,
) -> Result<()> {
    let mut rows: Vec<_> = runs
        .iter()
        .map(|run| row(run.shape.name, run.triangles(), run.structures.len(), &run.statistics))
        .collect();
    rows.push(row("**all**", runs.iter().map(ShapeRun::triangles).sum(), 0, all));
    let isas: Vec<String> =
        bth::Isa::ALL.iter().filter(|isa| isa.is_available()).map(|isa| isa.to_string()).collect();
    let options = json!({
        "size": arguments.size, "one_in": arguments.one_in, "seed": arguments.seed, "structure": arguments.structure, "seconds": seconds
    });
    let head = Head::now("stress", isas.join(", in turn "), options);
    let found: Vec<_> =
        runs.iter().map(|run| json(&run.shape, run.structures.len(), &run.statistics)).collect();
    let json = json!({ "head": head, "shapes": found, "examples": all.examples });
    let report = Report { head: &head, title: "Stress", body: body(&rows), json, charts: Vec::new() };
    if is_last { report.write(&arguments.output) } else { report.save(&arguments.output) }
}

impl ShapeRun {
    fn triangles(&self) -> usize {
        self.shape.grid.triangles.len()
    }
}

fn body(rows: &[Vec<String>]) -> String {
    let head = [
        "shape",
        "triangles",
        "structures",
        "rays",
        "traced",
        "hits",
        "missed",
        "leaked",
        "ghosts",
        "bits differ",
        "compared with all",
        "wrong",
        "t, 99 %",
        "t, all",
    ];
    format!(
        "Every ray goes through every structure (BVH; BTH with each record; where the shape has one, one \
         tetrahedralization with each record; a deformable object that was compiled in another shape and given these \
         positions, and two with tetrahedra that were compiled longer), as nearest and any hit, a part also from starts and alone: *traced* \
         counts all of these. Each tenth of the rays is of a kind: exactly at vertices; at middles of edges; along \
         edges; in planes of faces; along axes with zeros of either sign; with directions of 2^±60 and 2^-149; with \
         ranges that end at, just before and just behind a vertex; from the surface; from inside; from anywhere. \
         *Missed*: a triangle that the line surely meets was not found; *leaked*: a ray from inside met nothing; \
         *ghost*: a triangle was reported that the line does not meet. All are decided in integers. Error of t in \
         units in the last place (99 %: to the next eighth).\n\n{}",
        table(&head.map(str::to_owned), rows)
    )
}

fn row(name: &str, triangles: usize, structures: usize, statistics: &Statistics) -> Vec<String> {
    let mut cells = vec![name.to_owned(), count(triangles as u64)];
    cells.push(if structures == 0 { String::new() } else { structures.to_string() });
    let numbers = [
        statistics.rays,
        statistics.traced,
        statistics.hits,
        statistics.misses,
        statistics.leaks,
        statistics.ghosts,
        statistics.different,
        statistics.compared,
        statistics.wrong,
    ];
    cells.extend(numbers.map(count));
    cells.push(format!("{:.3}", statistics.error_at_99_percent()));
    cells.push(format!("{:.3}", statistics.worst));
    cells
}

fn json(shape: &Shape, structures: usize, statistics: &Statistics) -> Value {
    json!({
        "name": shape.name,
        "triangles": shape.grid.triangles.len(),
        "structures": structures,
        "rays": statistics.rays,
        "traced": statistics.traced,
        "hits": statistics.hits,
        "missed": statistics.misses,
        "leaked": statistics.leaks,
        "ghosts": statistics.ghosts,
        "bits_differ": statistics.different,
        "compared": statistics.compared,
        "wrong": statistics.wrong,
        "t_error_ulp_99": statistics.error_at_99_percent(),
        "t_error_ulp_worst": statistics.worst,
    })
}
