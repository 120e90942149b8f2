//! The studio of mode shaded: clay under a soft key light and a fill light, with ambient
//! occlusion, on a ground that only shows its shadows.

use crate::frame::{Frame, Sample};
use crate::occlusion::{Queue, Start};
use crate::sampling::{cosine_hemisphere, disc};
use bth::rays::{Hit, Ray, Surface};
use glam::{DVec3, Vec3};

/// Ambient-occlusion rays per sample.
const AMBIENT_RAYS: u32 = 2;
/// Radius of the key light at distance 1: the softness of its shadows.
const KEY_RADIUS: f64 = 0.16;
const CLAY: Vec3 = Vec3::new(0.57, 0.515, 0.465);
const KEY: Vec3 = Vec3::new(1.15, 1.08, 0.97);
const FILL: Vec3 = Vec3::new(0.12, 0.145, 0.19);
const SKY: Vec3 = Vec3::new(0.33, 0.37, 0.43);
const BOUNCE: Vec3 = Vec3::new(0.22, 0.20, 0.18);
const BACKGROUND_TOP: Vec3 = Vec3::new(0.52, 0.56, 0.62);
const BACKGROUND_BOTTOM: Vec3 = Vec3::new(0.80, 0.81, 0.82);

/// Lights and ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Studio {
    vertical: DVec3,
    key: Key,
    /// Unit, towards the fill light.
    fill: DVec3,
    /// Height of the ground along the vertical, if there is one.
    ground: Option<f64>,
    diagonal: f64,
}

/// The key light.
#[derive(Clone, Copy, Debug)]
enum Key {
    /// Far away in this unit direction.
    Far(DVec3),
    /// At this point, for rooms.
    Near(DVec3),
}

/// A point to be lit; its rays are one key ray and then the ambient ones.
struct Lit {
    pixel: usize,
    normal: DVec3,
    to_key: DVec3,
    /// Share of the ground's shadow that shows; `None` for the model.
    ground: Option<f64>,
}

impl Studio {
    pub(crate) fn new(frame: &Frame<'_>, vertical: DVec3, ground: bool) -> Self {
        let camera = &frame.camera;
        let diagonal = frame.space.diagonal();
        let key = if frame.interior {
            Key::Near(lamp(frame, vertical))
        } else {
            Key::Far((-camera.forward * 0.45 - camera.right * 0.55 + vertical * 0.85).normalize())
        };
        let fill = (camera.right * 0.85 - camera.forward * 0.5 + vertical * 0.1).normalize();
        let ground = (ground && !frame.interior).then(|| frame.space.lower.dot(vertical));
        Self { vertical, key, fill, ground, diagonal }
    }

    /// The colours (linear) of a batch of samples.
    pub(crate) fn shade(
        &self,
        frame: &Frame<'_>,
        samples: &[Sample],
        hits: &[Hit],
        any_rays: &mut u64,
    ) -> Vec<Vec3> {
        let mut colors: Vec<Vec3> = samples.iter().map(|s| background(s.at.y, s.at.length())).collect();
        let mut queue = Queue::default();
        let mut lit = Vec::new();
        for (pixel, (sample, hit)) in samples.iter().zip(hits).enumerate() {
            if hit.is_hit() {
                let (point, geometric) = frame.surface(sample, hit);
                let start = Start::above(point, geometric, hit.surface, self.diagonal);
                let to_key = self.push(&mut queue, start, geometric, sample, frame.reach);
                let normal = frame.surfaces.shading_normal(hit, geometric);
                lit.push(Lit { pixel, normal, to_key, ground: None });
            } else if let Some((point, share)) = self.on_ground(frame, sample) {
                let start = Start::above(point, self.vertical, Surface::NONE, self.diagonal);
                let to_key = self.push(&mut queue, start, self.vertical, sample, frame.reach);
                lit.push(Lit { pixel, normal: self.vertical, to_key, ground: Some(share) });
            }
        }
        *any_rays += queue.len() as u64;
        let blocked = queue.trace(frame.scene);
        for (lit, blocked) in lit.iter().zip(blocked.chunks(1 + AMBIENT_RAYS as usize)) {
            let open = blocked[1..].iter().filter(|b| !**b).count() as f32 / AMBIENT_RAYS as f32;
            let key = if blocked[0] { 0.0 } else { 1.0 };
            let color = &mut colors[lit.pixel];
            *color = match lit.ground {
                Some(share) => *color * (1.0 - share as f32 * (0.62 * (1.0 - open) + 0.30 * (1.0 - key))),
                None => self.clay(lit, samples[lit.pixel].sight.direction, key, open),
            };
        }
        colors
    }

    /// Queues the key ray and the ambient rays of a point; gives the direction to the key light.
    fn push(&self, queue: &mut Queue, start: Start, normal: DVec3, sample: &Sample, reach: f64) -> DVec3 {
        let (to_key, length) = match self.key {
            Key::Far(direction) => (direction, 4.0 * self.diagonal),
            Key::Near(lamp) => {
                let to_lamp = lamp - start.point;
                (to_lamp.normalize_or(normal), to_lamp.length())
            }
        };
        let (tangent, bitangent) = to_key.any_orthonormal_pair();
        let spread = disc(sample.sampler.point(1, sample.index)) * KEY_RADIUS;
        queue.push(start, (to_key + tangent * spread.x + bitangent * spread.y).normalize(), length * 0.999);
        for ray in 0..AMBIENT_RAYS {
            let at = sample.sampler.point(2, sample.index * AMBIENT_RAYS + ray);
            queue.push(start, cosine_hemisphere(normal, at), reach);
        }
        to_key
    }

    fn clay(&self, lit: &Lit, direction: DVec3, key: f32, open: f32) -> Vec3 {
        let facing = |towards: DVec3| lit.normal.dot(towards).max(0.0) as f32;
        let height = (lit.normal.dot(self.vertical) * 0.5 + 0.5) as f32;
        let ambient = BOUNCE.lerp(SKY, height) * open;
        // A hint of gloss (Blinn), so that curvature shows in the lit parts.
        let half = (lit.to_key - direction).normalize_or(lit.normal);
        let gloss = 0.06 * facing(half).powi(24) * key;
        let light =
            KEY * (key * facing(lit.to_key)) + FILL * (facing(self.fill) * (0.4 + 0.6 * open)) + ambient;
        shoulder(CLAY * light + KEY * gloss)
    }

    /// Where the camera ray meets the ground, and how much of the shadow there shows.
    fn on_ground(&self, frame: &Frame<'_>, sample: &Sample) -> Option<(DVec3, f64)> {
        let height = self.ground?;
        let eye = sample.sight.origin;
        let (above, descent) = (eye.dot(self.vertical) - height, -sample.sight.direction.dot(self.vertical));
        if above <= 0.0 || descent <= 1e-6 {
            return None;
        }
        let point = eye + sample.sight.direction * (above / descent);
        let away =
            (point - frame.space.center()).reject_from_normalized(self.vertical).length() / self.diagonal;
        // Beyond a few diagonals the shadow is too faint to be seen.
        (away < 3.0).then(|| (point, (-(away / 1.1).powi(2)).exp()))
    }
}

/// A lamp above and beside the camera, before the next wall.
pub(crate) fn lamp(frame: &Frame<'_>, vertical: DVec3) -> DVec3 {
    let camera = &frame.camera;
    let direction = (vertical * 0.7 - camera.right * 0.6).normalize();
    let ray = Ray {
        origin: camera.eye.as_vec3().to_array(),
        tmin: 0.0,
        direction: direction.as_vec3().to_array(),
        tmax: (0.15 * frame.space.diagonal()) as f32,
    };
    let mut hit = [Hit::MISS];
    frame.scene.nearest_batch(&[ray], None, &mut hit);
    let free = f64::from(hit[0].t).min(f64::from(ray.tmax));
    camera.eye + direction * (0.6 * free)
}

/// A vertical gradient with a slight vignette.
fn background(height: f64, from_center: f64) -> Vec3 {
    let part = (height * 0.5 + 0.5) as f32;
    let smooth = part * part * (3.0 - 2.0 * part);
    BACKGROUND_BOTTOM.lerp(BACKGROUND_TOP, smooth) * (1.0 - 0.10 * (from_center * from_center) as f32)
}

/// Rolls bright values off towards 1 instead of clipping them.
fn shoulder(color: Vec3) -> Vec3 {
    let roll = |c: f32| if c <= 0.6 { c } else { 0.6 + 0.4 * (1.0 - (-(c - 0.6) / 0.4).exp()) };
    Vec3::new(roll(color.x), roll(color.y), roll(color.z))
}
