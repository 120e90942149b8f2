//! The cameras of the paper's measurement, one sees the whole model, one is close to it; and
//! rendering with all structures in turn, on all threads.

use crate::clock::process_cpu;
use crate::model::Model;
use crate::rays::{self, Finder};
use crate::rounds::least;
use crate::structures;
use crate::tracer::{Batch, Tracer, spread};
use anyhow::Result;
use bth::rays::{Hit, Ray};

/// Pixels of the side of a tile, which a thread renders at a time.
const THREAD_TILE: u32 = 16;

/// The rays of both cameras, and what they hit.
pub(super) struct Views {
    /// Camera rays of the far and the close view, in tiles.
    rays: [Vec<Ray>; 2],
    /// True for each ray that hits, by our exact BVH.
    expected: [Vec<bool>; 2],
}

impl Views {
    /// Of a model, in pictures of this size.
    pub(super) fn of(model: &Model, size: (u32, u32)) -> Result<Views> {
        let plain = structures::compile(model, &structures::BVH)?;
        let scene = bth::from_bytes(&plain.bytes)?;
        let options = rays::Options { size, most: usize::MAX, view: None };
        let (_, rays) = rays::cameras(&Finder::new(model, &scene), &options);
        let rays = rays.map(|rays| tiled(&rays, size));
        let expected = [0, 1].map(|i| {
            let mut hits = vec![Hit::MISS; rays[i].len()];
            scene.batch(&rays[i]).nearest(&mut hits);
            hits.iter().map(Hit::is_hit).collect()
        });
        Ok(Views { rays, expected })
    }

    /// The eyes of the cameras, where all rays of a picture start.
    pub(super) fn eyes(&self) -> impl Iterator<Item = [f32; 3]> {
        self.rays.iter().filter_map(|rays| rays.first()).map(|ray| ray.origin)
    }

    /// The fastest seconds of each structure for a view, and the number of pixels that hit where
    /// they should miss or the other way round.
    pub(super) fn render(
        &self,
        tracers: &[&dyn Tracer],
        view: usize,
        rounds: usize,
        threads: usize,
    ) -> Vec<(f64, usize)> {
        let rays = &self.rays[view];
        let rows: Vec<usize> = (0..tracers.len()).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        let mut differ = vec![0; tracers.len()];
        let seconds = least(&rows, rounds, |round, &row| {
            let batch = Batch { rays, starts: None, coherent: true };
            let trace = |b: Batch<'_>, h: &mut [Hit]| tracers[row].nearest(b, h);
            // CPU time, as other jobs may take turns on the same cores.
            let before = process_cpu();
            spread(batch, &mut hits, (threads, 1), (THREAD_TILE * THREAD_TILE) as usize, trace);
            let seconds = (process_cpu() - before) / threads as f64;
            if round == 0 {
                let expected = hits.iter().zip(&self.expected[view]);
                differ[row] = expected.filter(|(hit, expected)| hit.is_hit() != **expected).count();
            }
            Some(seconds)
        });
        seconds.into_iter().map(|s| s.unwrap_or(f64::NAN)).zip(differ).collect()
    }
}

/// Rays in tiles of 4×4 pixels into tiles of [`THREAD_TILE`].
fn tiled(rays: &[Ray], (width, height): (u32, u32)) -> Vec<Ray> {
    let mut ordered = Vec::with_capacity(rays.len());
    for tile_y in (0..height).step_by(THREAD_TILE as usize) {
        for tile_x in (0..width).step_by(THREAD_TILE as usize) {
            for y in tile_y..height.min(tile_y + THREAD_TILE) {
                for x in tile_x..width.min(tile_x + THREAD_TILE) {
                    let at = (y / 4 * (width / 4) + x / 4) * 16 + y % 4 * 4 + x % 4;
                    ordered.push(rays[at as usize]);
                }
            }
        }
    }
    ordered
}
