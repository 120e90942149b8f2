//! A sequence of frames: which ones are rendered, one after another, and the time that each took.

use super::frame::{FrameRenderer, Summary, Updates};
use super::progress::Progress;
use super::shutter::Shutter;
use super::warnings;
use crate::args::Args;
use crate::camera::SceneSetup;
use crate::failure::Failure;
use crate::messages::warn;
use crate::output::{Pattern, Sink};
use bth::Scene;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Time and work of a frame.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct FrameReport {
    /// Number of the frame.
    pub(crate) frame: i32,
    /// Times at which the scene is sampled: 1 without a shutter. What follows is the sum over all of them.
    pub(crate) times: usize,
    /// Time to evaluate tracks, hierarchy and instances, without the top level.
    pub(crate) update_seconds: f64,
    /// Time to build or refit the top level.
    pub(crate) top_level_seconds: f64,
    /// Nodes that moved.
    pub(crate) nodes_moved: usize,
    /// Instances whose transforms changed.
    pub(crate) instances_placed: usize,
    /// Instances that are visible, at the last of the times.
    pub(crate) instances_visible: usize,
    /// Time and rays of the rendering.
    #[serde(flatten)]
    pub(crate) summary: Summary,
}

impl FrameReport {
    fn new(frame: i32, times: usize, updates: &Updates, summary: Summary) -> Self {
        Self {
            frame,
            times,
            update_seconds: updates.time.as_secs_f64(),
            top_level_seconds: updates.top_level.as_secs_f64(),
            nodes_moved: updates.nodes,
            instances_placed: updates.placed,
            instances_visible: updates.visible,
            summary,
        }
    }
}

/// Time and work of all frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    pub(crate) frames: Vec<FrameReport>,
    /// Frames that were not rendered because their pictures existed already.
    pub(crate) skipped: usize,
}

/// The first and last frame of a file and its frames per second; frame 0 alone for files without a scene.
pub(crate) fn frame_range(scene: &Scene) -> ((i32, i32), f64) {
    scene.description().map_or(((0, 0), 24.0), |view| {
        let scene = &view.scene[0];
        ((scene.first_frame, scene.last_frame), scene.rate)
    })
}

/// The shutter of the options. In a file where nothing can move it makes no difference, so that one time is enough.
pub(crate) fn shutter(scene: &Scene, args: &Args) -> Shutter {
    Shutter::new(args.shutter.filter(|_| scene.description().is_some()), args.spp)
}

/// The first and last frame that the options choose; without an output those for a window.
///
/// # Errors
/// If the options name frames that the file does not have.
pub(crate) fn frames_to_show(
    scene: &Scene,
    file: &Path,
    args: &Args,
    output: Option<&Path>,
) -> Result<(i32, i32), Failure> {
    let ((first, last), _) = frame_range(scene);
    match args.frames {
        Some((a, b)) if a < first || b > last => Err(Failure::Usage(format!(
            "{} has {}; expected frames of it, found {}",
            file.display(),
            frames_named(first, last),
            frames_named(a, b)
        ))),
        Some(frames) => Ok(frames),
        None if output.is_some_and(is_one_picture) => Ok((first, first)),
        None => Ok((first, last)),
    }
}

/// A range of frames as text.
fn frames_named(first: i32, last: i32) -> String {
    if first == last { format!("frame {first} alone") } else { format!("frames {first} to {last}") }
}

fn is_one_picture(output: &Path) -> bool {
    output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) && Pattern::new(output).is_none()
}

/// Renders the frames that the options choose; `inputs` are the files that no picture may replace. The second value tells whether the pictures went to standard output, so that
/// the report must not.
///
/// # Errors
/// If the options do not fit the file or the output, the file lacks what the mode needs, or a picture cannot be written.
pub(crate) fn render_sequence(
    scene: &mut Scene,
    file: &Path,
    output: &Path,
    inputs: &[PathBuf],
    args: &Args,
) -> Result<(Report, bool), Failure> {
    let (whole, rate) = frame_range(scene);
    let (first, last) = frames_to_show(scene, file, args, Some(output))?;
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
    sink.prepare(&frames, inputs)?;
    let mut report = Report::default();
    let before = frames.len();
    if !args.force {
        frames.retain(|frame| !sink.has(*frame, args.size));
    }
    report.skipped = before - frames.len();
    // Made also where no frame is left, since it checks the options.
    let setup = SceneSetup::new(scene, file, args, whole)?;
    warnings::of(scene, args, &setup).iter().for_each(|text| warn(&format!("{}: {text}", file.display())));
    if !frames.is_empty() {
        let shutter = shutter(scene, args);
        let times = shutter.exposures().len();
        let progress = Progress::new(frames.len(), times, args);
        let (setup, shutter) = (&setup, &shutter);
        let renderer = FrameRenderer { file, setup, args, shutter, rate, progress: &progress };
        for number in frames {
            let (picture, summary, updates) = renderer.render(scene, number)?;
            sink.write(number, &picture)?;
            progress.frame_done();
            report.frames.push(FrameReport::new(number, times, &updates, summary));
        }
    }
    sink.finish()?;
    Ok((report, quiet))
}
