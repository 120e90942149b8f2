//! Progressive rendering for the window: coarse while camera or scene move, refined sample by
//! sample while they do not.

use super::camera::{Content, ViewCamera};
use crate::args::{Args, Denoise};
use crate::failure::Failure;
use crate::output::{Picture, to_picture};
use crate::render::{Exposure, Region, Shutter, Tile, pixel_count, render_tile, tile_count};
use crate::shading::{FrameContext, Shaded, Shader};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Target time of a picture while something moves.
const MOVING: Duration = Duration::from_millis(40);
/// Time that is spent on rendering before the window handles its events.
const SLICE: Duration = Duration::from_millis(25);
/// Largest side of the squares of pixels that share a sample.
const COARSEST: u32 = 8;

/// A picture that is refined over time.
pub(super) struct ProgressiveRenderer {
    /// The options of the program, but with the mode and size of the picture that is being
    /// rendered.
    args: Args,
    /// Width and height of the window, pixels.
    size: (u32, u32),
    /// Side of the squares of pixels that share a sample.
    block: u32,
    /// Sums of the samples of each pixel.
    sums: Vec<Shaded>,
    /// Samples that every pixel has got.
    passes: u32,
    shutter: Shutter,
    /// Times of the next sample that are finished.
    slots: u32,
    /// Tiles of the next time that are finished.
    tiles: u32,
    /// Time spent on the next sample so far.
    spent: Duration,
    /// Seconds per pixel of the last finished sample.
    cost: f64,
}

impl ProgressiveRenderer {
    /// A renderer without any samples.
    pub(super) fn new(args: &Args, shutter: Shutter) -> Self {
        let mut renderer = Self {
            args: args.clone(),
            size: args.size,
            block: 1,
            sums: Vec::new(),
            passes: 0,
            shutter,
            slots: 0,
            tiles: 0,
            spent: Duration::ZERO,
            cost: 0.0,
        };
        renderer.restart(false);
        renderer
    }

    /// The options, with the current mode and the size of the window.
    pub(super) fn args(&self) -> Args {
        let mut args = self.args.clone();
        args.size = self.size;
        args
    }

    /// Width and height of the window, pixels.
    pub(super) fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Samples that every pixel has got; 0 while the picture is coarse.
    pub(super) fn samples(&self) -> u32 {
        if self.block == 1 { self.passes } else { 0 }
    }

    /// Switches to another mode.
    pub(super) fn set_mode(&mut self, mode: crate::args::Mode) {
        self.args.mode = mode;
        self.restart(false);
    }

    /// Adapts to the size of the window.
    pub(super) fn resize(&mut self, size: (u32, u32)) {
        if size != self.size {
            self.size = size;
            self.restart(false);
        }
    }

    /// Discards all samples, since camera, scene or mode changed. While something moves, pictures
    /// become coarse enough to be rendered in about [`MOVING`].
    pub(super) fn restart(&mut self, moving: bool) {
        self.block = 1;
        let pixels = pixel_count(self.size) as f64;
        while moving
            && self.block < COARSEST
            && self.cost * pixels > MOVING.as_secs_f64() * f64::from(self.block).powi(2)
        {
            self.block *= 2;
        }
        self.clear();
    }

    fn clear(&mut self) {
        self.args.size = (self.size.0.div_ceil(self.block), self.size.1.div_ceil(self.block));
        self.sums = vec![Shaded::default(); pixel_count(self.args.size)];
        (self.passes, self.slots, self.tiles, self.spent) = (0, 0, 0, Duration::ZERO);
    }

    /// Returns true if every pixel of the fine picture has at least `samples` samples.
    pub(super) fn is_done(&self, samples: u32) -> bool {
        self.block == 1 && self.passes >= samples
    }

    /// Renders for about [`SLICE`]; returns the picture when all pixels have got another sample.
    /// The scene is set to a frame, and is so again afterwards.
    ///
    /// # Errors
    /// If the file lacks what the mode needs, or a time within the shutter cannot be set.
    pub(super) fn render(
        &mut self,
        content: &mut Content<'_>,
        frame: i32,
        view: ViewCamera,
        pool: &ThreadPool,
    ) -> Result<Option<Picture>, Failure> {
        if self.block > 1 && self.passes > 0 {
            // A coarse picture is finished, and nothing has moved since it was begun.
            self.block = 1;
            self.clear();
        }
        let start = Instant::now();
        let mut rendered = Ok(());
        while rendered.is_ok() && self.slots < self.shutter.slots() && start.elapsed() < SLICE {
            let exposure = self.shutter.exposure(self.passes, self.slots);
            if self.shutter.is_open() {
                let time = (f64::from(frame) + exposure.offset) / content.rate;
                rendered = content.scene.set_seconds(time).map(drop).map_err(Failure::from);
            }
            rendered = rendered.and_then(|()| self.render_exposure(content, &exposure, view, pool, start));
        }
        if self.shutter.is_open() {
            content.scene.set_frame(frame)?;
        }
        rendered?;
        self.spent += start.elapsed();
        if self.slots < self.shutter.slots() {
            return Ok(None);
        }
        self.cost = self.spent.as_secs_f64() / self.sums.len().max(1) as f64;
        self.passes += 1;
        (self.slots, self.spent) = (0, Duration::ZERO);
        let means: Vec<Shaded> = self.sums.iter().map(|sum| *sum / self.passes as f32).collect();
        let mut args = self.args.clone();
        // Only a finished picture is worth the time.
        if !self.is_done(args.spp) {
            args.denoise = Denoise::Off;
        }
        Ok(Some(to_picture(means, args.size, &args, content.factor)))
    }

    /// Renders tiles at the time to which the scene is set, until all are finished or [`SLICE`] has
    /// passed since `start`.
    fn render_exposure(
        &mut self,
        content: &Content<'_>,
        exposure: &Exposure,
        view: ViewCamera,
        pool: &ThreadPool,
        start: Instant,
    ) -> Result<(), Failure> {
        let camera = view.camera(content, &self.args());
        let frame = FrameContext::new(content.scene, content.file, &content.setup, camera, &self.args)?;
        let shader = Shader::new(&frame);
        let (count, whole) = (tile_count(self.args.size), Region::whole(self.args.size));
        let step = 4 * pool.current_num_threads() as u32;
        // At least some tiles, so that setting the time is never all that is done.
        loop {
            let end = (self.tiles + step).min(count);
            let render = |number: u32| render_tile(&frame, number, exposure, &shader);
            let tiles: Vec<Tile> = pool.install(|| (self.tiles..end).into_par_iter().map(render).collect());
            for tile in &tiles {
                tile.add_to(&mut self.sums, &whole);
            }
            self.tiles = end;
            if self.tiles == count {
                (self.slots, self.tiles) = (self.slots + 1, 0);
                return Ok(());
            }
            if start.elapsed() >= SLICE {
                return Ok(());
            }
        }
    }
}
