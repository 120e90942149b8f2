//! The picture in the window: coarse while things move, refined sample by sample while they do not.

use crate::args::Args;
use crate::camera::Camera;
use crate::develop::develop;
use crate::failure::Failure;
use crate::frame::{Frame, Tile, pixel_count, tile_count};
use crate::picture::Picture;
use crate::stage::Stage;
use bth::Scene;
use glam::Vec3;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// A picture while things move takes about so long.
const MOVING: Duration = Duration::from_millis(40);
/// Work that is done before the window looks at its events again.
const SLICE: Duration = Duration::from_millis(25);
/// Coarsest picture: the side of the squares of pixels that get one sample.
const COARSEST: u32 = 8;

/// What is seen, and how.
pub(crate) struct Canvas {
    /// Of the program, but for the mode and the size, which are those of the picture at work.
    args: Args,
    /// Pixels of the window.
    size: (u32, u32),
    /// Side of the squares of pixels that share a sample.
    block: u32,
    /// Sums of the samples of each pixel.
    sums: Vec<Vec3>,
    /// Samples that all pixels have.
    passes: u32,
    /// Tiles of the next sample that are done.
    tiles: u32,
    /// Time that this sample took so far.
    spent: Duration,
    /// Seconds that a sample of a pixel took last.
    cost: f64,
}

impl Canvas {
    /// An empty canvas.
    pub(crate) fn new(args: &Args) -> Self {
        let mut canvas = Self {
            args: args.clone(),
            size: args.size,
            block: 1,
            sums: Vec::new(),
            passes: 0,
            tiles: 0,
            spent: Duration::ZERO,
            cost: 0.0,
        };
        canvas.restart(false);
        canvas
    }

    /// Options, with the size of the window.
    pub(crate) fn args(&self) -> Args {
        let mut args = self.args.clone();
        args.size = self.size;
        args
    }

    /// Pixels of the window.
    pub(crate) fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Samples that all pixels have; 0 while the picture is coarse.
    pub(crate) fn samples(&self) -> u32 {
        if self.block == 1 { self.passes } else { 0 }
    }

    /// Shows another mode.
    pub(crate) fn set_mode(&mut self, mode: crate::args::Mode) {
        self.args.mode = mode;
        self.restart(false);
    }

    /// The window has another size.
    pub(crate) fn resize(&mut self, size: (u32, u32)) {
        if size != self.size {
            self.size = size;
            self.restart(false);
        }
    }

    /// What was drawn is no longer what there is to see. While things move, pictures are so coarse that they come fast.
    pub(crate) fn restart(&mut self, moving: bool) {
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

    /// Whether all is drawn, with so many samples.
    pub(crate) fn is_done(&self, samples: u32) -> bool {
        self.block == 1 && self.passes >= samples
    }

    /// Goes on drawing for a moment; returns the picture when all pixels have got another sample.
    ///
    /// # Errors
    /// If the file lacks what the mode needs.
    pub(crate) fn draw(
        &mut self,
        scene: &Scene,
        file: &Path,
        stage: &Stage,
        camera: Camera,
        pool: &ThreadPool,
    ) -> Result<Option<Picture>, Failure> {
        if self.block > 1 && self.passes > 0 {
            // It was coarse, and nothing has moved since.
            self.block = 1;
            self.clear();
        }
        let start = Instant::now();
        let frame = Frame::new(scene, file, stage, camera, &self.args)?;
        let shader = frame.shader();
        let (count, width) = (tile_count(self.args.size), self.args.size.0);
        let step = 4 * pool.current_num_threads() as u32;
        while self.tiles < count && start.elapsed() < SLICE {
            let end = (self.tiles + step).min(count);
            let draw = |number: u32| frame.tile(number, self.passes..self.passes + 1, &shader);
            let tiles: Vec<Tile> = pool.install(|| (self.tiles..end).into_par_iter().map(draw).collect());
            for tile in &tiles {
                tile.place(&mut self.sums, width, |sum, color| *sum += color);
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
        Ok(Some(develop(&means, &self.args)))
    }
}
