//! One frame, or a part of it: its exposures one after the other, the squares of each in parallel.
//! The pixels of a square are rendered together, so that their rays are traced in coherent batches.

use super::region::{Region, TILE};
use super::shutter::{Exposure, Shutter};
use crate::args::{Args, Mode};
use crate::camera::SceneSetup;
use crate::failure::Failure;
use crate::output::{Picture, margin, to_picture};
use crate::shading::{Counters, FrameContext, Sample, Shaded, Shader};
use bth::Scene;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Time and work of a frame: the sums over the times at which the scene is sampled.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct FrameReport {
    /// Number of the frame.
    pub(crate) frame: i32,
    /// Number of the tile, from 1; `None` for the whole picture.
    pub(crate) tile: Option<u32>,
    /// Times at which the scene is sampled: 1 without a shutter.
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
    /// Wall clock of the rendering, without opening the file, setting the time and writing the
    /// picture.
    pub(crate) seconds: f64,
    /// Rays of the camera and of bounces.
    pub(crate) nearest_rays: u64,
    /// Shadow and occlusion rays.
    pub(crate) any_rays: u64,
    /// Mean steps of a camera ray, in mode steps.
    pub(crate) steps: Option<Steps>,
}

/// Traversal steps of camera rays.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Steps {
    pub(crate) nodes: f64,
    pub(crate) leaves: f64,
    pub(crate) triangles: f64,
    pub(crate) tets: f64,
}

/// What all frames of a sequence are rendered with.
pub(super) struct FrameRenderer<'a> {
    pub(super) file: &'a Path,
    pub(super) setup: &'a SceneSetup,
    pub(super) args: &'a Args,
    pub(super) shutter: &'a Shutter,
    /// Frames per second.
    pub(super) rate: f64,
    /// Factor of light in mode path.
    pub(super) factor: f32,
    pub(super) progress: &'a Progress,
}

impl FrameRenderer<'_> {
    /// Renders a part of a frame with all its samples; the scene is left at the last of its times.
    ///
    /// # Errors
    /// If a time cannot be set, or the file lacks what the mode needs.
    pub(super) fn render(
        &self,
        scene: &mut Scene,
        number: i32,
        part: &Region,
    ) -> Result<(Picture, FrameReport), Failure> {
        let rendered = part.with_margin(margin(self.args), self.args.size);
        let pixels = pixel_count(rendered.size());
        let (mut sums, mut total) = (vec![Shaded::default(); pixels], Counters::default());
        let mut report = FrameReport { frame: number, ..FrameReport::default() };
        for exposure in self.shutter.exposures() {
            let start = Instant::now();
            let update = scene.set_seconds((f64::from(number) + exposure.offset) / self.rate)?;
            report.times += 1;
            report.update_seconds += start.elapsed().saturating_sub(update.top_level).as_secs_f64();
            report.top_level_seconds += update.top_level.as_secs_f64();
            report.nodes_moved += update.nodes;
            report.instances_placed += update.placed;
            report.instances_visible = update.visible;
            let camera = self.setup.camera(scene, self.args);
            let frame = FrameContext::new(scene, self.file, self.setup, camera, self.args)?;
            let start = Instant::now();
            self.add_squares(&frame, &exposure, &rendered, (&mut sums, &mut total));
            report.seconds += start.elapsed().as_secs_f64();
        }
        let camera_rays = pixels as u64 * u64::from(self.args.spp);
        report.nearest_rays = camera_rays + total.nearest_rays;
        report.any_rays = total.any_rays;
        let [nodes, leaves, triangles, tets] = (total.steps / camera_rays as f64).to_array();
        report.steps = (self.args.mode == Mode::Steps).then_some(Steps { nodes, leaves, triangles, tets });
        let means: Vec<Shaded> = sums.into_iter().map(|sum| sum / self.args.spp as f32).collect();
        let picture = to_picture(means, rendered.size(), self.args, self.factor);
        let corner = (part.x.start - rendered.x.start, part.y.start - rendered.y.start);
        Ok((picture.part(corner, part.size()), report))
    }

    /// Renders the squares of a region at the time to which the scene is set, and adds them to its
    /// pixels. Threads take one square after the other, so that all work in the same part of the
    /// picture and read the same part of the scene.
    fn add_squares(
        &self,
        frame: &FrameContext<'_>,
        exposure: &Exposure,
        region: &Region,
        to: (&mut [Shaded], &mut Counters),
    ) {
        let (shader, to) = (Shader::new(frame), Mutex::new(to));
        region.squares(self.args.size.0).into_iter().par_bridge().for_each(|number| {
            let tile = render_tile(frame, number, exposure, &shader);
            self.progress.tile_done();
            // Squares have no pixels in common, and counts are whole numbers: their order is free.
            let (pixels, total) = &mut *to.lock().unwrap_or_else(PoisonError::into_inner);
            tile.add_to(pixels, region);
            **total += tile.counters;
        });
    }
}

/// A rendered part of the picture.
#[derive(Default)]
pub(crate) struct Tile {
    pixels: Vec<(u32, u32)>,
    /// Sums of the samples of each pixel.
    sums: Vec<Shaded>,
    pub(super) counters: Counters,
}

/// Renders the samples of the tile of a number that are taken at the time of an exposure, to which
/// the scene is set. If pixels get no more than one sample (`--spp 1`), its rays go through their
/// middles.
pub(crate) fn render_tile(
    frame: &FrameContext<'_>,
    number: u32,
    exposure: &Exposure,
    shader: &Shader<'_>,
) -> Tile {
    let columns = frame.args.size.0.div_ceil(TILE);
    let mut pixels = pixels(frame.args.size, number % columns * TILE, number / columns * TILE);
    pixels.retain(|pixel| exposure.takes(*pixel));
    let mut tile = Tile { sums: vec![Shaded::default(); pixels.len()], pixels, ..Tile::default() };
    let centered = frame.args.spp == 1;
    for index in exposure.samples.clone() {
        let samples: Vec<Sample> =
            tile.pixels.iter().map(|&pixel| frame.sample(pixel, index, centered)).collect();
        let shaded = shader.shade(frame, &samples, &mut tile.counters);
        tile.sums.iter_mut().zip(shaded).for_each(|(sum, shaded)| *sum += shaded);
    }
    tile
}

/// Pixels of a tile in Morton order, so that successive camera rays are close to each other.
fn pixels((width, height): (u32, u32), left: u32, top: u32) -> Vec<(u32, u32)> {
    let even_bits = |n: u32| (0..4).fold(0, |sum, bit| sum | (n >> (2 * bit) & 1) << bit);
    (0..TILE * TILE)
        .map(|i| (left + even_bits(i), top + even_bits(i >> 1)))
        .filter(|&(x, y)| x < width && y < height)
        .collect()
}

impl Tile {
    /// Adds its samples to the pixels of a region, in rows from the top.
    pub(crate) fn add_to(&self, pixels: &mut [Shaded], region: &Region) {
        for (&pixel, &sum) in self.pixels.iter().zip(&self.sums) {
            if let Some(at) = region.index(pixel) {
                pixels[at] += sum;
            }
        }
    }
}

/// Tiles of a picture.
pub(crate) fn tile_count((width, height): (u32, u32)) -> u32 {
    width.div_ceil(TILE) * height.div_ceil(TILE)
}

/// Pixels of a picture.
pub(crate) fn pixel_count((width, height): (u32, u32)) -> usize {
    width as usize * height as usize
}

/// A bar that counts tiles, shown only where standard error is a terminal.
pub(super) struct Progress(ProgressBar);

impl Progress {
    /// A bar for the tiles of pictures of a number of frames, or of their parts, each sampled at a
    /// number of times.
    pub(super) fn new(frames: usize, parts: impl Iterator<Item = Region>, times: usize, args: &Args) -> Self {
        let squares =
            |part: Region| part.with_margin(margin(args), args.size).squares(args.size.0).len() as u64;
        let tiles = parts.map(squares).sum::<u64>() * times as u64;
        let visible = std::io::stderr().is_terminal();
        let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(tiles), target);
        let style = ProgressStyle::with_template(
            "rendering {bar:30} {human_pos}/{human_len} tiles  {msg}  {eta} left",
        );
        let bar = if let Ok(style) = style { bar.with_style(style) } else { bar };
        if frames > 1 {
            bar.set_message(format!("{frames} frames"));
        }
        Self(bar)
    }

    /// Counts a finished tile.
    pub(super) fn tile_done(&self) {
        self.0.inc(1);
    }

    /// Redraws the bar after a frame.
    pub(super) fn frame_done(&self) {
        self.0.tick();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
