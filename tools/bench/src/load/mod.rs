//! Opening a compiled file and tracing the first rays, against building at the start.
//!
//! Every start runs in a process of its own ([`probe`]), so that nothing is left over from the one before.

mod files;
pub mod probe;
mod record;
mod scene_tables;
pub mod scenes;
mod tables;

use record::Case;
pub use record::{LoadRecord, ModelStarts, Run, Times};
pub use tables::{draw, markdown};

use crate::args::{Load, Starts};
use crate::model::Model;
use crate::output::{Head, Record, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rivals::embree;
use crate::{isa, ours};
use anyhow::{Context, Result, ensure};
use bth::rays::{Hit, Ray};
use files::{PageCache, Scratch};
use probe::{Probed, Start};
use serde_json::json;
use std::path::Path;
use std::process::Command;

/// Pixels of the camera that the first rays are taken from.
const SIZE: (u32, u32) = (512, 288);

/// Measures, prints and writes the record.
///
/// # Errors
/// If an option or model cannot be used, a start fails or a file cannot be written.
pub fn run(arguments: &Load) -> Result<()> {
    let record = measure(arguments)?;
    for model in &record.models {
        for (name, why) in &model.left_out {
            note(&format!("{}: {name}: not measured: {why}", model.name));
        }
    }
    Record {
        head: &record.head,
        title: "Load against rebuild",
        body: markdown(&record),
        json: serde_json::to_value(&record)?,
        charts: draw(&record),
    }
    .write(&arguments.starts.output)
}

/// Measures all models.
///
/// # Errors
/// If a model cannot be used or a start fails.
pub fn measure(arguments: &Load) -> Result<LoadRecord> {
    let isa = isa::select(arguments.starts.isa.as_deref())?;
    let options = json!({"rays": arguments.starts.rays, "rounds": arguments.starts.rounds});
    let mut record = LoadRecord {
        head: Head::now("load", isa.clone(), options),
        rays: arguments.starts.rays,
        models: Vec::new(),
    };
    let progress = Progress::new();
    for which in &arguments.models.models {
        record.models.push(measure_model(which, arguments, &isa, &progress)?);
    }
    Ok(record)
}

fn measure_model(which: &str, arguments: &Load, isa: &str, progress: &Progress) -> Result<ModelStarts> {
    let model = Model::load(which)?;
    let scratch = Scratch::new(arguments.starts.scratch.as_deref())?;
    let mut cases = Vec::new();
    let mut finder_scene = None;
    for kind in [&ours::BTH, &ours::BVH] {
        progress.say(format!("{}: compiling {}", model.name, kind.name));
        let compiled = ours::compile(&model, kind)?;
        let file = scratch.write(&format!("{}.bth", kind.name), &compiled.bytes)?;
        for start in [Start::Map, Start::Read] {
            for cache in PageCache::ALL {
                cases.push(Case::of_file(kind.name, start, cache, file.clone(), compiled.bytes.len()));
            }
        }
        finder_scene = Some(bth::from_bytes(&compiled.bytes)?);
    }
    let mut left_out = Vec::new();
    match embree::available() {
        Ok(()) => {
            let file = scratch.write("mesh", &files::mesh_bytes(&model.mesh))?;
            for start in [Start::Embree, Start::EmbreeRobust] {
                cases.push(Case::of_rival(start, file.clone()));
            }
        }
        Err(error) => left_out.push(("embree".to_owned(), format!("{error:#}"))),
    }

    progress.say(format!("{}: making rays", model.name));
    let scene = finder_scene.expect("two files were compiled");
    let options = rays::Options { size: SIZE, most: usize::MAX, view: arguments.models.view() };
    let (view, sets) = rays::sets(&Finder::new(&model, &scene), &options);
    let rays = first_rays(&sets[0], &scene, arguments.starts.rays)
        .with_context(|| format!("{}: the camera sees nothing", model.name))?;
    let rays = scratch.write("rays", files::ray_bytes(&rays))?;

    let runs = runs(&model.name, &cases, &arguments.starts, None, isa, &rays, progress)?;
    Ok(ModelStarts {
        name: model.name.clone(),
        triangles: model.triangles(),
        view,
        file_bytes: cases.iter().filter(|c| c.file_bytes > 0).map(|c| (c.structure, c.file_bytes)).collect(),
        left_out,
        runs,
    })
}

/// Rays of the camera, evenly spread over the picture, after one that hits.
fn first_rays(primary: &RaySet, scene: &bth::Scene, count: usize) -> Option<Vec<Ray>> {
    let mut hits = vec![Hit::MISS; primary.rays.len()];
    scene.nearest_batch(&primary.rays, None, &mut hits);
    first_of(&primary.rays, &hits, count)
}

/// So many of the rays, evenly spread, after one that hits; `None` if none does.
fn first_of(rays: &[Ray], hits: &[Hit], count: usize) -> Option<Vec<Ray>> {
    let first = hits.iter().position(Hit::is_hit)?;
    let spread = (0..count.min(hits.len())).map(|i| i * hits.len() / count.min(hits.len()));
    Some([first].into_iter().chain(spread.skip(1)).map(|i| rays[i]).collect())
}

/// Starts all cases on all numbers of threads, interleaved. `first` of the rays are the first; all if absent.
fn runs(
    name: &str,
    cases: &[Case],
    starts: &Starts,
    first: Option<usize>,
    isa: &str,
    rays: &Path,
    progress: &Progress,
) -> Result<Vec<Run>> {
    let mut runs = Vec::new();
    for &threads in &starts.threads {
        let mut taken = vec![Vec::new(); cases.len()];
        for round in 0..=starts.rounds {
            for (case, taken) in cases.iter().zip(&mut taken) {
                progress.say(format!("{name}: {}, {threads} thread(s), round {round}", case.name));
                case.cache.prepare(&case.file)?;
                let probed = spawn(case, threads, first, isa, rays).with_context(|| case.name.clone())?;
                // The first finds programs and libraries that are on no page yet.
                if round > 0 {
                    taken.push(probed);
                }
            }
        }
        let hits: Vec<usize> = taken.iter().flatten().map(|p| p.hits).collect();
        ensure!(
            hits.iter().all(|h| h.abs_diff(hits[0]) * 100 <= hits[0]),
            "starts disagree on what is hit: {hits:?}"
        );
        let times = cases.iter().zip(taken).map(|(case, taken)| (case.name.clone(), Times::medians(&taken)));
        runs.push(Run { threads, starts: times.collect() });
    }
    Ok(runs)
}

fn spawn(case: &Case, threads: usize, first: Option<usize>, isa: &str, rays: &Path) -> Result<Probed> {
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["probe", "--start", case.start.name(), "--threads", &threads.to_string(), "--isa", isa]);
    command.args(first.map(|n| format!("--first={n}")));
    let output = command.arg(&case.file).arg(rays).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(serde_json::from_slice(&output.stdout)?)
}
