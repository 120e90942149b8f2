//! Scenes whose objects deform (`bth-bench animation`): over a whole animation, updates, and rays through refitted trees beside trees
//! that are built anew for each frame, ours and Embree's.
//!
//! `frame_mesh` has the triangles of a frame, `contenders` the trees over them, `tables` the page.

mod contenders;
mod frame_mesh;
mod tables;

use crate::args::Animation;
use crate::clock::Clock;
use crate::isa;
use crate::output::{Head, Report};
use crate::progress::Progress;
use crate::rounds::median;
use crate::scenes::{FrameRays, Source, compiled};
use anyhow::{Result, ensure};
use bth::rays::Hit;
use bth_compile::pipeline::MotionOptions;
use contenders::{NAMES, Trees};
use frame_mesh::FrameMesh;
use serde::Serialize;
use serde_json::json;

/// What was measured of a scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnimationTimes {
    /// Name of the scene.
    pub name: String,
    /// Triangles of all visible instances.
    pub triangles: usize,
    /// Frames that were measured.
    pub frames: Vec<i32>,
    /// The times of each tracer.
    pub rows: Vec<TreeTimes>,
    /// Updates of our scene by number of threads.
    pub updates: Vec<UpdateTimes>,
    /// The greatest cost ratio of an update.
    pub cost_ratio: f64,
    /// Whether no instance has a transform, so that trees compiled anew have the same triangles, bit for bit.
    pub same_triangles: bool,
}

/// Rays through the trees of a tracer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TreeTimes {
    /// The tracer.
    pub tracer: &'static str,
    /// Milliseconds to bring the tree to a frame, by one thread, mean over the frames. Ours computes the positions too; others are
    /// given them.
    pub ready_ms: f64,
    /// Nanoseconds a ray, mean over all frames, by set.
    pub ns_per_ray: [f64; 3],
    /// Answers that are not those of our scene.
    pub differ: u64,
}

/// Updates of our scene: positions, refit, instances, top level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UpdateTimes {
    /// Number of threads.
    pub threads: usize,
    /// Milliseconds: medians of the rounds, mean over the frames.
    pub mean_ms: f64,
    /// The same for positions and refit alone, by the wall clock.
    pub refit_ms: f64,
    /// The quickest round, mean over the frames: other work on the machine disturbs it least.
    pub least_refit_ms: f64,
}

/// Measures, prints and writes the report.
///
/// # Errors
/// If an option or scene cannot be used, Embree is missing, an answer differs from that of a tree of ours that is compiled anew, or the report
/// cannot be written.
pub fn run(arguments: &Animation) -> Result<()> {
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let progress = Progress::new();
    let options = json!({
        "pixels": arguments.size(), "frames": arguments.frames, "rounds": arguments.rounds, "quick": arguments.run.quick,
        "poses": arguments.poses, "segments": arguments.segments,
    });
    let head = Head::now("animation", isa, options);
    let mut scenes = Vec::new();
    for name in &arguments.scenes {
        scenes.push(scene(&Source::load(name)?, arguments, &progress)?);
    }
    drop(progress);
    let json = json!({ "head": head, "scenes": scenes });
    let body = tables::markdown(&scenes);
    Report { head: &head, title: "Scenes whose objects deform", body, json, charts: Vec::new() }
        .write(&arguments.run.output)?;
    let wrong = scenes.iter().find(|scene| scene.same_triangles && scene.rows[1].differ > 0);
    ensure!(wrong.is_none(), "{}: a tree compiled anew answers otherwise", wrong.map_or("", |s| &s.name));
    Ok(())
}

fn scene(source: &Source, arguments: &Animation, progress: &Progress) -> Result<AnimationTimes> {
    progress.show(format!("{}: compiling", source.name));
    let mut shown = compiled(source, MotionOptions { poses: arguments.poses, segments: arguments.segments })?;
    let frames = source.frames(arguments.frames);
    let rounds = if arguments.run.quick { 1 } else { arguments.rounds };
    let mut updates = Vec::new();
    let mut cost_ratio = 1.0f64;
    for &threads in &arguments.threads {
        let (times, worst) = measure_updates(&mut shown, &frames, threads, rounds)?;
        updates.push(times);
        cost_ratio = cost_ratio.max(worst);
    }
    shown.set_frame(source.manifest.frames.first)?;
    let mut trees = Trees::new(shown)?;
    let mut triangles = 0;
    let mut sums = [(0.0, [0.0; 3], 0u64); NAMES.len()];
    let mut rays = [0usize; 3];
    for (i, &number) in frames.iter().enumerate() {
        progress.show(format!("{}: frame {} of {}", source.name, i + 1, frames.len()));
        trees.shown.set_frame(number)?;
        let mesh = FrameMesh::of(&trees.shown);
        let frame_rays = FrameRays::of(&trees.shown, arguments.size())?;
        triangles = mesh.triangles.len();
        rays.iter_mut().zip(&frame_rays.sets).for_each(|(count, set)| *count += set.rays.len());
        let ready = trees.bring_to(number, &mesh)?;
        sums.iter_mut().zip(ready).for_each(|(sum, seconds)| sum.0 += seconds);
        trace(&trees, &frame_rays, rounds, &mut sums);
    }
    let count = frames.len() as f64;
    let rows = NAMES.iter().zip(sums).map(|(tracer, (ready, sets, differ))| TreeTimes {
        tracer,
        ready_ms: 1e3 * ready / count,
        ns_per_ray: [0, 1, 2].map(|k| 1e9 * sets[k] / rays[k].max(1) as f64),
        differ,
    });
    Ok(AnimationTimes {
        name: source.name.clone(),
        triangles,
        rows: rows.collect(),
        frames,
        updates,
        cost_ratio,
        same_triangles: trees.same_triangles,
    })
}

/// Adds the seconds that each contender takes for the rays of a frame, medians of interleaved rounds, and the answers that differ.
fn trace(trees: &Trees, frame_rays: &FrameRays, rounds: usize, sums: &mut [(f64, [f64; 3], u64)]) {
    let contenders = trees.contenders();
    for (k, set) in frame_rays.sets.iter().enumerate() {
        let mut times = vec![Vec::new(); contenders.len()];
        // A round before those that count warms up. Each contender follows each other one in turn, since what ran before leaves caches to it.
        for round in 0..=rounds {
            for row in turns(round, contenders.len()) {
                let contender = contenders[row];
                let mut hits = vec![Hit::MISS; set.rays.len()];
                let seconds = Clock::ThreadCpu.time(|| contender.nearest(set.batch(), &mut hits));
                if round == 0 {
                    sums[row].2 += set.other_distances(&hits, row < 2 && trees.same_triangles);
                } else {
                    times[row].push(seconds);
                }
            }
        }
        for (sum, times) in sums.iter_mut().zip(times) {
            sum.1[k] += median(times).unwrap_or(f64::NAN);
        }
    }
}

/// The order of contenders in a round: from another one on in each, and backwards in every other one.
fn turns(round: usize, count: usize) -> impl Iterator<Item = usize> {
    (0..count).map(move |turn| {
        let turn = if round.is_multiple_of(2) { turn } else { count - 1 - turn };
        (round / 2 + turn) % count
    })
}

/// The times of updates from the first frame's pose to each frame, and the greatest cost ratio.
fn measure_updates(
    scene: &mut bth::Scene,
    frames: &[i32],
    threads: usize,
    rounds: usize,
) -> Result<(UpdateTimes, f64)> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let clock = Clock::for_threads(threads);
    let mut worst = 1.0f64;
    let mut times = UpdateTimes { threads, mean_ms: 0.0, refit_ms: 0.0, least_refit_ms: 0.0 };
    for &frame in frames {
        let (mut all, mut refits) = (Vec::new(), Vec::new());
        for round in 0..=4 * rounds {
            scene.set_seconds(-1e3)?;
            let mut update = Ok(bth::Update::default());
            let seconds = pool.install(|| clock.time(|| update = scene.set_frame(frame)));
            let update = update?;
            worst = worst.max(update.deformed_cost_ratio);
            if round > 0 {
                all.push(seconds);
                refits.push(update.refit.as_secs_f64());
            }
        }
        let each = 1e3 / frames.len() as f64;
        times.least_refit_ms += each * refits.iter().copied().fold(f64::INFINITY, f64::min);
        times.mean_ms += each * median(all).unwrap_or(f64::NAN);
        times.refit_ms += each * median(refits).unwrap_or(f64::NAN);
    }
    Ok((times, worst))
}
