//! The studio shader of modes shaded and clay: base colours, or a matte clay, under a soft key
//! light and a fill light, with ambient occlusion, on a ground that only catches shadows.

use super::bsdf::Bsdf;
use super::context::{FrameContext, Sample};
use super::lights::room_lamp;
use super::surface::Surface;
use super::visibility::OcclusionRays;
use crate::color::shoulder;
use crate::materials::Look;
use crate::sampling::{cosine_hemisphere, uniform_disc};
use bth::TraceRay;
use bth::rays::{Hit, Ray, StartRay};
use glam::{DVec3, Vec3};

/// Ambient-occlusion rays per sample.
const AMBIENT_RAYS: u32 = 2;
/// Radius of the key light at distance 1, which decides how soft its shadows are.
const KEY_RADIUS: f64 = 0.16;
/// Albedo of the clay.
const STUDIO_ALBEDO: Vec3 = Vec3::new(0.57, 0.515, 0.465);
/// Irradiance of the key light, of the fill light, and of the ambient light from above and from
/// below.
const KEY: Vec3 = Vec3::new(1.15, 1.08, 0.97);
const FILL: Vec3 = Vec3::new(0.12, 0.145, 0.19);
const SKY: Vec3 = Vec3::new(0.33, 0.37, 0.43);
const BOUNCE: Vec3 = Vec3::new(0.22, 0.20, 0.18);
/// How much brighter what mirrors show is than the ambient light.
const ROOM: f32 = 1.6;
const BACKGROUND_TOP: Vec3 = Vec3::new(0.52, 0.56, 0.62);
const BACKGROUND_BOTTOM: Vec3 = Vec3::new(0.80, 0.81, 0.82);

/// The lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Studio {
    vertical: DVec3,
    key: Key,
    /// Unit, towards the fill light.
    fill: DVec3,
    /// Length of rays to a key light far away.
    reach: f64,
}

/// The key light.
#[derive(Clone, Copy, Debug)]
enum Key {
    /// Infinitely far away in this unit direction.
    Directional(DVec3),
    /// At this point, for rooms.
    Point(DVec3),
}

/// A point to be lit. Its occlusion rays are one to the key light and then [`AMBIENT_RAYS`].
struct ShadingPoint {
    /// Index of its sample.
    sample: usize,
    /// The normal of the triangle or of the ground, on the side of the viewer.
    geometric: DVec3,
    to_key: DVec3,
    what: LitSurface,
}

/// Points of one kind, and the occlusion rays of all of them.
struct Lit<R> {
    points: Vec<ShadingPoint>,
    rays: OcclusionRays<R>,
}

impl<R: TraceRay> Lit<R> {
    fn new() -> Self {
        Self { points: Vec::new(), rays: OcclusionRays::new() }
    }
}

/// What is lit.
#[derive(Clone, Debug)]
enum LitSurface {
    /// The ground, and how strongly a shadow shows there.
    Ground(f64),
    /// The clay of what has no material, with its normal.
    Clay(DVec3),
    Material(Box<(Bsdf, Look)>),
}

impl Studio {
    pub(crate) fn new(frame: &FrameContext<'_>, vertical: DVec3) -> Self {
        let camera = &frame.camera;
        let key = if frame.interior {
            Key::Point(room_lamp(frame, vertical))
        } else {
            Key::Directional((-camera.forward * 0.45 - camera.right * 0.55 + vertical * 0.85).normalize())
        };
        let fill = (camera.right * 0.85 - camera.forward * 0.5 + vertical * 0.1).normalize();
        Self { vertical, key, fill, reach: frame.bounds.reach() }
    }

    /// The colours (linear) of a batch of samples.
    pub(crate) fn shade(
        &self,
        frame: &FrameContext<'_>,
        samples: &[Sample],
        hits: &[Hit],
        any_rays: &mut u64,
    ) -> Vec<Vec3> {
        let mut colors: Vec<Vec3> = samples.iter().map(|s| background(s.at.y, s.at.length())).collect();
        let (mut lit, mut on_ground) = (Lit::new(), Lit::new());
        for (index, (sample, hit)) in samples.iter().zip(hits).enumerate() {
            if hit.is_hit() {
                let look = frame.materials.look(frame.scene, frame.geometry.object(hit.primitive), hit);
                if let Some(Look { base_color, emissive, unlit: true, .. }) = look {
                    colors[index] = base_color + emissive;
                    continue;
                }
                let (point, geometric) = frame.point_and_normal(sample, hit);
                let ray = |direction, tmax| StartRay::from_hit(hit, direction).with_tmax(tmax);
                let to_key = self.push(&mut lit.rays, (point, geometric), ray, sample, frame);
                let what = match look {
                    None => LitSurface::Clay(frame.geometry.shading_normal(hit, geometric)),
                    Some(look) => {
                        let normal = frame.shading_normal(hit, geometric, &look);
                        let (to_viewer, base) = (-sample.ray.direction, look.base_color.min(Vec3::ONE));
                        LitSurface::Material(Box::new((Bsdf::new(normal, to_viewer, base, look.gloss), look)))
                    }
                };
                lit.points.push(ShadingPoint { sample: index, geometric, to_key, what });
            } else if let Some((point, normal, share)) =
                frame.ground.and_then(|ground| ground.hit(sample.ray.origin, sample.ray.direction))
            {
                let origin = point.as_vec3().to_array();
                let ray = |direction, tmax| Ray { origin, tmin: 0.0, direction, tmax };
                let to_key = self.push(&mut on_ground.rays, (point, normal), ray, sample, frame);
                let what = LitSurface::Ground(share);
                on_ground.points.push(ShadingPoint { sample: index, geometric: normal, to_key, what });
            }
        }
        *any_rays += (lit.rays.len() + on_ground.rays.len()) as u64;
        self.light_points(frame, samples, &lit, &mut colors);
        self.light_points(frame, samples, &on_ground, &mut colors);
        colors
    }

    /// Sets the colours of points.
    fn light_points<R: TraceRay>(
        &self,
        frame: &FrameContext<'_>,
        samples: &[Sample],
        lit: &Lit<R>,
        colors: &mut [Vec3],
    ) {
        let blocked = lit.rays.trace(frame);
        for (point, blocked) in lit.points.iter().zip(blocked.chunks(1 + AMBIENT_RAYS as usize)) {
            let open = blocked[1..].iter().filter(|b| !**b).count() as f32 / AMBIENT_RAYS as f32;
            let key = if blocked[0] { 0.0 } else { 1.0 };
            let color = &mut colors[point.sample];
            let direction = samples[point.sample].ray.direction;
            *color = match &point.what {
                &LitSurface::Ground(share) => {
                    *color * (1.0 - share as f32 * (0.62 * (1.0 - open) + 0.30 * (1.0 - key)))
                }
                &LitSurface::Clay(normal) => {
                    let bsdf = Bsdf::new(normal, -direction, STUDIO_ALBEDO, None);
                    let gloss = self.gloss(point, bsdf.normal(), direction, key);
                    shoulder(self.light(point, &bsdf, key, open) + gloss)
                }
                LitSurface::Material(material) => {
                    let (bsdf, look) = &**material;
                    let open = open * look.occlusion;
                    let (up, mirrored) = (self.vertical, direction.reflect(bsdf.normal()));
                    let room = BOUNCE.lerp(SKY, (mirrored.dot(up) * 0.5 + 0.5) as f32) * ROOM;
                    let reflected = bsdf.gloss_albedo() * room * open;
                    shoulder(self.light(point, bsdf, key, open) + reflected + look.emissive)
                }
            };
        }
    }

    /// Adds the key ray and the ambient rays of a point with its normal, made of direction and
    /// length by `ray`; returns the direction to the key light.
    fn push<R: TraceRay>(
        &self,
        rays: &mut OcclusionRays<R>,
        (point, normal): (DVec3, DVec3),
        ray: impl Fn([f32; 3], f32) -> R,
        sample: &Sample,
        frame: &FrameContext<'_>,
    ) -> DVec3 {
        let ray = |direction: DVec3, length: f64| ray(direction.as_vec3().to_array(), length as f32);
        let (to_key, length) = match self.key {
            Key::Directional(direction) => (direction, self.reach),
            Key::Point(lamp) => {
                let to_lamp = lamp - point;
                (to_lamp.normalize_or(normal), to_lamp.length())
            }
        };
        let (tangent, bitangent) = to_key.any_orthonormal_pair();
        let spread = uniform_disc(sample.sampler.point(1, sample.index)) * KEY_RADIUS;
        let towards = (to_key + tangent * spread.x + bitangent * spread.y).normalize();
        rays.push(ray(towards, length), sample.chance(1));
        for number in 0..AMBIENT_RAYS {
            let at = sample.sampler.point(2, sample.index * AMBIENT_RAYS + number);
            let direction = cosine_hemisphere(normal, at);
            rays.push(ray(direction, frame.occlusion_distance), sample.chance(2 + u64::from(number)));
        }
        to_key
    }

    /// The light that a point of the model scatters; `key` is the visible share of the key light,
    /// `open` the visible share of the hemisphere.
    fn light(&self, point: &ShadingPoint, bsdf: &Bsdf, key: f32, open: f32) -> Vec3 {
        let height = (bsdf.normal().dot(self.vertical) * 0.5 + 0.5) as f32;
        let ambient = bsdf.matte_albedo() * BOUNCE.lerp(SKY, height) * open;
        let soft = Surface::softened(point.geometric, bsdf.normal(), point.to_key) as f32;
        let of_key = bsdf.scattered(point.to_key).0 * KEY * (key * soft);
        of_key + bsdf.scattered(self.fill).0 * FILL * (0.4 + 0.6 * open) + ambient
    }

    /// A weak specular term (Blinn), which shows curvature in the lit parts of clay; `direction` is
    /// the direction of the camera ray.
    fn gloss(&self, point: &ShadingPoint, normal: DVec3, direction: DVec3, key: f32) -> Vec3 {
        let half = (point.to_key - direction).normalize_or(normal);
        let facing = normal.dot(half).max(0.0) as f32;
        KEY * (0.06 * facing.powi(24) * key)
    }
}

/// A vertical gradient with a slight vignette.
fn background(height: f64, from_center: f64) -> Vec3 {
    let part = (height * 0.5 + 0.5) as f32;
    let smooth = part * part * (3.0 - 2.0 * part);
    BACKGROUND_BOTTOM.lerp(BACKGROUND_TOP, smooth) * (1.0 - 0.10 * (from_center * from_center) as f32)
}
