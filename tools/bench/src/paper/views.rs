//! The cameras of the paper's measurement: one sees the whole model, one stands close to it.

use crate::model::Model;
use crate::rays::{self, Finder, View};
use crate::structures;
use anyhow::Result;
use bth::rays::{Hit, Ray};

/// Pixels of the side of a tile, which a thread renders at a time.
pub(super) const THREAD_TILE: u32 = 16;

/// The rays of both cameras, and what they hit.
pub(super) struct Views {
    /// Where the first camera stands.
    pub(super) view: View,
    /// Camera rays of the far and the close view, in tiles.
    pub(super) rays: [Vec<Ray>; 2],
    /// Whether each ray hits, by our exact BVH.
    pub(super) expected: [Vec<bool>; 2],
}

impl Views {
    /// Of a model, in pictures of this size.
    ///
    /// # Errors
    /// If the model cannot be compiled.
    pub(super) fn of(model: &Model, size: (u32, u32)) -> Result<Views> {
        let plain = structures::compile(model, &structures::BVH)?;
        let scene = bth::from_bytes(&plain.bytes)?;
        let options = rays::Options { size, most: usize::MAX, view: None };
        let (view, rays) = rays::cameras(&Finder::new(model, &scene), &options);
        let rays = rays.map(|rays| tiled(&rays, size));
        let expected = [0, 1].map(|i| {
            let mut hits = vec![Hit::MISS; rays[i].len()];
            scene.batch(&rays[i]).nearest(&mut hits);
            hits.iter().map(Hit::is_hit).collect()
        });
        Ok(Views { view, rays, expected })
    }

    /// The eyes of the cameras, where all rays of a picture start.
    pub(super) fn eyes(&self) -> impl Iterator<Item = [f32; 3]> {
        self.rays.iter().filter_map(|rays| rays.first()).map(|ray| ray.origin)
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
