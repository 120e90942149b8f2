//! Points inside and outside of closed models, with every answer checked along a second ray and samples exactly
//! (`bth-bench inside`).

use crate::args::Inside;
use crate::clock::Clock;
use crate::markdown::{count, table};
use crate::model::Model;
use crate::output::{Head, Report};
use crate::progress::Progress;
use anyhow::{Result, ensure};
use bth::Scene;
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure, compile};
use bth_random::Rng;
use bth_tests::oracle;
use bth_tests::stress::{Corners, InsideStatistics, is_closed, run_inside};
use serde_json::{Value, json};

/// Points of a model in a round.
const ROUND: u64 = 96 * 1024;

/// A compiled model and what was found so far.
struct ModelRun {
    name: String,
    scene: Scene,
    corners: Vec<Corners>,
    statistics: InsideStatistics,
    /// Nanoseconds of CPU time for a point in a batch: anywhere in the bounds, and anywhere in a call of its own.
    nanoseconds: [f64; 2],
}

/// Times the winding numbers of points anywhere in the bounds: the least of some rounds.
fn time(scene: &Scene) -> [f64; 2] {
    const POINTS: usize = 100_000;
    let header = scene.object(0).header;
    let mut rng = Rng::new(5);
    let points: Vec<[f32; 3]> = (0..POINTS)
        .map(|_| {
            std::array::from_fn(|k| {
                rng.between(f64::from(header.lower[k]), f64::from(header.upper[k])) as f32
            })
        })
        .collect();
    let mut winding = vec![0; POINTS];
    let mut least = [f64::INFINITY; 2];
    for _ in 0..5 {
        let batch = Clock::ThreadCpu.time(|| scene.winding_batch(&points, &mut winding));
        let single = Clock::ThreadCpu.time(|| {
            for (point, winding) in points.iter().zip(&mut winding) {
                *winding = scene.winding(*point);
            }
        });
        least = [least[0].min(batch), least[1].min(single)];
    }
    least.map(|seconds| seconds * 1e9 / POINTS as f64)
}

impl ModelRun {
    /// Compiles a model, which must be closed.
    fn new(which: &str) -> Result<ModelRun> {
        let model = Model::load(which)?;
        let options = CompileOptions { structure: Structure::Bvh, ..CompileOptions::default() };
        let (compiled, _) = compile(&model.path, &options, &Silent)?;
        let scene = bth::from_bytes(&compiled.bytes)?;
        let corners: Vec<Corners> = oracle::triangles(&scene.object(0)).iter().map(|t| t.corners).collect();
        ensure!(is_closed(&corners), "{}: not closed: some edge has more triangles on one side", model.name);
        let nanoseconds = time(&scene);
        let statistics = InsideStatistics::default();
        Ok(ModelRun { name: model.name, scene, corners, statistics, nanoseconds })
    }
}

/// Asks for rounds of points of all models until there are enough.
///
/// # Errors
/// If a model cannot be compiled or is not closed, if any answer was wrong, or if the report cannot be written.
pub fn run(arguments: &Inside) -> Result<()> {
    let progress = Progress::new();
    let start = std::time::Instant::now();
    let mut runs = Vec::new();
    for which in &arguments.models {
        progress.show(format!("{which}: compiling"));
        runs.push(ModelRun::new(which)?);
    }
    let share = arguments.millions.saturating_mul(1_000_000).div_ceil(runs.len() as u64);
    let mut round = 0;
    while runs[0].statistics.points < share {
        for (number, run) in runs.iter_mut().enumerate() {
            let ModelRun { scene, corners, statistics, .. } = run;
            let seed = arguments.seed.wrapping_mul(1 << 40).wrapping_add((number as u64) << 32 | round);
            let points = ROUND.min(share - statistics.points) as usize;
            run_inside(scene, corners, points, arguments.one_in, seed, statistics);
            ensure!(
                statistics.defects() == 0,
                "{}: {} wrong answers, such as for {:#?}",
                run.name,
                statistics.defects(),
                statistics.examples
            );
        }
        round += 1;
        progress.show(format!("{} of {} points of each", count(runs[0].statistics.points), count(share)));
    }
    drop(progress);
    let isas: Vec<String> =
        bth::Isa::ALL.iter().filter(|isa| isa.is_available()).map(|isa| isa.to_string()).collect();
    let seconds = start.elapsed().as_secs();
    let options = json!({ "one_in": arguments.one_in, "seed": arguments.seed, "seconds": seconds });
    let head = Head::now("inside", isas.join(", in turn "), options);
    let json = json!({ "head": head, "models": runs.iter().map(ModelRun::json).collect::<Vec<_>>() });
    let report = Report { head: &head, title: "Inside", body: body(&runs), json, charts: Vec::new() };
    report.write(&arguments.output)
}

fn body(runs: &[ModelRun]) -> String {
    let head = [
        "model",
        "triangles",
        "points",
        "inside",
        "aimed",
        "different",
        "compared with all",
        "wrong",
        "ns in a batch",
        "ns alone",
    ];
    let rows: Vec<_> = runs.iter().map(ModelRun::row).collect();
    format!(
        "Points anywhere, exactly at vertices, at middles of edges, a step from a face, and such that a ray along an \
         axis or in another direction passes exactly through a vertex or the middle of an edge (*aimed*: exactly at a \
         vertex in the other direction). *Different*: the winding number, the parity and `contains` do not agree along \
         an axis and in the other direction, or between a batch and a call for one point. *Wrong*: not the count of \
         all triangles in exact arithmetic. *ns*: CPU time of one thread for the winding number of a point anywhere in the \
         bounds.\n\n{}",
        table(&head.map(str::to_owned), &rows)
    )
}

impl ModelRun {
    fn row(&self) -> Vec<String> {
        let found = &self.statistics;
        let mut cells = vec![self.name.clone(), count(self.corners.len() as u64)];
        let numbers = [found.points, found.inside, found.aimed, found.different, found.compared, found.wrong];
        cells.extend(numbers.map(count));
        cells.extend(self.nanoseconds.map(|n| format!("{n:.0}")));
        cells
    }

    fn json(&self) -> Value {
        let found = &self.statistics;
        json!({
            "name": self.name,
            "triangles": self.corners.len(),
            "points": found.points,
            "inside": found.inside,
            "aimed": found.aimed,
            "different": found.different,
            "compared": found.compared,
            "wrong": found.wrong,
            "ns_in_a_batch": self.nanoseconds[0],
            "ns_alone": self.nanoseconds[1],
        })
    }
}
