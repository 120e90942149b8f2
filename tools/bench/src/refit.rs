//! Objects that deform (`bth-bench refit`): new positions of all vertices, beside Embree's refit and its rebuild for the same ones.

use crate::args::Refit;
use crate::clock::Clock;
use crate::isa;
use crate::markdown::{count, table, two_decimals};
use crate::model::Model;
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rivals::embree::{self, EmbreeScene};
use crate::rounds::median;
use crate::tracer::{Batch, Tracer};
use crate::twist::{TWIST, twisted};
use anyhow::{Result, ensure};
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::memory::{TriangleMesh, compile};
use bth_compile::pipeline::CompileOptions;
use bth_random::Rng;
use serde::Serialize;
use serde_json::json;

/// Rays with which answers are compared, and traced to see what refitted trees cost.
const RAYS: usize = 20_000;
/// Answers of a tracer that rounds count as equal up to this relative difference of t.
const SAME: f32 = 1e-4;

/// What was measured of a contender.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The model.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// Number of threads.
    pub threads: usize,
    /// The contender.
    pub tracer: &'static str,
    /// Nanoseconds for each triangle to make new positions visible: the median of the rounds.
    pub ns_per_triangle: f64,
    /// Nanoseconds of one ray through the tree for the last positions.
    pub ns_per_ray: f64,
    /// Our cost ratio for the last positions.
    pub cost_ratio: Option<f64>,
    /// Answers that differ from ours: whether, or by more than 1e-4 of t where, something is hit.
    pub differ: u64,
}

/// A scene of one object that can be deformed.
enum Contender {
    Ours(Box<bth::Scene>),
    Embree(EmbreeScene),
}

impl Contender {
    /// Does what is not measured: positions that are in the memory of the tracer.
    fn prepare(&mut self, positions: &[[f32; 3]]) {
        if let Contender::Embree(scene) = self {
            scene.store_positions(positions);
        }
    }

    /// Makes positions visible; returns our cost ratio.
    fn show(&mut self, positions: &[[f32; 3]]) -> Result<Option<f64>> {
        match self {
            Contender::Ours(scene) => Ok(Some(scene.set_positions(0, positions)?.deformed_cost_ratio)),
            Contender::Embree(scene) => {
                scene.commit_positions();
                Ok(None)
            }
        }
    }

    fn nearest(&self, rays: &[Ray], hits: &mut [Hit]) {
        match self {
            Contender::Ours(scene) => rays.iter().zip(hits).for_each(|(ray, hit)| {
                *hit = scene.nearest(ray).unwrap_or(Hit::MISS);
            }),
            Contender::Embree(scene) => {
                Tracer::nearest(scene, Batch { rays, starts: None, coherent: false }, hits);
            }
        }
    }
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used, Embree is missing, or the report cannot be written.
pub fn run(arguments: &Refit) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = if arguments.run.quick { 1 } else { arguments.rounds };
    let progress = Progress::new();
    let mut rows = Vec::new();
    for which in &arguments.models {
        let model = Model::load(which)?;
        let mesh = TriangleMesh { positions: &model.mesh.positions, triangles: &model.mesh.triangles };
        let options = CompileOptions { deformable: true, ..CompileOptions::default() };
        let (compiled, _) = compile(mesh, &options, &Silent)?;
        for &threads in &arguments.threads {
            progress.show(format!("{}, {threads} threads", model.name));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            rows.extend(pool.install(|| measure(&model, &compiled.bytes, threads, rounds))?);
        }
    }
    drop(progress);
    let options = json!({ "rounds": rounds, "twist": TWIST, "quick": arguments.run.quick });
    let head = Head::now("refit", isa, options);
    let json = json!({ "head": head, "rows": rows });
    Report { head: &head, title: "Objects that deform", body: body(&rows), json, charts: Vec::new() }
        .write(&arguments.run.output)
}

fn contenders(model: &Model, bytes: &[u8], threads: usize) -> Result<Vec<(&'static str, Contender)>> {
    let mut contenders = vec![("bth", Contender::Ours(Box::new(bth::from_bytes(bytes)?)))];
    for (name, variant) in [("embree refit", &embree::REFIT), ("embree rebuild", &embree::DEFAULT)] {
        let (positions, triangles) = (embree::padded(&model.mesh.positions), model.mesh.triangles.clone());
        contenders.push((name, Contender::Embree(embree::build(positions, triangles, variant, threads)?)));
    }
    Ok(contenders)
}

fn measure(model: &Model, bytes: &[u8], threads: usize, rounds: usize) -> Result<Vec<Row>> {
    let mut contenders = contenders(model, bytes, threads)?;
    let clock = Clock::for_threads(threads);
    let mut times = vec![Vec::new(); contenders.len()];
    let mut ratio = None;
    for round in 0..=rounds {
        let positions = twisted(model, TWIST * (round as f32 / rounds as f32));
        for ((_, contender), times) in contenders.iter_mut().zip(&mut times) {
            contender.prepare(&positions);
            let mut shown = Ok(None);
            let seconds = clock.time(|| shown = contender.show(&positions));
            ratio = shown?.or(ratio);
            if round > 0 {
                times.push(seconds);
            }
        }
    }
    let rays = rays(model, &twisted(model, TWIST));
    let mut hits = vec![vec![Hit::MISS; rays.len()]; contenders.len()];
    let mut traced = vec![Vec::new(); contenders.len()];
    for _ in 0..rounds.min(5) {
        for (((_, contender), hits), traced) in contenders.iter().zip(&mut hits).zip(&mut traced) {
            traced.push(Clock::ThreadCpu.time(|| contender.nearest(&rays, hits)));
        }
    }
    ensure!(hits[0].iter().any(Hit::is_hit), "no ray hits");
    let same =
        |a: &Hit, b: &Hit| a.is_hit() == b.is_hit() && (!a.is_hit() || (a.t - b.t).abs() <= SAME * a.t.abs());
    let rows = contenders.iter().zip(times).zip(traced).zip(&hits).map(
        |((((tracer, contender), times), traced), found)| Row {
            model: model.name.clone(),
            triangles: model.triangles(),
            threads,
            tracer,
            ns_per_triangle: 1e9 * median(times).unwrap_or(f64::NAN) / model.triangles() as f64,
            ns_per_ray: 1e9 * median(traced).unwrap_or(f64::NAN) / rays.len() as f64,
            cost_ratio: ratio.filter(|_| matches!(contender, Contender::Ours(_))),
            differ: hits[0].iter().zip(found).filter(|(a, b)| !same(a, b)).count() as u64,
        },
    );
    Ok(rows.collect())
}

/// Rays from about a model to the middles of its triangles: tracers that round may miss corners.
fn rays(model: &Model, positions: &[[f32; 3]]) -> Vec<Ray> {
    let mut rng = Rng::new(3);
    let diagonal = model.bounds().diagonal() as f32;
    (0..RAYS)
        .map(|_| {
            let triangle = model.mesh.triangles[rng.below(model.triangles() as u64) as usize];
            let corners = triangle.map(|v| positions[v as usize]);
            let target = [0, 1, 2].map(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0);
            let origin = target.map(|x| x + (rng.unit_f32() - 0.5) * 2.0 * diagonal);
            Ray::new(origin, [0, 1, 2].map(|k| target[k] - origin[k]))
        })
        .collect()
}

fn body(rows: &[Row]) -> String {
    let head = [
        "model",
        "triangles",
        "threads",
        "tracer",
        "ns/triangle",
        "times embree refit",
        "ns/ray",
        "cost ratio",
        "differ",
    ]
    .map(str::to_owned);
    let of_embree = |row: &Row| {
        let same = |other: &&Row| {
            other.tracer == "embree refit" && (&other.model, other.threads) == (&row.model, row.threads)
        };
        rows.iter().find(same).map(|embree| row.ns_per_triangle / embree.ns_per_triangle)
    };
    let cells = |row: &Row| {
        vec![
            row.model.clone(),
            count(row.triangles as u64),
            row.threads.to_string(),
            row.tracer.to_owned(),
            format!("{:.2}", row.ns_per_triangle),
            two_decimals(of_embree(row)),
            format!("{:.0}", row.ns_per_ray),
            two_decimals(row.cost_ratio),
            count(row.differ),
        ]
    };
    let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
    format!(
        "Time to make new positions of all vertices visible, for each triangle; medians of interleaved rounds in which a model is twisted \
         on, by the CPU clock of the thread for one thread and by the wall clock for several. `bth` is `set_positions`: it checks and copies \
         the positions and refits. `embree refit` is the commit of a dynamic scene of low quality whose geometry has the quality REFIT, \
         `embree rebuild` that of a scene of medium quality; copying positions to Embree's buffer is not counted. `ns/ray`: one thread, rays one by one, \
         through what each has after the last round. `differ`: of {RAYS} rays, those whose hit is not ours.\n\n{}",
        table(&head, &rows)
    )
}
