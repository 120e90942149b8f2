//! Progressive rendering for the window: coarse while camera or scene move, refined sample by sample while they do not.

use crate::args::Args;
use crate::camera::{Camera, SceneSetup};
use crate::failure::Failure;
use crate::output::{Picture, to_picture};
use crate::render::{Tile, pixel_count, render_tile, tile_count};
use crate::shading::{FrameContext, Shader};
use bth::Scene;
use glam::Vec3;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// Target time of a picture while something moves.
const MOVING: Duration = Duration::from_millis(40);
/// Time that is spent on rendering before the window handles its events.
const SLICE: Duration = Duration::from_millis(25);
/// Greatest side of the squares of pixels that share a sample.
const COARSEST: u32 = 8;

/// A picture that is refined over time.
pub(super) struct ProgressiveRenderer {
    /// The options of the program, but with the mode and size of the picture that is being rendered.
    args: Args,
    /// Width and height of the window, pixels.
    size: (u32, u32),
    /// Side of the squares of pixels that share a sample.
    block: u32,
    /// Sums of the samples of each pixel.
    sums: Vec<Vec3>,
    /// Samples that every pixel has got.
    passes: u32,
    /// Tiles of the next sample that are finished.
    tiles: u32,
    /// Time spent on the next sample so far.
    spent: Duration,
    /// Seconds per pixel of the last finished sample.
    cost: f64,
}

impl ProgressiveRenderer {
    /// A renderer without any samples.
    pub(super) fn new(args: &Args) -> Self {
        let mut renderer = Self {
            args: args.clone(),
            size: args.size,
            block: 1,
            sums: Vec::new(),
            passes: 0,
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

    /// Discards all samples, since camera, scene or mode changed. While something moves, pictures become coarse enough to be
    /// rendered in about [`MOVING`].
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
        self.sums = vec![Vec3::ZERO; pixel_count(self.args.size)];
        (self.passes, self.tiles, self.spent) = (0, 0, Duration::ZERO);
    }

    /// Whether every pixel of the fine picture has so many samples.
    pub(super) fn is_done(&self, samples: u32) -> bool {
        self.block == 1 && self.passes >= samples
    }

    /// Renders for about [`SLICE`]; returns the picture when all pixels have got another sample.
    ///
    /// # Errors
    /// If the file lacks what the mode needs.
    pub(super) fn render(
        &mut self,
        scene: &Scene,
        file: &Path,
        setup: &SceneSetup,
        camera: Camera,
        pool: &ThreadPool,
    ) -> Result<Option<Picture>, Failure> {
        if self.block > 1 && self.passes > 0 {
            // A coarse picture is finished, and nothing has moved since it was begun.
            self.block = 1;
            self.clear();
        }
        let start = Instant::now();
        let frame = FrameContext::new(scene, file, setup, camera, &self.args)?;
        let shader = Shader::new(&frame);
        let (count, width) = (tile_count(self.args.size), self.args.size.0);
        let step = 4 * pool.current_num_threads() as u32;
        while self.tiles < count && start.elapsed() < SLICE {
            let end = (self.tiles + step).min(count);
            let indices = self.passes..self.passes + 1;
            let render = |number: u32| render_tile(&frame, number, indices.clone(), &shader);
            let tiles: Vec<Tile> = pool.install(|| (self.tiles..end).into_par_iter().map(render).collect());
            for tile in &tiles {
                tile.write_to(&mut self.sums, width, |sum, color| *sum += color);
            }
            self.tiles = end;
        }
        self.spent += start.elapsed();
        if self.tiles < count {
            return Ok(None);
        }
        self.cost = self.spent.as_secs_f64() / self.sums.len().max(1) as f64;
        self.passes += 1;
        (self.tiles, self.spent) = (0, Duration::ZERO);
        let means: Vec<Vec3> = self.sums.iter().map(|sum| *sum / self.passes as f32).collect();
        Ok(Some(to_picture(&means, &self.args)))
    }
}
