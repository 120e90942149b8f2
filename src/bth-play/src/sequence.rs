//! A sequence of frames: which ones, one after another, and what each took.

use crate::args::Args;
use crate::failure::Failure;
use crate::frame::{self, Summary};
use crate::progress::Progress;
use crate::sink::Sink;
use crate::stage::Stage;
use bth::Scene;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// What a frame took.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FrameReport {
    /// Its number.
    pub(crate) frame: i32,
    /// Tracks, hierarchy and instances, without the top level.
    pub(crate) update_seconds: f64,
    /// Building of the top level.
    pub(crate) top_level_seconds: f64,
    /// Nodes that moved.
    pub(crate) nodes_moved: usize,
    /// Instances that were placed anew.
    pub(crate) instances_placed: usize,
    /// Instances that can be seen.
    pub(crate) instances_visible: usize,
    /// Rendering.
    #[serde(flatten)]
    pub(crate) summary: Summary,
}

/// What all frames took.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    pub(crate) frames: Vec<FrameReport>,
    /// Frames whose pictures were there already.
    pub(crate) skipped: usize,
}

/// The first and last frame of a file; one frame for files without a scene.
pub(crate) fn range(scene: &Scene) -> ((i32, i32), f64) {
    scene.description().map_or(((0, 0), 24.0), |view| {
        let scene = &view.scene[0];
        ((scene.first_frame, scene.last_frame), scene.rate)
    })
}

/// The frames that are asked for; without an output those for a window.
pub(crate) fn wanted(
    scene: &Scene,
    file: &Path,
    args: &Args,
    output: Option<&Path>,
) -> Result<(i32, i32), Failure> {
    let ((first, last), _) = range(scene);
    match args.frames {
        Some((a, b)) if a < first || b > last => Err(Failure::Usage(format!(
            "{} has frames {first} to {last}; expected some of these, found {a} to {b}",
            file.display()
        ))),
        Some(frames) => Ok(frames),
        None if output.is_some_and(is_one_picture) => Ok((first, first)),
        None => Ok((first, last)),
    }
}

fn is_one_picture(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
        && !output.to_string_lossy().contains('#')
}

/// Renders the frames that are asked for.
pub(crate) fn render(
    scene: &mut Scene,
    file: &Path,
    output: &Path,
    args: &Args,
) -> Result<(Report, bool), Failure> {
    let (whole, rate) = range(scene);
    let (first, last) = wanted(scene, file, args, Some(output))?;
    let mut frames: Vec<i32> = (first..=last).collect();
    let mut sink = Sink::new(output, args.size, frames.len(), rate)?;
    if let Some((part, parts)) = args.shard {
        if !sink.is_numbered() {
            let message = "--shard needs numbered pictures, such as -o frames/####.png";
            return Err(Failure::Usage(message.to_owned()));
        }
        let mut row = 0;
        frames.retain(|_| {
            row += 1;
            (row - 1) % parts == part - 1
        });
    }
    let quiet = sink.takes_stdout();
    let mut report = Report::default();
    let before = frames.len();
    if !args.force {
        frames.retain(|frame| !sink.has(*frame, args.size));
    }
    report.skipped = before - frames.len();
    if !frames.is_empty() {
        let stage = Stage::new(scene, file, args, whole)?;
        let bar = Progress::new(&frames, args);
        for number in frames {
            let start = Instant::now();
            let update = scene.set_frame(number)?;
            let taken = start.elapsed().saturating_sub(update.top_level);
            let (picture, summary) = frame::render(scene, file, &stage, args, &bar)?;
            sink.write(number, &picture)?;
            bar.done();
            report.frames.push(FrameReport {
                frame: number,
                update_seconds: taken.as_secs_f64(),
                top_level_seconds: update.top_level.as_secs_f64(),
                nodes_moved: update.nodes,
                instances_placed: update.placed,
                instances_visible: update.visible,
                summary,
            });
        }
    }
    sink.finish()?;
    Ok((report, quiet))
}
