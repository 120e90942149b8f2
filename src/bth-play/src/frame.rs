//! One frame: tiles in parallel, batches of rays per tile.

use crate::args::{Args, Mode};
use crate::camera::{self, Camera, Sight};
use crate::clay::{self, Studio};
use crate::develop::develop;
use crate::failure::Failure;
use crate::lights::Lights;
use crate::occlusion::{Queue, Start};
use crate::path;
use crate::picture::Picture;
use crate::progress::Progress;
use crate::sampling::{Sampler, cosine_hemisphere};
use crate::stage::{Space, Stage};
use crate::surface::Surfaces;
use bth::Scene;
use bth::rays::{Hit, Ray, Surface};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;
use std::path::Path;
use std::time::Instant;

/// Pixels along the side of a tile.
pub(crate) const TILE: u32 = 16;
/// Ambient-occlusion rays per sample.
const AO_RAYS: u32 = 4;
/// Dark enough that open surfaces, which are white, stand out.
const AO_BACKGROUND: Vec3 = Vec3::splat(0.14);

/// What a frame took.
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
    /// The camera ray.
    pub(crate) sight: Sight,
}

/// What the tiles share.
pub(crate) struct Frame<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) surfaces: Surfaces<'a>,
    /// What all frames take.
    pub(crate) space: &'a Space,
    pub(crate) camera: Camera,
    /// Whether the camera stands in a room.
    pub(crate) interior: bool,
    /// Length of occlusion rays, world space.
    pub(crate) reach: f64,
    args: &'a Args,
}

/// A part of the picture.
#[derive(Default)]
pub(crate) struct Tile {
    pub(crate) pixels: Vec<(u32, u32)>,
    /// Means over the samples; what they are depends on the mode.
    pub(crate) colors: Vec<Vec3>,
    /// Nearest-hit rays beyond those of the camera.
    nearest_rays: u64,
    any_rays: u64,
    steps: Steps,
}

/// Shades samples that have been traced.
pub(crate) enum Shader {
    Clay(Studio),
    Path(Lights),
    /// What the mode needs is at hand.
    Plain,
}

/// Renders a scene at its time.
pub(crate) fn render(
    scene: &Scene,
    file: &Path,
    stage: &Stage,
    args: &Args,
    progress: &Progress,
) -> Result<(Picture, Summary), Failure> {
    let frame = Frame::new(scene, file, stage, stage.camera(scene, args), args)?;
    Ok(frame.render(progress))
}

impl<'a> Frame<'a> {
    /// A scene at its time, seen by a camera.
    ///
    /// # Errors
    /// If the file lacks what the mode needs.
    pub(crate) fn new(
        scene: &'a Scene,
        file: &Path,
        stage: &'a Stage,
        camera: Camera,
        args: &'a Args,
    ) -> Result<Self, Failure> {
        let surfaces = Surfaces::new(scene);
        if !matches!(args.mode, Mode::Steps) {
            surfaces.require_geometry(file)?;
        }
        let interior = stage.interior;
        let reach = stage.space.diagonal() * if interior { 0.08 } else { 0.5 };
        Ok(Frame { scene, surfaces, space: &stage.space, camera, interior, reach, args })
    }

    /// What shades the samples of this frame.
    pub(crate) fn shader(&self) -> Shader {
        let vertical = camera::vertical(self.args.up);
        match self.args.mode {
            Mode::Shaded => {
                let ground = !self.args.no_ground && self.scene.description().is_none();
                Shader::Clay(Studio::new(self, vertical, ground))
            }
            Mode::Path => {
                let lamp = self.interior.then(|| {
                    let place = clay::lamp(self, vertical);
                    (place, 1.5 * (place - self.camera.eye).length())
                });
                Shader::Path(Lights::new(self.scene, self.space, vertical, lamp))
            }
            Mode::Normals | Mode::Ao | Mode::Steps | Mode::Instances => Shader::Plain,
        }
    }

    fn render(&self, progress: &Progress) -> (Picture, Summary) {
        let start = Instant::now();
        let shader = self.shader();
        let tiles: Vec<Tile> = (0..tile_count(self.args.size))
            .into_par_iter()
            .map(|number| {
                let tile = self.tile(number, 0..self.args.spp, &shader);
                progress.tile_done();
                tile
            })
            .collect();
        let seconds = start.elapsed().as_secs_f64();
        let mut colors = vec![Vec3::ZERO; pixel_count(self.args.size)];
        for tile in &tiles {
            tile.place(&mut colors, self.args.size.0, |color, mean| *color = mean);
        }
        (develop(&colors, self.args), self.summary(&tiles, seconds))
    }

    /// Times that light is reflected.
    pub(crate) fn bounces(&self) -> u32 {
        self.args.bounces
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

    fn sample(&self, (x, y): (u32, u32), index: u32, alone: bool) -> Sample {
        let sampler = Sampler::new(x, y);
        let within = if alone { DVec2::splat(0.5) } else { sampler.point(0, index) };
        let (width, height) = self.args.size;
        let part = (DVec2::new(f64::from(x), f64::from(y)) + within)
            / DVec2::new(f64::from(width), f64::from(height));
        let at = DVec2::new(2.0 * part.x - 1.0, 1.0 - 2.0 * part.y);
        Sample { sampler, index, at, sight: self.camera.sight(at) }
    }

    /// Renders some of the samples of a tile. The first one alone goes through the middle of its pixel.
    pub(crate) fn tile(&self, number: u32, indices: Range<u32>, shader: &Shader) -> Tile {
        let columns = self.args.size.0.div_ceil(TILE);
        let pixels = self.pixels(number % columns * TILE, number / columns * TILE);
        let mut tile = Tile { colors: vec![Vec3::ZERO; pixels.len()], pixels, ..Tile::default() };
        let (count, alone) = (indices.len() as f32, indices == (0..1));
        for index in indices {
            let samples: Vec<Sample> =
                tile.pixels.iter().map(|&pixel| self.sample(pixel, index, alone)).collect();
            let ray = |s: &Sample| Ray {
                origin: s.sight.origin.as_vec3().to_array(),
                tmin: s.sight.range.0 as f32,
                direction: s.sight.direction.as_vec3().to_array(),
                tmax: s.sight.range.1 as f32,
            };
            let rays: Vec<Ray> = samples.iter().map(ray).collect();
            let colors = if self.args.mode == Mode::Steps {
                self.count_steps(&rays, &mut tile.steps)
            } else {
                let mut hits = vec![Hit::MISS; rays.len()];
                self.scene.nearest_batch(&rays, None, &mut hits);
                match (shader, self.args.mode) {
                    (Shader::Clay(studio), _) => studio.shade(self, &samples, &hits, &mut tile.any_rays),
                    (Shader::Path(lights), _) => {
                        let mut counts = (0, 0);
                        let colors = path::trace(self, lights, &samples, &hits, &mut counts);
                        tile.nearest_rays += counts.0;
                        tile.any_rays += counts.1;
                        colors
                    }
                    (Shader::Plain, Mode::Ao) => self.occlusion(&samples, &hits, &mut tile.any_rays),
                    (Shader::Plain, Mode::Instances) => self.instances(&samples, &hits),
                    (Shader::Plain, _) => self.normals(&samples, &hits),
                }
            };
            tile.colors.iter_mut().zip(colors).for_each(|(sum, color)| *sum += color / count);
        }
        tile
    }

    /// The point of a hit and its geometric normal, towards the camera.
    pub(crate) fn surface(&self, sample: &Sample, hit: &Hit) -> (DVec3, DVec3) {
        let point = sample.sight.origin + sample.sight.direction * f64::from(hit.t);
        (point, self.surfaces.geometric_normal(hit.surface, -sample.sight.direction))
    }

    fn normals(&self, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
        let color = |(sample, hit): (&Sample, &Hit)| {
            if !hit.is_hit() {
                return Vec3::splat(0.09);
            }
            let normal = self.surfaces.shading_normal(hit, self.surface(sample, hit).1);
            (normal * 0.5 + 0.5).as_vec3()
        };
        samples.iter().zip(hits).map(color).collect()
    }

    /// Each instance in a colour of its own, darker where it turns away.
    fn instances(&self, samples: &[Sample], hits: &[Hit]) -> Vec<Vec3> {
        let color = |(sample, hit): (&Sample, &Hit)| {
            if !hit.is_hit() {
                return Vec3::splat(0.02);
            }
            let (_, normal) = self.surface(sample, hit);
            let facing = normal.dot(-sample.sight.direction) as f32;
            hue(hit.surface.instance) * (0.25 + 0.75 * facing)
        };
        samples.iter().zip(hits).map(color).collect()
    }

    fn occlusion(&self, samples: &[Sample], hits: &[Hit], any_rays: &mut u64) -> Vec<Vec3> {
        let mut queue = Queue::default();
        for (sample, hit) in samples.iter().zip(hits).filter(|(_, hit)| hit.is_hit()) {
            let (point, normal) = self.surface(sample, hit);
            let start = Start::above(point, normal, hit.surface, self.space.diagonal());
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

    fn summary(&self, tiles: &[Tile], seconds: f64) -> Summary {
        let pixels = u64::from(self.args.size.0) * u64::from(self.args.size.1);
        let camera_rays = pixels * u64::from(self.args.spp);
        let nearest_rays = camera_rays + tiles.iter().map(|t| t.nearest_rays).sum::<u64>();
        let mean = |field: fn(&Steps) -> f64| {
            tiles.iter().map(|t| field(&t.steps)).sum::<f64>() / camera_rays as f64
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

impl Tile {
    /// Does something with each pixel of a picture, in rows of `width`, and its mean here.
    pub(crate) fn place(&self, picture: &mut [Vec3], width: u32, act: impl Fn(&mut Vec3, Vec3)) {
        for (&(x, y), &mean) in self.pixels.iter().zip(&self.colors) {
            act(&mut picture[y as usize * width as usize + x as usize], mean);
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

/// A colour for a number: hues far apart for successive ones (golden ratio), in linear light.
pub(crate) fn hue(number: u32) -> Vec3 {
    let angle = (f64::from(number) * 0.618_033_988_749_895).fract() as f32 * std::f32::consts::TAU;
    let third = std::f32::consts::TAU / 3.0;
    let wave = |shift: f32| (0.5 + 0.5 * (angle - shift).cos()).powf(1.5);
    Vec3::new(wave(0.0), wave(third), wave(2.0 * third)) * 0.8 + 0.06
}
