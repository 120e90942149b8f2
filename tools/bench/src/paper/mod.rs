//! The paper's tables on our models: its structures with its scalar traversal, and ours.
//!
//! `tree` is a binary BVH as in pbrt that may have tetrahedralizations as leaves
//! (`tet_records`, `tet_walk`); `views` makes and renders the cameras, `steps` compares predicted
//! with counted steps, and `published` has the paper's figures.

mod published;
mod steps;
mod tet_records;
mod tet_walk;
mod tree;
mod views;

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::model::Model;
use crate::output::progress;
use crate::report::{Head, Report, Subject};
use crate::structures::{self, Use};
use crate::tracer::Tracer;
use anyhow::Result;
use bth_compile::costs::{self, BvhCosts, Profile, Select, TetCosts, Walk};
use bth_compile::pipeline::{self, Structure};
use bth_compile::{Silent, bvh, marks, tets};
use clap::Args;
use serde_json::json;
use std::time::Instant;
use tet_records::{TET20, TET32};
use tree::PaperTree;
use views::Views;

/// `paper`.
#[derive(Debug, Args)]
pub(crate) struct Paper {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Rounds, after one that warms up; the fastest counts.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
Camera rays in 16×16 tiles on all threads, fastest round: CPU time of all threads over their number. `construction`: one \
thread, wall clock. `BVH`: binary as in pbrt; `BTH`: with tetrahedralizations where the paper's rule takes them; `Tet`: the \
whole model tetrahedralized; all with one scalar traversal. `(ours)`: our files. `(paper)`: its Tables 1 and 2, from another \
machine and other cameras; only ratios compare. `steps …`: of a ray through the whole tetrahedralization.";

/// Pixels of the pictures; a quick run has fewer.
const SIZE: (u32, u32) = (1920, 1080);
const QUICK_SIZE: (u32, u32) = (192, 108);
/// Nodes of fewer triangles are not tetrahedralized: their tetrahedra would have more hull faces
/// than triangles.
const FEWEST_TRIANGLES: u32 = 64;

/// Costs of the scalar traversals in nanoseconds, which the paper's rule compares: measured on
/// camera rays to blobs of 6,000 and 150,000 faces (Intel Xeon, family 6, model 207, 2026-11-28).
fn scalar_profile(stored: usize) -> Profile {
    let step = if stored == TET32 { [23.6, 30.5] } else { [24.0, 29.1] };
    let walk = Walk { entry: 77.0, hit: 0.0, step };
    let tets = TetCosts { outside: walk, surface: walk, alone: walk };
    let bvh = BvhCosts { ray: 0.0, outside: 12.1, ..Profile::default().bvh };
    Profile { isa: "scalar".to_owned(), bytes: [648e3, 15.6e6], bvh, tets, ..Profile::default() }
}

/// A structure that is ready to render.
struct BuiltStructure {
    name: &'static str,
    tracer: Box<dyn Tracer>,
    /// Wall-clock seconds to construct it on one thread.
    seconds: f64,
    /// Bytes that traversal reads.
    bytes: u64,
    /// Triangles in tetrahedra.
    in_tets: u64,
    /// Leaves that are tetrahedralizations.
    leaves: usize,
}

/// Measures all models.
pub(crate) fn measure(arguments: &Paper) -> Result<Report> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let size = if arguments.run.quick { QUICK_SIZE } else { SIZE };
    let options = json!({"pixels": size, "rounds": rounds, "quick": arguments.run.quick});
    let mut report = Report::new(Head::now("paper", isa, options), rounds, ABOUT);
    for name in &arguments.models {
        measure_model(&Model::load(name)?, size, &mut report)?;
    }
    Ok(report)
}

fn measure_model(model: &Model, size: (u32, u32), report: &mut Report) -> Result<()> {
    let name = &model.name;
    let views = Views::of(model, size)?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut built: Vec<BuiltStructure> = Vec::new();
    progress(format!("{name}: BTH32, Tet32"));
    one.install(|| scalar::<TET32>(model, &views, &mut built, report))?;
    progress(format!("{name}: BTH20, Tet20"));
    one.install(|| scalar::<TET20>(model, &views, &mut built, report))?;
    progress(format!("{name}: our files"));
    one.install(|| own(model, &mut built))?;
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    progress(format!("{name}: rendering"));
    let tracers: Vec<&dyn Tracer> = built.iter().map(|b| &*b.tracer).collect();
    let rendered = [0, 1].map(|view| views.render(&tracers, view, report.rounds, threads));
    for (row, structure) in built.iter().enumerate() {
        let triangles = model.triangles() as f64;
        let of = Subject { engine: structure.name, ours: false, model: name, threads };
        report.add(&of, "construction", structure.seconds, "s");
        for (set, rendered) in ["far", "close"].iter().zip(&rendered) {
            report.add(&of, set, 1e3 * rendered[row].0, "ms");
        }
        let differ: usize = rendered.iter().map(|view| view[row].1).sum();
        report.add(&of, "pixels that differ", differ as f64, "count");
        report.add(&of, "bytes", structure.bytes as f64 / triangles, "B/triangle");
        report.add(&of, "triangles in tets", 100.0 * structure.in_tets as f64 / triangles, "%");
        report.add(&of, "tet leaves", structure.leaves as f64, "count");
    }
    for structure in published::STRUCTURES {
        let Some([construction, rendering]) = published::figures(name, structure) else { continue };
        let of = Subject { engine: &format!("{structure} (paper)"), ours: false, model: name, threads };
        report.add(&of, "construction", construction / 1e3, "s");
        report.add(&of, "close", rendering, "ms");
    }
    Ok(())
}

/// Builds the paper's structures with tetrahedra of one record; with Tet32 also its BVH.
fn scalar<const STORED: usize>(
    model: &Model,
    views: &Views,
    built: &mut Vec<BuiltStructure>,
    report: &mut Report,
) -> Result<()> {
    let names = if STORED == TET32 { ["BTH32", "Tet32"] } else { ["BTH20", "Tet20"] };
    let mesh = &model.mesh;
    let clock = Instant::now();
    let (tree, _) = bvh::build(mesh, &tree::bvh_options(), &Silent)?;
    let bvh_seconds = clock.elapsed().as_secs_f64();
    if STORED == TET32 {
        let clock = Instant::now();
        let plain = PaperTree::<STORED>::new(mesh, &tree, &[]);
        let (seconds, bytes) = (bvh_seconds + clock.elapsed().as_secs_f64(), plain.bytes() as u64);
        built.push(BuiltStructure {
            name: "BVH",
            tracer: Box::new(plain),
            seconds,
            bytes,
            in_tets: 0,
            leaves: 0,
        });
    }
    let tet_options = tets::TetOptions { workers: 1, ..tets::TetOptions::default() };
    let clock = Instant::now();
    let (marks, _) = marks::mark(mesh, &tree, &Silent)?;
    let costs = costs::CostOptions {
        select: Select::Paper,
        profile: scalar_profile(STORED),
        minimum_triangles: FEWEST_TRIANGLES,
        minimum_gain: 0.0,
        ..costs::CostOptions::default()
    };
    let (choice, _) = costs::choose(mesh, &tree, &marks, &costs, &Silent)?;
    let (leaves, _) = tets::build(mesh, &tree, &choice.chosen, &tet_options, &Silent)?;
    let mut bth = PaperTree::<STORED>::new(mesh, &tree, &leaves);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| bth.look_from(eye));
    let in_tets = leaves.iter().map(|(_, t)| t.faces.len() as u64).sum();
    let (name, bytes, leaves) = (names[0], bth.bytes() as u64, leaves.len());
    built.push(BuiltStructure { name, tracer: Box::new(bth), seconds, bytes, in_tets, leaves });

    if marks.suitable.first() != Some(&true) {
        report.leave_out(&model.name, names[1], &anyhow::anyhow!("some triangles are in bad contact"));
        return Ok(());
    }
    let clock = Instant::now();
    let (whole, _) = tets::build(mesh, &tree, &[0], &tet_options, &Silent)?;
    let [(0, mesh_of_tets)] = &whole[..] else {
        report.leave_out(&model.name, names[1], &anyhow::anyhow!("could not be tetrahedralized whole"));
        return Ok(());
    };
    let mut tets = PaperTree::<STORED>::new(mesh, &tree, &whole);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| tets.look_from(eye));
    let (bytes, in_tets) = (tets.bytes() as u64, model.triangles() as u64);
    built.push(BuiltStructure { name: names[1], tracer: Box::new(tets), seconds, bytes, in_tets, leaves: 1 });
    if STORED == TET32 {
        steps::add(model, &tree, mesh_of_tets, report);
    }
    Ok(())
}

/// Compiles our files, for our traversal.
fn own(model: &Model, built: &mut Vec<BuiltStructure>) -> Result<()> {
    for (name, structure) in [("bth (ours)", Structure::Bth), ("bvh (ours)", Structure::Bvh)] {
        let mut options =
            pipeline::CompileOptions { structure, geometry: false, ..pipeline::CompileOptions::default() };
        options.tets.workers = 1;
        let clock = Instant::now();
        let (compiled, report) = pipeline::compile(&model.path, &options, &Silent)?;
        built.push(BuiltStructure {
            name,
            tracer: structures::tracer(&compiled.bytes, Use::Batch)?,
            seconds: clock.elapsed().as_secs_f64(),
            bytes: report.file.resident_bytes,
            in_tets: report.file.tet_triangles,
            leaves: report.file.tet_leaves as usize,
        });
    }
    Ok(())
}
