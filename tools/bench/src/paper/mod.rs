//! The paper's tables on our models: its structures with its scalar traversal, and ours.
//!
//! `tree` is a binary BVH as in pbrt, some leaves of which may be tetrahedralizations (`tet_records`, `tet_walk`);
//! `calibrate` measures what its steps cost, by which the paper's rule selects; `views` makes the cameras, `render` renders
//! them, and `published` holds the paper's figures.

mod calibrate;
mod published;
mod render;
mod results;
mod tables;
mod tet_records;
mod tet_walk;
mod tree;
mod views;

pub use results::{PaperResults, PaperScene, StructureRow};
pub use tables::markdown;

use crate::args::Paper;
use crate::isa;
use crate::model::Model;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rivals;
use crate::structures::{self, Use};
use anyhow::Result;
use bth_compile::costs::{self, Profile, Select};
use bth_compile::pipeline::{self, Structure};
use bth_compile::{Silent, bvh, marks, tets};
use bth_format::layout::RecordKind;
use render::{BuiltStructure, Rendering};
use serde_json::json;
use std::time::Instant;
use tet_records::{Tet20, Tet32, TetRecord};
use tree::PaperTree;
use views::Views;

/// Pixels of the pictures; a quick run has fewer.
const SIZE: (u32, u32) = (1920, 1080);
const QUICK_SIZE: (u32, u32) = (192, 108);
/// Nodes of fewer triangles are not tetrahedralized: their tetrahedra would have more hull faces than triangles.
const LEAST_TRIANGLES: u32 = 64;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written.
pub fn run(arguments: &Paper) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let progress = Progress::new();
    progress.show("calibrating the scalar traversals");
    let profile = calibrate::profile()?;
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let size = if arguments.run.quick { QUICK_SIZE } else { SIZE };
    let options =
        json!({"pixels": size, "rounds": arguments.rounds, "threads": threads, "quick": arguments.run.quick});
    let mut results = PaperResults { head: Head::now("paper", isa, options), profile, scenes: Vec::new() };
    for name in &arguments.models {
        let model = Model::load(name)?;
        results.scenes.push(scene(&model, &results.profile, arguments, size, threads, &progress)?);
    }
    drop(progress);
    for scene in &results.scenes {
        scene.left_out.iter().for_each(|why| note(&format!("{}: {why}", scene.name)));
    }
    let body = markdown(&results);
    let json = serde_json::to_value(&results)?;
    Report { head: &results.head, title: "The paper's tables", body, json, charts: Vec::new() }
        .write(&arguments.run.output)
}

fn scene(
    model: &Model,
    profile: &Profile,
    arguments: &Paper,
    size: (u32, u32),
    threads: usize,
    progress: &Progress,
) -> Result<PaperScene> {
    let views = Views::of(model, size)?;
    let mut results = PaperScene {
        name: model.name.clone(),
        triangles: model.triangles(),
        view: views.view,
        rows: Vec::new(),
        left_out: Vec::new(),
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut built: Vec<BuiltStructure> = Vec::new();
    progress.show(format!("{}: BTH32, Tet32", model.name));
    one.install(|| scalar::<Tet32>(model, profile, &views, RecordKind::Tet32, &mut built, &mut results))?;
    progress.show(format!("{}: BTH20, Tet20", model.name));
    one.install(|| scalar::<Tet20>(model, profile, &views, RecordKind::Tet20, &mut built, &mut results))?;
    progress.show(format!("{}: our files", model.name));
    one.install(|| own(model, &mut built))?;
    if let Some(rival) = rivals::RIVALS.iter().find(|r| r.name == "k-d tree")
        && model.triangles() <= arguments.most_kd
    {
        progress.show(format!("{}: k-d tree", model.name));
        let contender = rival.build(model, 1)?;
        built.push(BuiltStructure {
            name: "k-d tree",
            tracer: contender.tracer,
            seconds: contender.build_s,
            bytes: contender.bytes.unwrap_or(0),
            in_tets: 0.0,
            leaves: 0,
        });
    }
    let rendering = Rendering { views: &views, rounds: arguments.rounds, threads };
    results.rows =
        rendering.rows(&built, |view| progress.show(format!("{}: rendering the {view} view", model.name)));
    Ok(results)
}

/// Builds the paper's structures with tetrahedra of one record; with Tet32 also its BVH.
fn scalar<R: TetRecord + 'static>(
    model: &Model,
    profile: &Profile,
    views: &Views,
    kind: RecordKind,
    built: &mut Vec<BuiltStructure>,
    results: &mut PaperScene,
) -> Result<()> {
    let names = if kind == RecordKind::Tet32 { ["BTH32", "Tet32"] } else { ["BTH20", "Tet20"] };
    let mesh = &model.mesh;
    let clock = Instant::now();
    let (tree, _) = bvh::build(mesh, &tree::bvh_options(), &Silent)?;
    let bvh_seconds = clock.elapsed().as_secs_f64();
    if kind == RecordKind::Tet32 {
        let clock = Instant::now();
        let plain = PaperTree::<R>::new(mesh, &tree, &[]);
        let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
        let bytes = plain.bytes() as u64;
        built.push(BuiltStructure {
            name: "BVH",
            tracer: Box::new(plain),
            seconds,
            bytes,
            in_tets: 0.0,
            leaves: 0,
        });
    }
    let tet_options = tets::TetOptions { workers: 1, ..tets::TetOptions::default() };
    let clock = Instant::now();
    let (marks, _) = marks::mark(mesh, &tree, &Silent)?;
    let costs = costs::CostOptions {
        select: Select::Paper,
        profile: profile.clone(),
        minimum_triangles: LEAST_TRIANGLES,
        minimum_gain: 0.0,
        ..costs::CostOptions::default()
    };
    let storage = costs::Storage { record: kind, keep_subtrees: false, plain_bytes: None };
    let (choice, _) = costs::choose(mesh, &tree, &marks, &costs, storage, &Silent)?;
    let (leaves, _) = tets::build(mesh, &tree, &choice.chosen, &tet_options, &Silent)?;
    let mut bth = PaperTree::<R>::new(mesh, &tree, &leaves);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| bth.look_from(eye));
    let inside: u64 = leaves.iter().map(|(_, t)| t.faces.len() as u64).sum();
    built.push(BuiltStructure {
        name: names[0],
        bytes: bth.bytes() as u64,
        tracer: Box::new(bth),
        seconds,
        in_tets: inside as f64 / model.triangles().max(1) as f64,
        leaves: leaves.len(),
    });

    if marks.suitable.first() != Some(&true) {
        results.left_out.push(format!("{}: some triangles are in bad contact", names[1]));
        return Ok(());
    }
    let clock = Instant::now();
    let (whole, _) = tets::build(mesh, &tree, &[0], &tet_options, &Silent)?;
    if !matches!(whole[..], [(0, _)]) {
        results.left_out.push(format!("{}: could not be tetrahedralized whole", names[1]));
        return Ok(());
    }
    let mut tets = PaperTree::<R>::new(mesh, &tree, &whole);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| tets.look_from(eye));
    let bytes = tets.bytes() as u64;
    built.push(BuiltStructure {
        name: names[1],
        tracer: Box::new(tets),
        seconds,
        bytes,
        in_tets: 1.0,
        leaves: 1,
    });
    Ok(())
}

/// Our own files, with our own traversal.
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
            in_tets: report.file.tet_triangles as f64 / model.triangles().max(1) as f64,
            leaves: report.file.tet_leaves as usize,
        });
    }
    Ok(())
}
