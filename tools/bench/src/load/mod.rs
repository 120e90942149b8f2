//! Opening a compiled model or scene and tracing the first rays, against building at the start.
//!
//! Every start runs in a separate process ([`probe`]), so that nothing is left over from the one
//! before.

pub(crate) mod probe;
mod starts;

pub(crate) use probe::{Probe, Start};

use crate::args::{RunOptions, at_least_one};
use crate::isa;
use crate::model::{Model, position};
use crate::output::progress;
use crate::rays::{self, Camera, Finder, View};
use crate::report::{Head, Report, Subject};
use crate::rivals::embree;
use crate::scenes::Source;
use crate::structures;
use anyhow::{Context, Result};
use bth::Scene;
use bth::rays::{Hit, Ray};
use clap::Args;
use glam::DVec3;
use serde_json::json;
use starts::{PageCache, StartCase, StartRounds};
use std::fs::File;
use std::path::{Path, PathBuf};
use zerocopy::IntoBytes;

/// `load`.
#[derive(Debug, Args)]
pub(crate) struct Load {
    /// Models and scenes: files, NAME or NAME:FACES of `bth-scenes list`, or `objects:N` for N
    /// generated objects.
    #[arg(required = true, value_name = "MODEL")]
    pub(crate) models: Vec<String>,
    /// Put the cameras outside of the models, or inside as is right for rooms; by default each
    /// model decides.
    #[arg(long, value_name = "WHERE")]
    pub(crate) view: Option<View>,
    /// First rays to trace.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = at_least_one)]
    pub(crate) rays: usize,
    /// Rounds, after one that warms up; the median counts.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Numbers of threads to build and trace on.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1,2", value_parser = at_least_one)]
    pub(crate) threads: Vec<usize>,
    /// Folder for the compiled files: a cold start reads from its storage.
    #[arg(long, value_name = "DIR")]
    pub(crate) scratch: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
Wall-clock times from before the file is opened, or from before Embree builds all objects and instances from triangles in \
memory; medians of interleaved rounds. `ready`: until rays can be traced; `first hit`: until the first ray is answered; \
`total`: until the first camera rays are traced; `CPU`: of all threads until then. `cold`: the file's pages were dropped from \
memory first; `storage`: MiB that were read. `times embree`: below 1 is faster.";

/// Pixels of the camera.
const SIZE: (u32, u32) = (512, 288);

/// Measures all models and scenes.
pub(crate) fn measure(arguments: &Load) -> Result<Report> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let rounds = arguments.run.rounds(arguments.rounds);
    let options = json!({"rays": arguments.rays, "rounds": rounds});
    let mut report = Report::new(Head::now("load", isa, options), rounds, ABOUT);
    for which in &arguments.models {
        measure_one(which, arguments, &mut report)?;
    }
    report.add_ratios(embree::NAME, "ms");
    Ok(report)
}

/// A model or a scene.
enum Input {
    Model(Box<Model>),
    Scene(Box<Source>),
}

impl Input {
    fn load(which: &str) -> Result<Input> {
        let is_scene =
            ["manifest", "glb", "gltf"].iter().any(|end| which.to_lowercase().ends_with(&format!(".{end}")));
        if is_scene || which.starts_with("objects:") {
            return Ok(Input::Scene(Box::new(Source::load(which)?)));
        }
        Ok(Input::Model(Box::new(Model::load(which)?)))
    }

    fn name(&self) -> &str {
        match self {
            Input::Model(model) => &model.name,
            Input::Scene(source) => &source.name,
        }
    }

    fn compile(&self, kind: &structures::Kind) -> Result<structures::Compiled> {
        match self {
            Input::Model(model) => structures::compile(model, kind),
            Input::Scene(source) => source.compile(&kind.options()),
        }
    }

    /// The rays of a picture, in tiles.
    fn picture(&self, scene: &Scene, view: Option<View>) -> Vec<Ray> {
        match self {
            Input::Model(model) => {
                let options = rays::Options { size: SIZE, most: usize::MAX, view };
                let (_, [rays, _]) = rays::cameras(&Finder::new(model, scene), &options);
                rays
            }
            Input::Scene(_) => {
                Camera::framing_instances(scene, SIZE).map_or(Vec::new(), |(camera, _)| camera.rays())
            }
        }
    }
}

fn measure_one(which: &str, arguments: &Load, report: &mut Report) -> Result<()> {
    let input = Input::load(which)?;
    let name = input.name();
    let scratch = match &arguments.scratch {
        Some(place) => tempfile::tempdir_in(place).with_context(|| place.display().to_string())?,
        None => tempfile::tempdir()?,
    };
    let (mut cases, mut opened) = (Vec::new(), None);
    for kind in [structures::BTH, structures::BVH] {
        progress(format!("{name}: compiling {}", kind.name));
        let compiled = input.compile(&kind)?;
        let file = scratch.path().join(format!("{}.bth", kind.name));
        write(&file, &compiled.bytes)?;
        for start in [Start::Map, Start::Read] {
            cases.extend(PageCache::ALL.map(|cache| {
                let name = format!("{} {} {}", kind.name, start.name(), format!("{cache:?}").to_lowercase());
                StartCase { name, ours: true, start, cache, file: file.clone() }
            }));
        }
        let of = Subject { engine: kind.name, ours: true, model: name, threads: 1 };
        report.add(&of, "file", compiled.bytes.len() as f64 / 1048576.0, "MiB");
        report.add(&of, "compile", compiled.seconds, "s");
        opened = Some((bth::from_bytes(&compiled.bytes)?, file));
    }
    let (scene, file) = opened.context("two files were compiled")?;
    match embree::available() {
        Ok(()) => cases.extend([Start::Embree, Start::EmbreeRobust].map(|start| {
            let name = start.name().replace('-', " ");
            // Embree's triangles are in memory before the clock starts, so the page cache does not
            // matter.
            StartCase { name, ours: false, start, cache: PageCache::Warm, file: file.clone() }
        })),
        Err(error) => report.leave_out(name, embree::NAME, &error),
    }
    progress(format!("{name}: making rays"));
    let picture = input.picture(&scene, arguments.view);
    let rays = first_of(&scene, &picture, arguments.rays)
        .with_context(|| format!("{name}: the camera sees nothing"))?;
    let file = scratch.path().join("rays");
    write(&file, rays.as_bytes())?;
    let rounds = StartRounds { name, cases: &cases, rounds: report.rounds, rays: &file };
    for &threads in &arguments.threads {
        rounds.run(threads, report)?;
    }
    Ok(())
}

/// Writes a file to its storage: only clean pages can be dropped from the cache.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes)?;
    Ok(File::open(path)?.sync_all()?)
}

/// `count` of the rays, evenly spread over them, after one that hits; `None` if none hits.
fn first_of(scene: &Scene, rays: &[Ray], count: usize) -> Option<Vec<Ray>> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.batch(rays).nearest(&mut hits);
    let first = hits.iter().position(Hit::is_hit)?;
    let count = count.min(rays.len());
    let spread = (1..count).map(|i| i * rays.len() / count);
    Some([first].into_iter().chain(spread).map(|i| rays[i]).collect())
}

impl Camera {
    /// The camera that frames all visible instances of a scene, and the diagonal of their box;
    /// `None` without instances.
    pub(crate) fn framing_instances(scene: &Scene, size: (u32, u32)) -> Option<(Camera, f64)> {
        let boxes = (0..scene.instance_count()).filter_map(|i| scene.instance_bounds(i));
        let boxes: Vec<[DVec3; 2]> = boxes.map(|(low, high)| [position(low), position(high)]).collect();
        let [lower, upper] = boxes.iter().copied().reduce(|[l, u], [low, high]| [l.min(low), u.max(high)])?;
        let corner =
            |ends: &[DVec3; 2], i: usize| DVec3::new(ends[i & 1].x, ends[i >> 1 & 1].y, ends[i >> 2].z);
        let corners: Vec<DVec3> = boxes.iter().flat_map(|ends| (0..8).map(|i| corner(ends, i))).collect();
        let diagonal = (upper - lower).length();
        let from = DVec3::new(0.8, 0.5, 1.0);
        Some((Camera::framing(&corners, 0.5 * (lower + upper), diagonal, from, size), diagonal))
    }
}
