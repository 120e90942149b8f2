//! `bth-bench stress`: the large version of the stress tests, with a record.

use crate::args::Stress;
use crate::markdown::{count, table};
use crate::output::{Head, Record};
use crate::progress::Progress;
use anyhow::{Result, ensure};
use bth_tests::stress::{Shape, Statistics, run as trace, shapes};
use bth_tests::structures::{Traced, every_structure};
use serde_json::{Value, json};

/// Rays of a shape in a round: a number of batches that the instruction sets divide.
const ROUND: usize = 12 * 1024;

/// A shape on its way.
struct Run {
    shape: Shape,
    structures: Vec<Traced>,
    tally: Statistics,
}

/// Traces rounds of all shapes until enough rays are traced of each, and writes the record after every round: what was
/// traced is told whenever the run ends.
///
/// # Errors
/// If anything was wrong with any answer, or the record cannot be written.
pub fn run(arguments: &Stress) -> Result<()> {
    let progress = Progress::new();
    let start = std::time::Instant::now();
    let shapes = shapes(arguments.size);
    let share = arguments.millions.saturating_mul(1_000_000).div_ceil(shapes.len() as u64);
    let compiled = shapes.into_iter().map(|shape| {
        progress.say(format!("{}: compiling", shape.name));
        let structures = every_structure(&shape.grid.model(), shape.whole);
        Run { shape, structures, tally: Statistics::default() }
    });
    let mut runs: Vec<Run> = compiled.collect();
    let mut round = 0;
    loop {
        let mut traced = false;
        for (number, run) in runs.iter_mut().enumerate().filter(|(_, run)| run.tally.traced < share) {
            let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add((number as u64) << 32 | round);
            trace(&run.shape, &run.structures, ROUND, arguments.one_in, seed, &mut run.tally);
            traced = true;
        }
        let all = total(&runs);
        let seconds = start.elapsed().as_secs();
        if !traced {
            drop(progress);
            return record(arguments, &runs, &all, seconds, true);
        }
        record(arguments, &runs, &all, seconds, false)?;
        progress.say(format!("{} of {} rays", count(all.traced), count(share * runs.len() as u64)));
        ensure!(all.defects() == 0, "{} wrong answers, such as {:#?}", all.defects(), all.examples);
        round += 1;
    }
}

fn total(runs: &[Run]) -> Statistics {
    let mut all = Statistics::default();
    runs.iter().for_each(|run| all.add(&run.tally));
    all
}

fn record(arguments: &Stress, runs: &[Run], all: &Statistics, seconds: u64, is_last: bool) -> Result<()> {
    let mut rows: Vec<_> = runs
        .iter()
        .map(|run| row(run.shape.name, run.triangles(), run.structures.len(), &run.tally))
        .collect();
    rows.push(row("**all**", runs.iter().map(Run::triangles).sum(), 0, all));
    let isas: Vec<String> =
        bth::Isa::ALL.iter().filter(|isa| isa.is_available()).map(|isa| isa.to_string()).collect();
    let options = json!({
        "size": arguments.size, "one_in": arguments.one_in, "seed": arguments.seed, "seconds": seconds
    });
    let head = Head::now("stress", isas.join(", in turn "), options);
    let found: Vec<_> = runs.iter().map(|run| json(&run.shape, run.structures.len(), &run.tally)).collect();
    let json = json!({ "head": head, "shapes": found, "examples": all.examples });
    let record = Record { head: &head, title: "Stress", body: body(&rows), json, charts: Vec::new() };
    if is_last { record.write(&arguments.output) } else { record.save(&arguments.output) }
}

impl Run {
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
         tetrahedralization with each record), as nearest and any hit, a part also with hints and alone: *traced* \
         counts all of these. Each tenth of the rays is of a kind: exactly at vertices; at middles of edges; along \
         edges; in planes of faces; along axes with zeros of either sign; with directions of 2^±60 and 2^-149; with \
         ranges that end at, just before and just behind a vertex; from the surface; from inside; from anywhere. \
         *Missed*: a triangle that the line surely meets was not found; *leaked*: a ray from inside met nothing; \
         *ghost*: a triangle was reported that the line does not meet. All are decided in integers. Error of t in \
         units in the last place (99 %: to the next eighth).\n\n{}",
        table(&head.map(str::to_owned), rows)
    )
}

fn row(name: &str, triangles: usize, structures: usize, tally: &Statistics) -> Vec<String> {
    let mut cells = vec![name.to_owned(), count(triangles as u64)];
    cells.push(if structures == 0 { String::new() } else { structures.to_string() });
    let numbers = [
        tally.rays,
        tally.traced,
        tally.hits,
        tally.misses,
        tally.leaks,
        tally.ghosts,
        tally.different,
        tally.compared,
        tally.wrong,
    ];
    cells.extend(numbers.map(count));
    cells.push(format!("{:.3}", tally.error_at_99_percent()));
    cells.push(format!("{:.3}", tally.worst));
    cells
}

fn json(shape: &Shape, structures: usize, tally: &Statistics) -> Value {
    json!({
        "name": shape.name,
        "triangles": shape.grid.triangles.len(),
        "structures": structures,
        "rays": tally.rays,
        "traced": tally.traced,
        "hits": tally.hits,
        "missed": tally.misses,
        "leaked": tally.leaks,
        "ghosts": tally.ghosts,
        "bits_differ": tally.different,
        "compared": tally.compared,
        "wrong": tally.wrong,
        "t_error_ulp_99": tally.error_at_99_percent(),
        "t_error_ulp_worst": tally.worst,
    })
}
