//! One frame: tiles in parallel, batches of rays per tile.

use crate::args::{Args, Mode};
use crate::camera::{self, Camera};
use crate::clay::Studio;
use crate::failure::Failure;
use crate::occlusion::{Queue, Start};
use crate::picture::{Picture, quantized, srgb};
use crate::sampling::{Sampler, cosine_hemisphere};
use crate::surface::Shape;
use crate::{inside, legend, ramp};
use bth::Scene;
use bth::rays::{Hit, Ray, Surface};
use glam::{DVec2, DVec3, Vec3};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use std::io::IsTerminal;
use std::path::Path;
use std::time::Instant;

/// Pixels along the side of a tile.
const TILE: u32 = 16;
/// Ambient-occlusion rays per sample.
const AO_RAYS: u32 = 4;
/// Dark enough that open surfaces, which are white, stand out.
const AO_BACKGROUND: Vec3 = Vec3::splat(0.14);

/// What a frame took.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Summary {
    /// Wall clock of the rendering, without opening the file and writing the picture.
    pub(crate) seconds: f64,
    /// Camera rays.
    pub(crate) nearest_rays: u64,
    /// Shadow and occlusion rays.
    pub(crate) any_rays: u64,
    /// Mean steps of a camera ray, in mode steps.
    pub(crate) steps: Option<Steps>,
}

/// Traversal steps of a camera ray.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Steps {
    pub(crate) nodes: f64,
    pub(crate) leaves: f64,
    pub(crate) triangles: f64,
    pub(crate) tets: f64,
}

/// One sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) sampler: Sampler,
    pub(crate) index: u32,
    /// Point of the picture, from (-1, -1) lower left to (1, 1) upper right.
    pub(crate) at: DVec2,
    /// Direction of the camera ray, unit.
    pub(crate) direction: DVec3,
}

/// What the tiles share.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) shape: Shape<'a>,
    pub(crate) camera: Camera,
    /// Whether the camera stands within the bounds of the model.
    pub(crate) interior: bool,
    /// Length of occlusion rays, world space.
    pub(crate) reach: f64,
    args: &'a Args,
}

#[derive(Default)]
struct Tile {
    pixels: Vec<(u32, u32)>,
    colors: Vec<Vec3>,
    any_rays: u64,
    steps: Steps,
}

/// Renders a scene.
pub(crate) fn render(scene: &Scene, file: &Path, args: &Args) -> Result<(Picture, Summary), Failure> {
    let view = scene.object(0);
    let shape = Shape::new(view);
    if args.mode != Mode::Steps {
        shape.require_geometry(file)?;
    }
    let camera =
        if args.inside { inside::camera(scene, &shape, args) } else { Camera::outside(args, &shape) };
    let interior = args.inside || (camera.eye.cmpgt(shape.lower) & camera.eye.cmplt(shape.upper)).all();
    let reach = shape.diagonal() * if interior { 0.08 } else { 0.5 };
    let frame = Frame { scene, shape, camera, interior, reach, args };
    Ok(frame.render())
}

impl Frame<'_> {
    fn render(&self) -> (Picture, Summary) {
        let start = Instant::now();
        let (width, height) = self.args.size;
        let columns = width.div_ceil(TILE);
        let count = columns * height.div_ceil(TILE);
        let bar = progress(u64::from(count));
        let studio = Studio::new(self, camera::vertical(self.args.up), !self.args.no_ground);
        let tiles: Vec<Tile> = (0..count)
            .into_par_iter()
            .map(|i| {
                let tile = self.tile(i % columns * TILE, i / columns * TILE, &studio);
                bar.inc(1);
                tile
            })
            .collect();
        bar.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        let picture = self.picture(&tiles);
        (picture, self.summary(&tiles, seconds))
    }

    /// Pixels of a tile in Morton order, so that successive camera rays are close to each other.
    fn pixels(&self, left: u32, top: u32) -> Vec<(u32, u32)> {
        let even_bits = |n: u32| (0..4).fold(0, |sum, bit| sum | (n >> (2 * bit) & 1) << bit);
        let (width, height) = self.args.size;
        (0..TILE * TILE)
            .map(|i| (left + even_bits(i), top + even_bits(i >> 1)))
            .filter(|&(x, y)| x < width && y < height)
            .collect()
    }

    fn sample(&self, (x, y): (u32, u32), index: u32) -> Sample {
        let sampler = Sampler::new(x, y);
        let within = if self.args.spp == 1 { DVec2::splat(0.5) } else { sampler.point(0, index) };
        let (width, height) = self.args.size;
        let part = (DVec2::new(f64::from(x), f64::from(y)) + within)
            / DVec2::new(f64::from(width), f64::from(height));
        let at = DVec2::new(2.0 * part.x - 1.0, 1.0 - 2.0 * part.y);
        Sample { sampler, index, at, direction: self.camera.direction(at) }
    }

    fn tile(&self, left: u32, top: u32, studio: &Studio) -> Tile {
        let pixels = self.pixels(left, top);
        let mut tile = Tile { colors: vec![Vec3::ZERO; pixels.len()], pixels, ..Tile::default() };
        for index in 0..self.args.spp {
            let samples: Vec<Sample> = tile.pixels.iter().map(|&pixel| self.sample(pixel, index)).collect();
            let origin = self.camera.eye.as_vec3().to_array();
            let rays: Vec<Ray> = samples
                .iter()
                .map(|s| Ray {
                    origin,
                    tmin: 0.0,
                    direction: s.direction.as_vec3().to_array(),
                    tmax: f32::INFINITY,
                })
                .collect();
            let colors = if self.args.mode == Mode::Steps {
                self.count_steps(&rays, &mut tile.steps)
            } else {
                let mut hits = vec![Hit::MISS; rays.len()];
                self.scene.nearest_batch(&rays, None, &mut hits);
                match self.args.mode {
                    Mode::Shaded => studio.shade(self, &samples, &hits, &mut tile.any_rays),
                    Mode::Ao => self.occlusion(&samples, &hits, &mut tile.any_rays),
                    Mode::Normals | Mode::Steps => self.normals(&samples, &hits),
                }
            };
            tile.colors.iter_mut().zip(colors).for_each(|(sum, color)| *sum += color / self.args.spp as f32);
        }
        tile
    }

    /// The point of a hit and its geometric normal, towards the camera.
    pub(crate) fn surface(&self, sample: &Sample, hit: &Hit) -> (DVec3, DVec3) {
        let point = self.camera.eye + sample.direction * f64::from(hit.t);
        (point, self.shape.geometric_normal(hit.surface.triangle, -sample.direction))
    }

    fn normals(&self, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
        let color = |(sample, hit): (&Sample, &Hit)| {
            if !hit.is_hit() {
                return Vec3::splat(0.09);
            }
            let normal = self.shape.shading_normal(hit, self.surface(sample, hit).1);
            (normal * 0.5 + 0.5).as_vec3()
        };
        samples.iter().zip(hits).map(color).collect()
    }

    fn occlusion(&self, samples: &[Sample], hits: &[Hit], any_rays: &mut u64) -> Vec<Vec3> {
        let mut queue = Queue::default();
        for (sample, hit) in samples.iter().zip(hits).filter(|(_, hit)| hit.is_hit()) {
            let (point, normal) = self.surface(sample, hit);
            let start = Start::above(point, normal, hit.surface, self.shape.diagonal());
            for ray in 0..AO_RAYS {
                let at = sample.sampler.point(1, sample.index * AO_RAYS + ray);
                queue.push(start, cosine_hemisphere(normal, at), self.reach);
            }
        }
        *any_rays += queue.len() as u64;
        let blocked = queue.trace(self.scene);
        let mut answers = blocked.chunks(AO_RAYS as usize);
        let color = |hit: &Hit| {
            if !hit.is_hit() {
                return AO_BACKGROUND;
            }
            let open = answers.next().map_or(0, |chunk| chunk.iter().filter(|b| !**b).count());
            Vec3::splat(0.9 * open as f32 / AO_RAYS as f32)
        };
        hits.iter().map(color).collect()
    }

    /// Steps of each ray in the first component.
    fn count_steps(&self, rays: &[Ray], total: &mut Steps) -> Vec<Vec3> {
        let count = |ray: &Ray| {
            let (_, steps) = self.scene.nearest_counted(ray, Surface::NONE);
            total.nodes += f64::from(steps.nodes);
            total.leaves += f64::from(steps.leaves);
            total.triangles += f64::from(steps.triangles);
            total.tets += f64::from(steps.tets);
            Vec3::X * (steps.nodes + steps.leaves + steps.tets) as f32
        };
        rays.iter().map(count).collect()
    }

    fn picture(&self, tiles: &[Tile]) -> Picture {
        let (width, height) = self.args.size;
        let mut picture = Picture { width, height, pixels: vec![[0; 3]; width as usize * height as usize] };
        let maximum = if self.args.mode == Mode::Steps { high_end(tiles) } else { 0 };
        let display = |color: Vec3| match self.args.mode {
            Mode::Shaded | Mode::Ao => color.to_array().map(srgb),
            Mode::Normals => color.to_array(),
            Mode::Steps => ramp::color(color.x / maximum as f32),
        };
        for tile in tiles {
            for (&(x, y), &color) in tile.pixels.iter().zip(&tile.colors) {
                picture.set(x, y, quantized(display(color)));
            }
        }
        if self.args.mode == Mode::Steps {
            legend::draw(&mut picture, maximum);
        }
        picture
    }

    fn summary(&self, tiles: &[Tile], seconds: f64) -> Summary {
        let pixels = u64::from(self.args.size.0) * u64::from(self.args.size.1);
        let nearest_rays = pixels * u64::from(self.args.spp);
        let mean = |field: fn(&Steps) -> f64| {
            tiles.iter().map(|t| field(&t.steps)).sum::<f64>() / nearest_rays as f64
        };
        let steps = (self.args.mode == Mode::Steps).then(|| Steps {
            nodes: mean(|s| s.nodes),
            leaves: mean(|s| s.leaves),
            triangles: mean(|s| s.triangles),
            tets: mean(|s| s.tets),
        });
        Summary { seconds, nearest_rays, any_rays: tiles.iter().map(|t| t.any_rays).sum(), steps }
    }
}

/// The upper end of the heat map: the 99.8th percentile, so that single pixels do not darken the
/// rest, rounded up to a multiple of 4 so that the legend's numbers are whole.
fn high_end(tiles: &[Tile]) -> u32 {
    let mut values: Vec<f32> = tiles.iter().flat_map(|t| t.colors.iter().map(|c| c.x)).collect();
    let Some(last) = values.len().checked_sub(1) else { return 4 };
    let rank = last - last / 500;
    let (_, value, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    (value.ceil() as u32).max(1).next_multiple_of(4)
}

fn progress(tiles: u64) -> ProgressBar {
    let visible = std::io::stderr().is_terminal();
    let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(tiles), target);
    let style = ProgressStyle::with_template("rendering {bar:30} {human_pos}/{human_len} tiles  {eta} left");
    if let Ok(style) = style { bar.with_style(style) } else { bar }
}
