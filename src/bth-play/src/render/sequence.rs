//! A sequence of frames: which ones are rendered, one after another, with progress on a terminal,
//! and the time that each took.

use super::brightness::light_factor;
use super::frame::{FrameRenderer, FrameReport, Progress};
use super::parts::Tiles;
use super::region::Region;
use super::shutter::Shutter;
use crate::args::{Args, Denoise, Mode};
use crate::camera::SceneSetup;
use crate::failure::Failure;
use crate::messages::warn;
use crate::output::{Pattern, Sink, has_library};
use bth::Scene;
use std::path::{Path, PathBuf};

/// Time and work of all frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    pub(crate) frames: Vec<FrameReport>,
    /// Frames that were not rendered because their pictures existed already.
    pub(crate) skipped: usize,
    /// Stops by which mode path brightens light.
    pub(crate) exposure: Option<f32>,
}

/// The first and last frame of a file and its frames per second; frame 0 alone for files without a
/// scene.
pub(crate) fn frame_range(scene: &Scene) -> ((i32, i32), f64) {
    scene.description().map_or(((0, 0), 24.0), |view| {
        let scene = &view.scene[0];
        ((scene.first_frame, scene.last_frame), scene.rate)
    })
}

/// The shutter of the options. In a file where nothing can move it makes no difference, so that one
/// time is enough.
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

/// Renders the frames that the options choose; `inputs` are the files that no picture may replace.
/// The second value is true if the pictures went to standard output, so that the report must not.
///
/// # Errors
/// If the options do not fit the file or the output, the file lacks what the mode needs, or a
/// picture cannot be written.
pub(crate) fn render_sequence(
    scene: &mut Scene,
    file: &Path,
    output: &Path,
    inputs: &[PathBuf],
    args: &Args,
) -> Result<(Report, bool), Failure> {
    let (whole, rate) = frame_range(scene);
    let (first, last) = frames_to_show(scene, file, args, Some(output))?;
    let frames: Vec<i32> = (first..=last).collect();
    let mut sink = Sink::new(output, args.size, frames.len(), rate)?;
    let tiles = Tiles::new(args, &sink, output)?;
    let quiet = sink.takes_stdout();
    sink.prepare(&frames, inputs)?;
    let mut jobs = jobs(&frames, args, &sink, tiles.as_ref())?;
    let mut report = Report::default();
    let before = jobs.len();
    if !args.force {
        jobs.retain(|job| match (*job, &tiles) {
            (Job::Tile(frame, tile), Some(tiles)) => {
                !sink.has(frame, args.size) && tiles.read(&sink, frame, tile).is_none()
            }
            (Job::Picture(frame) | Job::Tile(frame, _), _) => !sink.has(frame, args.size),
        });
    }
    report.skipped = before - jobs.len();
    // Made also where no frame is left, since it checks the options.
    let setup = SceneSetup::new(scene, file, args, whole)?;
    warnings(scene, args, &setup).iter().for_each(|text| warn(&format!("{}: {text}", file.display())));
    if !jobs.is_empty() {
        let factor = light_factor(scene, file, &setup, args, whole)?;
        report.exposure = (args.mode == Mode::Path).then(|| factor.log2());
        let shutter = shutter(scene, args);
        let times = shutter.exposures().len();
        let whole = Region::whole(args.size);
        let regions = jobs.iter().map(|job| match (job, &tiles) {
            (Job::Tile(_, tile), Some(tiles)) => tiles.region(*tile).clone(),
            _ => whole.clone(),
        });
        let progress = Progress::new(frames.len(), regions, times, args);
        let (setup, shutter) = (&setup, &shutter);
        let renderer = FrameRenderer { file, setup, args, shutter, rate, factor, progress: &progress };
        for job in jobs {
            match (job, &tiles) {
                (Job::Tile(frame, tile), Some(tiles)) => {
                    report.frames.push(tiles.render_file(&renderer, scene, &sink, (frame, tile))?);
                }
                (Job::Picture(frame), Some(tiles)) => {
                    let (picture, reports, there) = tiles.assemble(&renderer, scene, &sink, frame)?;
                    sink.write(frame, &picture)?;
                    tiles.remove(&sink, frame)?;
                    report.frames.extend(reports);
                    report.skipped += there;
                }
                (Job::Picture(frame) | Job::Tile(frame, _), _) => {
                    let (picture, done) = renderer.render(scene, frame, &whole)?;
                    sink.write(frame, &picture)?;
                    report.frames.push(done);
                }
            }
            progress.frame_done();
        }
    }
    sink.finish()?;
    Ok((report, quiet))
}

/// What is rendered.
#[derive(Clone, Copy)]
enum Job {
    /// The picture of a frame.
    Picture(i32),
    /// A tile of it.
    Tile(i32, u32),
}

/// The pictures, or with `--shard` this part of them or of their tiles.
///
/// # Errors
/// Wrong usage, if the output is not made of parts.
fn jobs(frames: &[i32], args: &Args, sink: &Sink, tiles: Option<&Tiles>) -> Result<Vec<Job>, Failure> {
    let pictures = || frames.iter().map(|frame| Job::Picture(*frame));
    let Some((part, parts)) = args.shard else { return Ok(pictures().collect()) };
    let all: Vec<Job> = match tiles {
        Some(tiles) => {
            frames.iter().flat_map(|frame| tiles.numbers().map(|tile| Job::Tile(*frame, tile))).collect()
        }
        None if sink.is_numbered() => pictures().collect(),
        None => {
            let message = "--shard needs numbered pictures, such as -o frames/####.png, or --tiles";
            return Err(Failure::Usage(message.to_owned()));
        }
    };
    Ok(all.into_iter().skip(part as usize - 1).step_by(parts as usize).collect())
}

/// Returns what a person who looks at the pictures might wonder about.
fn warnings(scene: &Scene, args: &Args, setup: &SceneSetup) -> Vec<String> {
    let mode = args.mode.name();
    let mut warnings = Vec::new();
    if setup.bounds.is_empty() {
        warnings.push(match scene.description() {
            Some(_) => "no frame shows a triangle, so the pictures are empty".to_owned(),
            None => "the model has no triangles, so the picture is empty".to_owned(),
        });
    }
    // Rays have origins of f32.
    if !setup.camera(scene, args).eye.as_vec3().is_finite() {
        warnings.push(format!(
            "the camera is farther from the origin than f32 numbers reach ({:e}), so it sees nothing",
            f32::MAX
        ));
    }
    if args.bounces.is_some() && args.mode != Mode::Path {
        warnings.push(format!("--bounces changes nothing: it is for --mode path, found --mode {mode}"));
    }
    if args.exposure.is_some() && args.mode != Mode::Path {
        warnings.push(format!("--exposure changes nothing: it is for --mode path, found --mode {mode}"));
    }
    if setup.is_within_solid {
        warnings.push(
            "the camera is inside something solid and sees the backs of surfaces; move it, or use --inside \
             for rooms"
                .to_owned(),
        );
    }
    if args.up.is_none() && setup.bounds.seems_to_lie {
        warnings.push("the model seems to lie on its side; --up z shows it upright".to_owned());
    }
    if args.denoise != Denoise::Auto && args.mode != Mode::Path {
        warnings.push(format!("--denoise changes nothing: it is for --mode path, found --mode {mode}"));
    }
    if args.denoise == Denoise::Oidn && !has_library() {
        let what = "--denoise oidn: Open Image Denoise is not installed (libOpenImageDenoise.so.2), so the";
        warnings.push(format!("{what} built-in filter is used"));
    }
    if args.scale.is_some() && args.mode != Mode::Steps {
        warnings.push(format!("--scale changes nothing: it is for --mode steps, found --mode {mode}"));
    }
    if args.fov.is_some() && setup.is_orthographic(scene) {
        warnings.push("--fov changes nothing: the scene's camera is orthographic".to_owned());
    }
    warnings
}
