//! One frame, its tiles in parallel.

use super::progress::Progress;
use super::tile::{Tile, pixel_count, render_tile, tile_count};
use crate::args::{Args, Mode};
use crate::output::{Picture, to_picture};
use crate::shading::{Counters, FrameContext, Shader, Steps};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// Time and rays of a frame.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Summary {
    /// Wall clock of the rendering, without opening the file and writing the picture.
    pub(crate) seconds: f64,
    /// Camera rays and those of bounces.
    pub(crate) nearest_rays: u64,
    /// Shadow and occlusion rays.
    pub(crate) any_rays: u64,
    /// Mean steps of a camera ray, in mode steps.
    pub(crate) steps: Option<Steps>,
}

/// Renders a frame with all its samples.
pub(super) fn render_frame(frame: &FrameContext<'_>, progress: &Progress) -> (Picture, Summary) {
    let args = frame.args;
    let start = Instant::now();
    let shader = Shader::new(frame);
    let tiles: Vec<Tile> = (0..tile_count(args.size))
        .into_par_iter()
        .map(|number| {
            let tile = render_tile(frame, number, 0..args.spp, &shader);
            progress.tile_done();
            tile
        })
        .collect();
    let seconds = start.elapsed().as_secs_f64();
    let mut colors = vec![Vec3::ZERO; pixel_count(args.size)];
    let mut total = Counters::default();
    for tile in &tiles {
        tile.write_to(&mut colors, args.size.0, |color, sum| *color = sum / args.spp as f32);
        total += tile.counters;
    }
    (to_picture(&colors, args), summary(args, &total, seconds))
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
