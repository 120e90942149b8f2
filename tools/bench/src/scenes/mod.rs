//! Scenes that move, frame by frame: the paper's Table 3 on our animations, and Embree with the same instances.
//!
//! `shots` makes the rays of a frame, `contenders` what traces them.

mod contenders;
mod record;
mod shots;
mod tables;

pub use record::{Row, SceneRecord, ScenesRecord};
pub use tables::markdown;

use crate::args::Scenes;
use crate::clock::Clock;
use crate::isa;
use crate::output::{Head, Record as Page, note};
use crate::progress::Progress;
use crate::rounds::median;
use anyhow::{Context, Result, ensure};
use bth::rays::Hit;
use bth_scene::Manifest;
use contenders::{Contender, Frame, KINDS};
use serde_json::json;
use shots::Shots;
use std::path::PathBuf;

/// Sets of rays of a frame.
pub const SETS: [&str; 3] = ["camera", "diffuse", "later"];

/// Measures, prints and writes the record.
///
/// # Errors
/// If an option or scene cannot be used, an answer of ours differs from that of our plain BVH, or a file cannot be written.
pub fn run(arguments: &Scenes) -> Result<()> {
    let isa = isa::select(arguments.isa.as_deref())?;
    let size = if arguments.quick { (96, 64) } else { arguments.size() };
    let progress = Progress::new();
    let options = json!({
        "pixels": size, "frames": arguments.frames, "rounds": arguments.rounds, "bounces": shots::BOUNCES,
        "threads": 1, "quick": arguments.quick,
    });
    let mut record = ScenesRecord { head: Head::now("scenes", isa, options), scenes: Vec::new() };
    for name in &arguments.scenes {
        let source = Source::load(name)?;
        record.scenes.push(scene(&source, arguments, size, &progress)?);
    }
    drop(progress);
    for scene in &record.scenes {
        scene.left_out.iter().for_each(|why| note(&format!("{}: {why}", scene.name)));
    }
    let body = markdown(&record);
    let json = serde_json::to_value(&record)?;
    Page { head: &record.head, title: "Scenes that move", body, json, charts: Vec::new() }
        .write(&arguments.output)?;
    let wrong = record.scenes.iter().flat_map(|s| &s.rows).find(|r| r.ours && r.differ > 0);
    ensure!(wrong.is_none(), "{} answers another than the plain BVH", wrong.map_or("", |r| r.name.as_str()));
    Ok(())
}

/// A manifest and where its models are.
pub(crate) struct Source {
    name: String,
    manifest: Manifest,
    folder: PathBuf,
    /// Of our own scenes, until the end.
    _models: Option<tempfile::TempDir>,
}

impl Source {
    /// A scene of our own by name, or a manifest.
    fn load(name: &str) -> Result<Source> {
        if let Some(animation) = bth_scenes::animations::find(name) {
            let scene = (animation.make)();
            let folder = tempfile::tempdir()?;
            for (path, model) in &scene.models {
                let path = folder.path().join(path);
                std::fs::create_dir_all(path.parent().context("models lie in a folder")?)?;
                bth_scenes::write::file(model, &path)?;
            }
            let (name, manifest) = (name.to_owned(), scene.manifest);
            return Ok(Source { name, manifest, folder: folder.path().into(), _models: Some(folder) });
        }
        let path = PathBuf::from(name);
        let manifest = bth_scene::read(&path).with_context(|| format!("no scene or manifest `{name}`"))?;
        let folder = path.parent().map_or_else(|| PathBuf::from("."), PathBuf::from);
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Source { name, manifest, folder, _models: None })
    }
}

/// So many frames, evenly over the range.
fn frames(manifest: &Manifest, count: usize) -> Vec<i32> {
    let (first, last) = (i64::from(manifest.frames.first), i64::from(manifest.frames.last));
    let count = (count as i64).min(last - first + 1);
    (0..count).map(|i| (first + (last - first) * (2 * i + 1) / (2 * count)) as i32).collect()
}

fn scene(source: &Source, arguments: &Scenes, size: (u32, u32), progress: &Progress) -> Result<SceneRecord> {
    progress.say(format!("{}: compiling", source.name));
    let plain = contenders::compile(source, &KINDS[1])?;
    let mut shown = bth::from_bytes(&plain.bytes).context("a file that was just compiled")?;
    let mut record = SceneRecord {
        name: source.name.clone(),
        instances: shown.instance_count(),
        objects: shown.object_count(),
        triangles: (0..shown.instance_count())
            .map(|i| u64::from(shown.object(shown.object_of(i)).header.triangles))
            .sum(),
        frames: frames(&source.manifest, arguments.frames),
        rays: [0; 3],
        rows: Vec::new(),
        left_out: Vec::new(),
    };
    let mut contenders = Vec::new();
    for kind in &KINDS {
        if !arguments.tracers.select(kind.name) {
            continue;
        }
        progress.say(format!("{}: {}", source.name, kind.name));
        match contenders::build(source, kind, &shown) {
            Ok(contender) => contenders.push(contender),
            Err(why) => record.left_out.push(format!("{}: {why:#}", kind.name)),
        }
    }
    let mut taken = vec![[0.0; 4]; contenders.len()];
    let mut differ = vec![0; contenders.len()];
    for (i, number) in record.frames.clone().into_iter().enumerate() {
        progress.say(format!("{}: frame {} of {}", source.name, i + 1, record.frames.len()));
        shown.set_frame(number)?;
        let frame = Frame::of(&shown, number);
        let shots = Shots::of(&shown, size)?;
        for (sum, set) in record.rays.iter_mut().zip(&shots.sets) {
            *sum += set.rays.len() as u64;
        }
        let times = measure(&mut contenders, &frame, &shots, arguments.rounds, &mut differ)?;
        for (sums, times) in taken.iter_mut().zip(times) {
            sums.iter_mut().zip(times).for_each(|(sum, time)| *sum += time);
        }
    }
    let count = record.frames.len() as f64;
    for ((contender, taken), differ) in contenders.iter().zip(&taken).zip(differ) {
        record.rows.push(Row {
            name: contender.name.to_owned(),
            ours: contender.ours,
            build_s: contender.build_s,
            in_tets: contender.in_tets,
            milliseconds: taken.map(|seconds| 1e3 * seconds / count),
            differ,
        });
    }
    Ok(record)
}

/// Median seconds of each contender: for the update of a frame and for each set of its rays. Rounds are interleaved: every
/// contender comes once in each.
fn measure(
    contenders: &mut [Contender],
    frame: &Frame,
    shots: &Shots,
    rounds: usize,
    differ: &mut [u64],
) -> Result<Vec<[f64; 4]>> {
    let mut times = vec![[const { Vec::new() }; 4]; contenders.len()];
    // A round before those that count warms up.
    for round in 0..=rounds {
        for (row, contender) in contenders.iter_mut().enumerate() {
            contender.moving.hide()?;
            let mut result = Ok(());
            let update = Clock::ThreadCpu.time(|| result = contender.moving.show(frame));
            result?;
            let mut all = vec![update];
            for set in &shots.sets {
                let mut hits = vec![Hit::MISS; set.rays.len()];
                all.push(Clock::ThreadCpu.time(|| contender.moving.nearest(set.batch(), &mut hits)));
                if round == 0 {
                    differ[row] += set.differences(&hits, contender.ours);
                }
            }
            if round > 0 {
                times[row].iter_mut().zip(all).for_each(|(times, time)| times.push(time));
            }
        }
    }
    let median = |times: Vec<f64>| median(times).unwrap_or(f64::NAN);
    Ok(times.into_iter().map(|times| times.map(median)).collect())
}
