//! The paper's tables on our models: its structures with its scalar traversal, and ours.
//!
//! `tree` is a binary BVH as pbrt has it, some leaves of which may be tetrahedralizations (`records`, `walk`);
//! `calibrate` measures what its steps cost, which the paper's rule then selects by; `published` holds the paper's
//! figures.

mod calibrate;
mod published;
mod record;
mod records;
mod tables;
mod tree;
mod walk;

pub use record::{PaperRecord, Row, SceneRecord};
pub use tables::markdown;

use crate::args::Paper;
use crate::clock::process_cpu;
use crate::isa;
use crate::model::Model;
use crate::ours::{self, Use};
use crate::output::{Head, Record as Page, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, View};
use crate::rivals;
use crate::rounds::least;
use crate::tracer::{Batch, Tracer, spread};
use anyhow::Result;
use bth::rays::{Hit, Ray};
use bth_compile::costs::{self, Profile, Select};
use bth_compile::pipeline::{self, Structure};
use bth_compile::{Silent, bvh, marks, tets};
use bth_format::layout::RecordKind;
use records::{Record, Tet20, Tet32};
use serde_json::json;
use std::time::Instant;
use tree::Tree;

/// Pixels of the pictures, and of the tiles that threads take.
const SIZE: (u32, u32) = (1920, 1080);
const TILE: u32 = 16;
/// Nodes of fewer triangles are not tetrahedralized: a box has more faces than they.
const LEAST: u32 = 64;

/// The builder as the paper has it: binned, top-down.
pub(crate) fn bvh_options() -> bvh::Options {
    bvh::Options { quality: bvh::Quality::Fast }
}

/// Measures, prints and writes the record.
///
/// # Errors
/// If an option or model cannot be used or a file cannot be written.
pub fn run(arguments: &Paper) -> Result<()> {
    let isa = isa::select(arguments.isa.as_deref())?;
    let progress = Progress::new();
    progress.say("calibrating the scalar traversals");
    let profile = calibrate::profile()?;
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get());
    let size = if arguments.quick { (192, 108) } else { SIZE };
    let options =
        json!({"pixels": size, "rounds": arguments.rounds, "threads": threads, "quick": arguments.quick});
    let mut record = PaperRecord { head: Head::now("paper", isa, options), profile, scenes: Vec::new() };
    for name in &arguments.models {
        let model = Model::load(name)?;
        record.scenes.push(scene(&model, &record.profile, arguments, size, threads, &progress)?);
    }
    drop(progress);
    for scene in &record.scenes {
        scene.left_out.iter().for_each(|why| note(&format!("{}: {why}", scene.name)));
    }
    let body = markdown(&record);
    let json = serde_json::to_value(&record)?;
    Page { head: &record.head, title: "The paper's tables", body, json, charts: Vec::new() }
        .write(&arguments.output)
}

/// A structure that is ready to render.
struct Built {
    name: &'static str,
    tracer: Box<dyn Tracer>,
    seconds: f64,
    bytes: u64,
    /// Share of the triangles in tetrahedra.
    in_tets: f64,
    leaves: usize,
}

/// Cameras that look from afar and close by.
struct Views {
    view: View,
    rays: [Vec<Ray>; 2],
    /// Whether each ray hits, by our exact BVH.
    expected: [Vec<bool>; 2],
}

impl Views {
    /// Where the cameras stand: all rays of a picture start there.
    fn eyes(&self) -> impl Iterator<Item = [f32; 3]> {
        self.rays.iter().filter_map(|rays| rays.first()).map(|ray| ray.origin)
    }
}

fn scene(
    model: &Model,
    profile: &Profile,
    arguments: &Paper,
    size: (u32, u32),
    threads: usize,
    progress: &Progress,
) -> Result<SceneRecord> {
    let views = views(model, size)?;
    let mut record = SceneRecord {
        name: model.name.clone(),
        triangles: model.triangles(),
        view: views.view,
        rows: Vec::new(),
        left_out: Vec::new(),
    };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut built: Vec<Built> = Vec::new();
    progress.say(format!("{}: BTH32, Tet32", model.name));
    one.install(|| scalar::<Tet32>(model, profile, &views, RecordKind::Tet32, &mut built, &mut record))?;
    progress.say(format!("{}: BTH20, Tet20", model.name));
    one.install(|| scalar::<Tet20>(model, profile, &views, RecordKind::Tet20, &mut built, &mut record))?;
    progress.say(format!("{}: our files", model.name));
    one.install(|| own(model, &mut built))?;
    if let Some(rival) = rivals::RIVALS.iter().find(|r| r.name == "k-d tree")
        && model.triangles() <= arguments.most_kd
    {
        progress.say(format!("{}: k-d tree", model.name));
        let contender = rival.build(model, 1)?;
        built.push(Built {
            name: "k-d tree",
            tracer: contender.tracer,
            seconds: contender.build_s,
            bytes: contender.bytes.unwrap_or(0),
            in_tets: 0.0,
            leaves: 0,
        });
    }
    render(model, &built, &views, arguments, threads, progress, &mut record);
    Ok(record)
}

/// Both cameras, with rays in tiles.
fn views(model: &Model, size: (u32, u32)) -> Result<Views> {
    let plain = ours::compile(model, &ours::BVH)?;
    let scene = bth::from_bytes(&plain.bytes)?;
    let options = rays::Options { size, most: usize::MAX, view: None };
    let (view, rays) = rays::cameras(&Finder::new(model, &scene), &options);
    let rays = rays.map(|rays| tiled(&rays, size));
    let expected = [0, 1].map(|i| {
        let mut hits = vec![Hit::MISS; rays[i].len()];
        scene.nearest_batch(&rays[i], None, &mut hits);
        hits.iter().map(Hit::is_hit).collect()
    });
    Ok(Views { view, rays, expected })
}

/// Rays in tiles of 4×4 pixels into tiles of [`TILE`].
fn tiled(rays: &[Ray], (width, height): (u32, u32)) -> Vec<Ray> {
    let mut ordered = Vec::with_capacity(rays.len());
    for tile_y in (0..height).step_by(TILE as usize) {
        for tile_x in (0..width).step_by(TILE as usize) {
            for y in tile_y..height.min(tile_y + TILE) {
                for x in tile_x..width.min(tile_x + TILE) {
                    let at = (y / 4 * (width / 4) + x / 4) * 16 + y % 4 * 4 + x % 4;
                    ordered.push(rays[at as usize]);
                }
            }
        }
    }
    ordered
}

/// The paper's structures in one record; the BVH once.
fn scalar<R: Record + 'static>(
    model: &Model,
    profile: &Profile,
    views: &Views,
    kind: RecordKind,
    built: &mut Vec<Built>,
    record: &mut SceneRecord,
) -> Result<()> {
    let names = if kind == RecordKind::Tet32 { ["BTH32", "Tet32"] } else { ["BTH20", "Tet20"] };
    let mesh = &model.mesh;
    let clock = Instant::now();
    let (tree, _) = bvh::build(mesh, &bvh_options(), &Silent)?;
    let bvh_seconds = clock.elapsed().as_secs_f64();
    if kind == RecordKind::Tet32 {
        let clock = Instant::now();
        let plain = Tree::<R>::new(mesh, &tree, &[]);
        let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
        let bytes = plain.bytes() as u64;
        built.push(Built { name: "BVH", tracer: Box::new(plain), seconds, bytes, in_tets: 0.0, leaves: 0 });
    }
    let tet_options = tets::Options { workers: 1, ..tets::Options::default() };
    let clock = Instant::now();
    let (marks, _) = marks::mark(mesh, &tree, &Silent)?;
    let costs = costs::Options {
        select: Select::Paper,
        profile: profile.clone(),
        minimum_triangles: LEAST,
        minimum_gain: 0.0,
        ..costs::Options::default()
    };
    let storage = costs::Storage { record: kind, keep_subtrees: false, plain_bytes: None };
    let (choice, _) = costs::choose(mesh, &tree, &marks, &costs, storage, &Silent)?;
    let (leaves, _) = tets::build(mesh, &tree, &choice.chosen, &tet_options, &Silent)?;
    let mut bth = Tree::<R>::new(mesh, &tree, &leaves);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| bth.look_from(eye));
    let inside: u64 = leaves.iter().map(|(_, t)| t.faces.len() as u64).sum();
    built.push(Built {
        name: names[0],
        bytes: bth.bytes() as u64,
        tracer: Box::new(bth),
        seconds,
        in_tets: inside as f64 / model.triangles().max(1) as f64,
        leaves: leaves.len(),
    });

    if marks.suitable.first() != Some(&true) {
        record.left_out.push(format!("{}: some triangles are in bad contact", names[1]));
        return Ok(());
    }
    let clock = Instant::now();
    let (whole, _) = tets::build(mesh, &tree, &[0], &tet_options, &Silent)?;
    if !matches!(whole[..], [(0, _)]) {
        record.left_out.push(format!("{}: could not be tetrahedralized whole", names[1]));
        return Ok(());
    }
    let mut tets = Tree::<R>::new(mesh, &tree, &whole);
    let seconds = bvh_seconds + clock.elapsed().as_secs_f64();
    views.eyes().for_each(|eye| tets.look_from(eye));
    let bytes = tets.bytes() as u64;
    built.push(Built { name: names[1], tracer: Box::new(tets), seconds, bytes, in_tets: 1.0, leaves: 1 });
    Ok(())
}

/// Our own files, with our own traversal.
fn own(model: &Model, built: &mut Vec<Built>) -> Result<()> {
    for (name, structure) in [("bth (ours)", Structure::Bth), ("bvh (ours)", Structure::Bvh)] {
        let mut options = pipeline::Options { structure, geometry: false, ..pipeline::Options::default() };
        options.tets.workers = 1;
        let clock = Instant::now();
        let (compiled, report) = pipeline::compile(&model.path, &options, &Silent)?;
        built.push(Built {
            name,
            tracer: ours::tracer(&compiled.bytes, Use::Batch)?,
            seconds: clock.elapsed().as_secs_f64(),
            bytes: report.file.resident_bytes,
            in_tets: report.file.tet_triangles as f64 / model.triangles().max(1) as f64,
            leaves: report.file.tet_leaves as usize,
        });
    }
    Ok(())
}

/// Renders both views with all structures in turn.
fn render(
    model: &Model,
    built: &[Built],
    views: &Views,
    arguments: &Paper,
    threads: usize,
    progress: &Progress,
    record: &mut SceneRecord,
) {
    let mut milliseconds = vec![[0.0; 2]; built.len()];
    let mut wrong = vec![[0usize; 2]; built.len()];
    for view in 0..2 {
        progress.say(format!("{}: rendering the {} view", model.name, ["far", "close"][view]));
        let rays = &views.rays[view];
        let rows: Vec<usize> = (0..built.len()).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        let times = least(&rows, arguments.rounds, |round, &row| {
            let batch = Batch { rays, from: None, coherent: true };
            let trace = |b: Batch<'_>, h: &mut [Hit]| built[row].tracer.nearest(b, h);
            // The CPU's time and not the wall clock's: other jobs take turns on the same cores.
            let before = process_cpu();
            spread(batch, &mut hits, threads, (TILE * TILE) as usize, trace);
            let seconds = (process_cpu() - before) / threads as f64;
            if round == 0 {
                let differ = hits.iter().zip(&views.expected[view]).filter(|(h, e)| h.is_hit() != **e);
                wrong[row][view] = differ.count();
            }
            Some(seconds)
        });
        for (row, seconds) in times.into_iter().enumerate() {
            milliseconds[row][view] = 1e3 * seconds.unwrap_or(0.0);
        }
    }
    record.rows = built
        .iter()
        .zip(milliseconds.iter().zip(&wrong))
        .map(|(b, (milliseconds, wrong))| Row {
            structure: b.name.to_owned(),
            construction: b.seconds,
            milliseconds: *milliseconds,
            differ: *wrong,
            bytes: b.bytes,
            in_tets: b.in_tets,
            leaves: b.leaves,
        })
        .collect();
}
