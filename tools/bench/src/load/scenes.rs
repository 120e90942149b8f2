//! Opening a compiled scene and tracing the first rays, against building all its objects at the start.

use super::files::{self, PageCache, Scratch};
use super::first_rays::{SIZE, first_of};
use super::results::StartCase;
use super::scene_results::{SceneLoadResults, SceneStarts};
use super::scene_tables;
use super::starts::StartRounds;
use crate::args::{LoadScenes, Start};
use crate::isa;
use crate::model::position;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rays::Camera;
use crate::rivals::embree;
use anyhow::{Context, Result};
use bth::rays::{Hit, Ray};
use bth_compile::Silent;
use bth_compile::pipeline::{CompileOptions, Structure};
use bth_compile::scene;
use bth_scenes::{catalogue, write};
use glam::DVec3;
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or scene cannot be used, a start fails or a file cannot be written.
pub fn run(arguments: &LoadScenes) -> Result<()> {
    let starts = &arguments.starts;
    let isa = isa::select(starts.isa.as_deref())?;
    let options = json!({"rays": starts.rays, "rounds": starts.rounds});
    let mut results = SceneLoadResults {
        head: Head::now("load-scenes", isa.clone(), options),
        rays: starts.rays,
        picture: (SIZE.0 * SIZE.1) as usize + starts.rays,
        scenes: Vec::new(),
    };
    let progress = Progress::new();
    for which in &arguments.scenes {
        results.scenes.push(measure(which, arguments, &isa, &progress)?);
    }
    Report {
        head: &results.head,
        title: "Load against rebuild of scenes",
        body: scene_tables::markdown(&results),
        json: serde_json::to_value(&results)?,
        charts: scene_tables::draw(&results),
    }
    .write(&starts.output)
}

fn measure(which: &str, arguments: &LoadScenes, isa: &str, progress: &Progress) -> Result<SceneStarts> {
    let scratch = Scratch::new(arguments.starts.scratch.as_deref())?;
    let source = source(which, &scratch)?;
    let name = source.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (mut cases, mut compile_s, mut file_bytes) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
    let mut opened = None;
    for (kind, structure) in [("bth", Structure::Bth), ("bvh", Structure::Bvh)] {
        progress.show(format!("{name}: compiling {kind}"));
        let clock = Instant::now();
        let bytes = compile(&source, structure)?;
        compile_s.insert(kind, clock.elapsed().as_secs_f64());
        file_bytes.insert(kind, bytes.len());
        let file = scratch.write(&format!("{kind}.bth"), &bytes)?;
        for start in [Start::Map, Start::Read] {
            for cache in PageCache::ALL {
                cases.push(StartCase::of_file(kind, start, cache, file.clone(), bytes.len()));
            }
        }
        opened = Some(bth::from_bytes(&bytes)?);
    }
    let opened = opened.context("two files were compiled")?;
    match embree::available() {
        Ok(()) => {
            let file = scratch.write("objects", &files::scene_bytes(&opened))?;
            for (name, start) in [("embree", Start::EmbreeScene), ("embree robust", Start::EmbreeSceneRobust)]
            {
                cases.push(StartCase { name: name.to_owned(), ..StartCase::of_rival(start, file.clone()) });
            }
        }
        Err(error) => note(&format!("{name}: embree: not measured: {error:#}")),
    }
    let rays = picture(&opened, arguments.starts.rays).with_context(|| format!("{name}: nothing is seen"))?;
    let rays = scratch.write("rays", files::ray_bytes(&rays))?;
    let first = Some(arguments.starts.rays);
    let starts = &arguments.starts;
    let rounds = StartRounds { name: &name, cases: &cases, starts, first, isa, rays: &rays };
    let runs = rounds.run(progress)?;
    let objects = opened.object_count();
    let triangles = (0..objects).map(|object| u64::from(opened.object(object).header.triangles)).sum();
    Ok(SceneStarts {
        name,
        objects,
        instances: opened.instance_count(),
        triangles,
        compile_s,
        file_bytes,
        runs,
    })
}

/// The scene's file; that of a generated one is made.
fn source(which: &str, scratch: &Scratch) -> Result<PathBuf> {
    let Some(count) = which.strip_prefix("objects:") else { return Ok(PathBuf::from(which)) };
    let count: u32 = count.parse().with_context(|| format!("{which}: expected a number of objects"))?;
    let entry = catalogue::find("blob").context("a generated model")?;
    let mut model = (entry.make)(800);
    let mut text = String::from("version = 1\n");
    for i in 0..count {
        // Each has a shape of its own.
        model.positions.iter_mut().for_each(|p| p[0] *= 1.0 + 1.0 / 1024.0);
        let file = scratch.write(&format!("{i}.ply"), &write::ply(&model))?;
        let place = [3 * (i % 40), 0, 3 * (i / 40)];
        writeln!(text, "[[objects]]\nname = \"o{i}\"\nmodel = {:?}", file.file_name().unwrap_or_default())?;
        writeln!(text, "[[nodes]]\nname = \"n{i}\"\nobject = \"o{i}\"\ntranslation = {place:?}")?;
    }
    scratch.write(&format!("{count} objects.manifest"), text.as_bytes())
}

fn compile(source: &Path, structure: Structure) -> Result<Vec<u8>> {
    let manifest = match source.extension().is_some_and(|e| e == "manifest") {
        true => bth_scene::read(source)?,
        false => {
            let name = source.file_name().unwrap_or_default().to_string_lossy();
            bth_import::gltf::scene::import(
                source,
                &name,
                &bth_import::gltf::scene::ImportOptions::default(),
                &Silent,
            )?
            .0
        }
    };
    let folder = source.parent().unwrap_or(Path::new("."));
    let options = CompileOptions { structure, ..CompileOptions::default() };
    Ok(scene::compile(&manifest, folder, source, &options, &Silent)?.0.bytes)
}

/// Rays of a picture of the whole scene, after an even share of them that begins with a hit.
fn picture(scene: &bth::Scene, first: usize) -> Option<Vec<Ray>> {
    let boxes = (0..scene.instance_count()).filter_map(|instance| scene.instance_bounds(instance));
    let (lower, upper) = boxes.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lower, upper), (l, u)| {
        (lower.min(position(l)), upper.max(position(u)))
    });
    let corner = |k: u32| {
        DVec3::from_array([0, 1, 2].map(|axis| if k >> axis & 1 == 0 { lower[axis] } else { upper[axis] }))
    };
    let corners: Vec<DVec3> = (0..8).map(corner).collect();
    let (middle, diagonal) = (0.5 * (lower + upper), (upper - lower).length());
    let all = Camera::framing(&corners, middle, diagonal, DVec3::new(0.8, 0.5, 1.0), SIZE).rays();
    let mut hits = vec![Hit::MISS; all.len()];
    scene.batch(&all).nearest(&mut hits);
    let mut rays = first_of(&all, &hits, first)?;
    rays.extend(&all);
    Some(rays)
}
