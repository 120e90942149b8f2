//! Tiles: squares of pixels that are rendered together, so that their rays are traced in coherent batches.

use super::shutter::Exposure;
use crate::shading::{Counters, FrameContext, Sample, Shader};
use glam::Vec3;

/// Pixels along the side of a tile.
const TILE: u32 = 16;

/// A rendered part of the picture.
#[derive(Default)]
pub(crate) struct Tile {
    pixels: Vec<(u32, u32)>,
    /// Sums of the samples of each pixel.
    sums: Vec<Vec3>,
    pub(super) counters: Counters,
}

/// Renders the samples of the tile of a number that are taken at the time of an exposure, to which the scene is set. If pixels get
/// no more than one sample (`--spp 1`), its rays go through their middles.
pub(crate) fn render_tile(
    frame: &FrameContext<'_>,
    number: u32,
    exposure: &Exposure,
    shader: &Shader<'_>,
) -> Tile {
    let columns = frame.args.size.0.div_ceil(TILE);
    let mut pixels = pixels(frame.args.size, number % columns * TILE, number / columns * TILE);
    pixels.retain(|pixel| exposure.takes(*pixel));
    let mut tile = Tile { sums: vec![Vec3::ZERO; pixels.len()], pixels, ..Tile::default() };
    let centered = frame.args.spp == 1;
    for index in exposure.samples.clone() {
        let samples: Vec<Sample> =
            tile.pixels.iter().map(|&pixel| frame.sample(pixel, index, centered)).collect();
        let colors = shader.shade(frame, &samples, &mut tile.counters);
        tile.sums.iter_mut().zip(colors).for_each(|(sum, color)| *sum += color);
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
    /// Calls `update` with each pixel of a picture, in rows of `width` from the top, and the sum of its samples in the tile.
    pub(crate) fn write_to(&self, picture: &mut [Vec3], width: u32, update: impl Fn(&mut Vec3, Vec3)) {
        for (&(x, y), &sum) in self.pixels.iter().zip(&self.sums) {
            update(&mut picture[y as usize * width as usize + x as usize], sum);
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
