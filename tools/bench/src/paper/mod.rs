//! The paper's tables on our models: its structures with its scalar traversal, and ours.
//!
//! `tree` is a binary BVH as in pbrt, some leaves of which may be tetrahedralizations (`tet_records`, `tet_walk`);
//! `calibrate` measures the costs of its steps, by which the paper's rule selects; `views` makes and renders the
//! cameras, `steps` compares predicted with counted steps, and `published` holds the paper's figures.

mod calibrate;
mod published;
mod steps;
mod tet_records;
mod tet_walk;
mod tree;
mod views;

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::model::Model;
use crate::progress;
use crate::report::{Head, Report, Subject};
use crate::structures::{self, Use};
use crate::tracer::Tracer;
use anyhow::Result;
use bth_compile::costs::{self, Profile, Select};
use bth_compile::pipeline::{self, Structure};
use bth_compile::{Silent, bvh, marks, tets};
use bth_format::layout::RecordKind;
use clap::Args;
use serde_json::json;
use std::time::Instant;
use tet_records::{Tet20, Tet32, TetRecord};
use tree::PaperTree;
use views::Views;

/// `paper`.
#[derive(Debug, Args)]
pub(crate) struct Paper {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Rounds of which the fastest counts; one more comes before.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
Camera rays from `far` and `close`, 16×16 tiles, all threads, fastest of the rounds; CPU time of all threads over their \
number, which is the time on the wall clock of an idle machine. `construction`: on one thread, wall clock. The paper's \
structures have one scalar traversal: a binary BVH as in pbrt with up to four triangles a leaf (`BVH`), the same with \
tetrahedralizations where the paper's rule takes them (`BTH`), and the whole model tetrahedralized (`Tet`). \
`(ours)`: our files in our SIMD traversal. `(paper)`: its Tables 1 and 2, on another machine with six cores and from \
other cameras, some on other versions of a model; only ratios compare. `steps …`: of a ray through the whole \
tetrahedralization, counted and as the cost model predicts them.";

/// Pixels of the pictures; a quick run has fewer.
const SIZE: (u32, u32) = (1920, 1080);
const QUICK_SIZE: (u32, u32) = (192, 108);
/// Nodes of fewer triangles are not tetrahedralized: their tetrahedra would have more hull faces than triangles.
const FEWEST_TRIANGLES: u32 = 64;
/// Rows of a profile that hold the costs of Tet32 and of Tet20: our records of about these sizes.
const PROFILE_RECORDS: [RecordKind; 2] = [RecordKind::Link32, RecordKind::Tet16];

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
    progress::show("calibrating the scalar traversals");
    let profile = calibrate::profile()?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let size = if arguments.run.quick { QUICK_SIZE } else { SIZE };
    let options = json!({"pixels": size, "rounds": rounds, "quick": arguments.run.quick});
    let mut report = Report::new(Head::now("paper", isa, options), rounds, ABOUT);
    for (record, costs) in &profile.tets {
        let (visit, walk) = (profile.bvh.outside, costs.outside);
        report.notes.push(format!(
            "Costs of the scalar traversals, ns: {visit:.2} a node of the binary BVH; {record} {:.0} to enter, {:.2?} a step",
            walk.entry, walk.step
        ));
    }
    for name in &arguments.models {
        measure_model(&Model::load(name)?, &profile, size, &mut report)?;
    }
    Ok(report)
}

fn measure_model(model: &Model, profile: &Profile, size: (u32, u32), report: &mut Report) -> Result<()> {
    let name = &model.name;
    let views = Views::of(model, size)?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut built: Vec<BuiltStructure> = Vec::new();
    progress::show(format!("{name}: BTH32, Tet32"));
    one.install(|| scalar::<Tet32>(model, profile, &views, PROFILE_RECORDS[0], &mut built, report))?;
    progress::show(format!("{name}: BTH20, Tet20"));
    one.install(|| scalar::<Tet20>(model, profile, &views, PROFILE_RECORDS[1], &mut built, report))?;
    progress::show(format!("{name}: our files"));
    one.install(|| own(model, &mut built))?;
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    progress::show(format!("{name}: rendering"));
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
fn scalar<R: TetRecord + 'static>(
    model: &Model,
    profile: &Profile,
    views: &Views,
    kind: RecordKind,
    built: &mut Vec<BuiltStructure>,
    report: &mut Report,
) -> Result<()> {
    let names = if kind == PROFILE_RECORDS[0] { ["BTH32", "Tet32"] } else { ["BTH20", "Tet20"] };
    let mesh = &model.mesh;
    let clock = Instant::now();
    let (tree, _) = bvh::build(mesh, &tree::bvh_options(), &Silent)?;
    let bvh_seconds = clock.elapsed().as_secs_f64();
    if kind == PROFILE_RECORDS[0] {
        let clock = Instant::now();
        let plain = PaperTree::<R>::new(mesh, &tree, &[]);
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
        profile: profile.clone(),
        minimum_triangles: FEWEST_TRIANGLES,
        minimum_gain: 0.0,
        ..costs::CostOptions::default()
    };
    let storage = costs::Storage { record: kind, keep_subtrees: false, plain_bytes: None };
    let (choice, _) = costs::choose(mesh, &tree, &marks, &costs, storage, &Silent)?;
    let (leaves, _) = tets::build(mesh, &tree, &choice.chosen, &tet_options, &Silent)?;
    let mut bth = PaperTree::<R>::new(mesh, &tree, &leaves);
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
    let mut tets = PaperTree::<R>::new(mesh, &tree, &whole);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| tets.look_from(eye));
    let (bytes, in_tets) = (tets.bytes() as u64, model.triangles() as u64);
    built.push(BuiltStructure { name: names[1], tracer: Box::new(tets), seconds, bytes, in_tets, leaves: 1 });
    if kind == PROFILE_RECORDS[0] {
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
