//! Scenes that move and objects that deform, frame by frame: the paper's Table 3 on our animations,
//! and Embree with the same instances.
//!
//! `source` loads scenes, `frame_rays` makes the rays of a frame, and `contenders` traces them.

mod contenders;
mod frame_rays;
mod source;

pub(crate) use contenders::Placed;
pub(crate) use source::Source;

use crate::args::{RunOptions, at_least_one};
use crate::clock::Clock;
use crate::isa;
use crate::names::Names;
use crate::output::progress;
use crate::report::{Head, Report, Subject};
use crate::rivals::embree;
use crate::rounds::median;
use anyhow::Result;
use bth::rays::Hit;
use clap::Args;
use contenders::{Frame, MovingContender, NAMES};
use frame_rays::{FrameRaySet, frame_rays};
use serde_json::json;

/// `scenes`.
#[derive(Debug, Args)]
pub(crate) struct Scenes {
    /// Scenes of `bth-scenes list`, manifests, glTF files, or `instances:N` for N instances that
    /// move.
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<String>,
    /// Frames to measure, evenly over the range.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub(crate) frames: usize,
    /// Rounds, after one that warms up; the median counts.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least_one)]
    pub(crate) rounds: usize,
    /// Numbers of threads for updates; rays are traced on one.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "1", value_parser = at_least_one)]
    pub(crate) threads: Vec<usize>,
    /// Width of the pictures, which are 16:9.
    #[arg(long, value_name = "PIXELS", default_value_t = 640, value_parser = clap::value_parser!(u32).range(64..=8192))]
    pub(crate) width: u32,
    /// Only these tracers; a star at the end matches any ending.
    #[arg(long = "tracer", value_name = "NAME,…", default_value = "", hide_default_value = true)]
    pub(crate) tracers: Names,
    #[command(flatten)]
    pub(crate) run: RunOptions,
}

const ABOUT: &str = "\
Medians of interleaved rounds, means over the frames; one thread by its CPU clock, several by the wall clock. `update`: \
tracks, positions, refit and top level; for Embree and `bth placed` the given transforms and the commit. Rays: the camera's, \
one cosine-weighted bounce (`diffuse`), and those after it (`later`). `bth` over `bvh` is the paper's BVH-BTH over BVH-BVH. \
`differ`: answers that are not the BVH's. `times embree`: below 1 is faster.";

/// Sets of rays of a frame.
const SETS: [&str; 3] = ["camera", "diffuse", "later"];
/// Unit of times.
const TIME: &str = "ms/frame";

/// Measures all scenes.
pub(crate) fn measure(arguments: &Scenes) -> Result<Report> {
    arguments.tracers.check("--tracer", &NAMES)?;
    let isa = isa::select(arguments.run.isa.as_deref())?;
    let width = if arguments.run.quick { 64 } else { arguments.width.next_multiple_of(4) };
    let size = (width, (width * 9 / 16).next_multiple_of(4));
    let rounds = arguments.run.rounds(arguments.rounds);
    let options = json!({
        "pixels": size, "frames": arguments.frames, "rounds": rounds, "bounces": frame_rays::BOUNCES,
        "quick": arguments.run.quick,
    });
    let mut report = Report::new(Head::now("scenes", isa, options), rounds, ABOUT);
    for name in &arguments.scenes {
        let source = Source::load(name)?;
        for &threads in &arguments.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
            pool.install(|| measure_scene(&source, arguments, size, threads, &mut report))?;
        }
    }
    report.add_ratios(embree::NAME, TIME);
    Ok(report)
}

/// The sums over the frames of a contender's seconds and differences.
#[derive(Clone, Copy, Default)]
struct Sums {
    update: f64,
    refit: f64,
    rays: [f64; SETS.len()],
    differ: u64,
}

fn measure_scene(
    source: &Source,
    arguments: &Scenes,
    size: (u32, u32),
    threads: usize,
    report: &mut Report,
) -> Result<()> {
    progress(format!("{}: compiling", source.name));
    let mut shown = contenders::plain(source)?;
    let frames = source.frames(arguments.frames);
    shown.set_frame(frames[0])?;
    let names = contenders::names(&shown).iter().filter(|name| arguments.tracers.select(name));
    let mut built = Vec::new();
    for name in names {
        progress(format!("{}: {name}", source.name));
        match contenders::build(source, name, &shown, threads) {
            Ok(contender) => built.push(contender),
            Err(why) => report.leave_out(&source.name, name, &why),
        }
    }
    let triangles = |i| u64::from(shown.object(shown.object_of(i)).header.triangles);
    let (instances, objects) = (shown.instance_count(), shown.object_count());
    let triangles: u64 = (0..instances).map(triangles).sum();
    report.notes.push(format!(
        "{}: {instances} instances of {objects} objects, {triangles} triangles; frames {frames:?}",
        source.name
    ));
    let mut sums = vec![Sums::default(); built.len()];
    for (i, &number) in frames.iter().enumerate() {
        progress(format!("{}: frame {} of {}", source.name, i + 1, frames.len()));
        shown.set_frame(number)?;
        let frame = Frame { number, places: contenders::places(&shown) };
        let sets = if threads == 1 { frame_rays(&shown, size)? } else { Vec::new() };
        measure_frame(&mut built, &frame, &sets, threads, report.rounds, &mut sums)?;
    }
    for (contender, sums) in built.iter().zip(sums) {
        let MovingContender { name, ours, build_s, .. } = contender;
        let of = Subject { engine: name, ours: *ours, model: &source.name, threads };
        let each = |seconds: f64| 1e3 * seconds / frames.len() as f64;
        report.add(&of, "update", each(sums.update), TIME);
        if sums.refit > 0.0 {
            report.add(&of, "positions and refit", each(sums.refit), "ms");
        }
        if threads == 1 {
            for (set, seconds) in SETS.iter().zip(sums.rays) {
                report.add(&of, set, each(seconds), TIME);
            }
            report.add(&of, "differ", sums.differ as f64, "rays");
        }
        report.add(&of, "build", *build_s, "s");
        if contender.exact && sums.differ > 0 {
            report.wrong.push(format!("{name} in {}", source.name));
        }
    }
    Ok(())
}

/// Adds the median seconds of each contender for a frame. Rounds are interleaved: each contender
/// comes once in each.
fn measure_frame(
    contenders: &mut [MovingContender],
    frame: &Frame,
    sets: &[FrameRaySet],
    threads: usize,
    rounds: usize,
    sums: &mut [Sums],
) -> Result<()> {
    let clock = Clock::for_threads(threads);
    let mut times = vec![[const { Vec::new() }; 2 + SETS.len()]; contenders.len()];
    // A round before those that count warms up.
    for round in 0..=rounds {
        for ((contender, times), sums) in contenders.iter_mut().zip(&mut times).zip(&mut *sums) {
            contender.moving.prepare()?;
            let mut refit = Ok(0.0);
            let update = clock.time(|| refit = contender.moving.show(frame));
            let mut taken = vec![update, refit?];
            for set in sets {
                let mut hits = vec![Hit::MISS; set.rays.len()];
                taken.push(Clock::ThreadCpu.time(|| contender.moving.nearest(set.batch(), &mut hits)));
                if round == 0 {
                    sums.differ += set.differences(&hits, contender.exact);
                }
            }
            if round > 0 {
                times.iter_mut().zip(taken).for_each(|(times, time)| times.push(time));
            }
        }
    }
    for (sums, times) in sums.iter_mut().zip(times) {
        let [update, refit, camera, diffuse, later] = times.map(|times| median(times).unwrap_or(0.0));
        sums.update += update;
        sums.refit += refit;
        sums.rays.iter_mut().zip([camera, diffuse, later]).for_each(|(sum, time)| *sum += time);
    }
    Ok(())
}
