//! Opening a compiled file and tracing the first rays, against building at the start.
//!
//! Every start runs in a process of its own ([`probe`]), so that nothing is left over from the one before.

mod files;
mod first_rays;
pub mod probe;
mod results;
mod scene_results;
mod scene_tables;
pub mod scenes;
mod starts;
mod tables;

use results::StartCase;
pub use results::{LoadResults, ModelStarts, StartsRun, Times};
pub use scene_results::{SceneLoadResults, SceneStarts};
pub use tables::{draw, markdown};

use crate::args::{Load, Start};
use crate::model::Model;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rays::{self, Finder, RaySet};
use crate::rivals::embree;
use crate::{isa, structures};
use anyhow::{Context, Result};
use bth::rays::{Hit, Ray};
use files::{PageCache, Scratch};
use first_rays::{SIZE, first_of};
use serde_json::json;
use starts::StartRounds;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or model cannot be used, a start fails or a file cannot be written.
pub fn run(arguments: &Load) -> Result<()> {
    let results = measure(arguments)?;
    for model in &results.models {
        for (name, why) in &model.left_out {
            note(&format!("{}: {name}: not measured: {why}", model.name));
        }
    }
    Report {
        head: &results.head,
        title: "Load against rebuild",
        body: markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: draw(&results),
    }
    .write(&arguments.starts.output)
}

/// Measures all models.
///
/// # Errors
/// If a model cannot be used or a start fails.
pub fn measure(arguments: &Load) -> Result<LoadResults> {
    let isa = isa::select(arguments.starts.isa.as_deref())?;
    let options = json!({"rays": arguments.starts.rays, "rounds": arguments.starts.rounds});
    let mut results = LoadResults {
        head: Head::now("load", isa.clone(), options),
        rays: arguments.starts.rays,
        models: Vec::new(),
    };
    let progress = Progress::new();
    for which in &arguments.models.models {
        results.models.push(measure_model(which, arguments, &isa, &progress)?);
    }
    Ok(results)
}

fn measure_model(which: &str, arguments: &Load, isa: &str, progress: &Progress) -> Result<ModelStarts> {
    let model = Model::load(which)?;
    let scratch = Scratch::new(arguments.starts.scratch.as_deref())?;
    let mut cases = Vec::new();
    let mut finder_scene = None;
    for kind in [&structures::BTH, &structures::BVH] {
        progress.show(format!("{}: compiling {}", model.name, kind.name));
        let compiled = structures::compile(&model, kind)?;
        let file = scratch.write(&format!("{}.bth", kind.name), &compiled.bytes)?;
        for start in [Start::Map, Start::Read] {
            for cache in PageCache::ALL {
                cases.push(StartCase::of_file(kind.name, start, cache, file.clone(), compiled.bytes.len()));
            }
        }
        finder_scene = Some(bth::from_bytes(&compiled.bytes)?);
    }
    let mut left_out = Vec::new();
    match embree::available() {
        Ok(()) => {
            let file = scratch.write("mesh", &files::mesh_bytes(&model.mesh))?;
            for start in [Start::Embree, Start::EmbreeRobust] {
                cases.push(StartCase::of_rival(start, file.clone()));
            }
        }
        Err(error) => left_out.push(("embree".to_owned(), format!("{error:#}"))),
    }

    progress.show(format!("{}: making rays", model.name));
    let scene = finder_scene.expect("two files were compiled");
    let options = rays::Options { size: SIZE, most: usize::MAX, view: arguments.models.seen_from.view() };
    let (view, sets) = rays::sets(&Finder::new(&model, &scene), &options);
    let rays = first_rays(&sets[0], &scene, arguments.starts.rays)
        .with_context(|| format!("{}: the camera sees nothing", model.name))?;
    let rays = scratch.write("rays", files::ray_bytes(&rays))?;

    let starts = &arguments.starts;
    let rounds = StartRounds { name: &model.name, cases: &cases, starts, first: None, isa, rays: &rays };
    let runs = rounds.run(progress)?;
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
    scene.batch(&primary.rays).nearest(&mut hits);
    first_of(&primary.rays, &hits, count)
}
