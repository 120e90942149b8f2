//! Scenes that move, frame by frame: the paper's Table 3 on our animations, and Embree with the same instances.
//!
//! `source` loads scenes, `frame_rays` makes the rays of a frame, and `contenders` traces them.

mod contenders;
mod frame_rays;
mod results;
mod source;
mod tables;

pub(crate) use frame_rays::FrameRays;
pub use results::{ContenderRow, SceneTimes, ScenesResults};
pub(crate) use source::{Source, compiled};
pub use tables::markdown;

use crate::args::Scenes;
use crate::clock::Clock;
use crate::isa;
use crate::output::{Head, Report, note};
use crate::progress::Progress;
use crate::rounds::median;
use anyhow::{Context, Result, ensure};
use bth::rays::Hit;
use contenders::{CONTENDERS, Frame, MovingContender};
use serde_json::json;

/// Sets of rays of a frame.
pub const SETS: [&str; 3] = ["camera", "diffuse", "later"];

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or scene cannot be used, an answer of ours differs from that of our plain BVH, or a file cannot be written.
pub fn run(arguments: &Scenes) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let size = if arguments.run.quick { (96, 64) } else { arguments.size() };
    let progress = Progress::new();
    let options = json!({
        "pixels": size, "frames": arguments.frames, "rounds": arguments.rounds, "bounces": frame_rays::BOUNCES,
        "threads": 1, "quick": arguments.run.quick,
    });
    let mut results = ScenesResults { head: Head::now("scenes", isa, options), scenes: Vec::new() };
    for name in &arguments.scenes {
        let source = Source::load(name)?;
        results.scenes.push(scene(&source, arguments, size, &progress)?);
    }
    drop(progress);
    for scene in &results.scenes {
        scene.left_out.iter().for_each(|why| note(&format!("{}: {why}", scene.name)));
    }
    let body = markdown(&results);
    let json = serde_json::to_value(&results)?;
    Report { head: &results.head, title: "Scenes that move", body, json, charts: Vec::new() }
        .write(&arguments.run.output)?;
    let wrong = results.scenes.iter().flat_map(|s| &s.rows).find(|r| r.ours && r.differ > 0);
    ensure!(wrong.is_none(), "{} answers another than the plain BVH", wrong.map_or("", |r| r.name.as_str()));
    Ok(())
}

fn scene(source: &Source, arguments: &Scenes, size: (u32, u32), progress: &Progress) -> Result<SceneTimes> {
    progress.show(format!("{}: compiling", source.name));
    let plain = contenders::compile(source, &CONTENDERS[1])?;
    let mut shown = bth::from_bytes(&plain.bytes).context("a file that was just compiled")?;
    let mut results = SceneTimes {
        name: source.name.clone(),
        instances: shown.instance_count(),
        objects: shown.object_count(),
        triangles: (0..shown.instance_count())
            .map(|i| u64::from(shown.object(shown.object_of(i)).header.triangles))
            .sum(),
        frames: source.frames(arguments.frames),
        rays: [0; 3],
        rows: Vec::new(),
        left_out: Vec::new(),
    };
    let mut contenders = Vec::new();
    for kind in &CONTENDERS {
        if !arguments.tracers.select(kind.name) {
            continue;
        }
        progress.show(format!("{}: {}", source.name, kind.name));
        match contenders::build(source, kind, &shown) {
            Ok(contender) => contenders.push(contender),
            Err(why) => results.left_out.push(format!("{}: {why:#}", kind.name)),
        }
    }
    let mut taken = vec![[0.0; 4]; contenders.len()];
    let mut differ = vec![0; contenders.len()];
    for (i, number) in results.frames.clone().into_iter().enumerate() {
        progress.show(format!("{}: frame {} of {}", source.name, i + 1, results.frames.len()));
        shown.set_frame(number)?;
        let frame = Frame::of(&shown, number);
        let frame_rays = FrameRays::of(&shown, size)?;
        for (sum, set) in results.rays.iter_mut().zip(&frame_rays.sets) {
            *sum += set.rays.len() as u64;
        }
        let times = measure(&mut contenders, &frame, &frame_rays, arguments.rounds, &mut differ)?;
        for (sums, times) in taken.iter_mut().zip(times) {
            sums.iter_mut().zip(times).for_each(|(sum, time)| *sum += time);
        }
    }
    let count = results.frames.len() as f64;
    for ((contender, taken), differ) in contenders.iter().zip(&taken).zip(differ) {
        results.rows.push(ContenderRow {
            name: contender.name.to_owned(),
            ours: contender.ours,
            build_s: contender.build_s,
            in_tets: contender.in_tets,
            milliseconds: taken.map(|seconds| 1e3 * seconds / count),
            differ,
        });
    }
    Ok(results)
}

/// Median seconds of each contender: for the update of a frame and for each set of its rays. Rounds are interleaved: every
/// contender comes once in each.
fn measure(
    contenders: &mut [MovingContender],
    frame: &Frame,
    frame_rays: &FrameRays,
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
            for set in &frame_rays.sets {
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
