//! One frame: its exposures one after the other, the tiles of each in parallel.

use super::progress::Progress;
use super::shutter::{Exposure, Shutter};
use super::tile::{Tile, pixel_count, render_tile, tile_count};
use crate::args::{Args, Mode};
use crate::camera::SceneSetup;
use crate::failure::Failure;
use crate::output::{Picture, to_picture};
use crate::shading::{Counters, FrameContext, Shader, Steps};
use bth::Scene;
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time and rays of a frame.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Summary {
    /// Wall clock of the rendering, without opening the file, setting the time and writing the picture.
    pub(crate) seconds: f64,
    /// Camera rays and those of bounces.
    pub(crate) nearest_rays: u64,
    /// Shadow and occlusion rays.
    pub(crate) any_rays: u64,
    /// Mean steps of a camera ray, in mode steps.
    pub(crate) steps: Option<Steps>,
}

/// Work of setting the scene to the times of a frame: one without a shutter.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Updates {
    /// Without the top level.
    pub(crate) time: Duration,
    pub(crate) top_level: Duration,
    pub(crate) nodes: usize,
    pub(crate) placed: usize,
    /// At the last of the times.
    pub(crate) visible: usize,
}

/// What all frames of a sequence are rendered with.
pub(super) struct FrameRenderer<'a> {
    pub(super) file: &'a Path,
    pub(super) setup: &'a SceneSetup,
    pub(super) args: &'a Args,
    pub(super) shutter: &'a Shutter,
    /// Frames per second.
    pub(super) rate: f64,
    pub(super) progress: &'a Progress,
}

impl FrameRenderer<'_> {
    /// Renders a frame with all its samples; the scene is left at the last of its times.
    ///
    /// # Errors
    /// If a time cannot be set, or the file lacks what the mode needs.
    pub(super) fn render(
        &self,
        scene: &mut Scene,
        number: i32,
    ) -> Result<(Picture, Summary, Updates), Failure> {
        let mut sums = vec![Vec3::ZERO; pixel_count(self.args.size)];
        let (mut total, mut updates, mut seconds) = (Counters::default(), Updates::default(), 0.0);
        for exposure in self.shutter.exposures() {
            let start = Instant::now();
            let update = scene.set_seconds((f64::from(number) + exposure.offset) / self.rate)?;
            updates.time += start.elapsed().saturating_sub(update.top_level);
            updates.top_level += update.top_level;
            updates.nodes += update.nodes;
            updates.placed += update.placed;
            updates.visible = update.visible;
            let camera = self.setup.camera(scene, self.args);
            let frame = FrameContext::new(scene, self.file, self.setup, camera, self.args)?;
            let start = Instant::now();
            for tile in self.tiles(&frame, &exposure) {
                tile.write_to(&mut sums, self.args.size.0, |sum, color| *sum += color);
                total += tile.counters;
            }
            seconds += start.elapsed().as_secs_f64();
        }
        let means: Vec<Vec3> = sums.into_iter().map(|sum| sum / self.args.spp as f32).collect();
        Ok((to_picture(&means, self.args), summary(self.args, &total, seconds), updates))
    }

    /// All tiles at the time to which the scene is set.
    fn tiles(&self, frame: &FrameContext<'_>, exposure: &Exposure) -> Vec<Tile> {
        let shader = Shader::new(frame);
        let render = |number: u32| {
            let tile = render_tile(frame, number, exposure, &shader);
            self.progress.tile_done();
            tile
        };
        (0..tile_count(self.args.size)).into_par_iter().map(render).collect()
    }
}

fn summary(args: &Args, total: &Counters, seconds: f64) -> Summary {
    let camera_rays = pixel_count(args.size) as u64 * u64::from(args.spp);
    let mean = |sum: f64| sum / camera_rays as f64;
    let steps = (args.mode == Mode::Steps).then(|| Steps {
        nodes: mean(total.steps.nodes),
        leaves: mean(total.steps.leaves),
        triangles: mean(total.steps.triangles),
        tets: mean(total.steps.tets),
    });
    let nearest_rays = camera_rays + total.nearest_rays;
    Summary { seconds, nearest_rays, any_rays: total.any_rays, steps }
}
