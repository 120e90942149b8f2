//! The light of mode path: the scene's lights, or else a sun or the lamp of a room, and a sky or
//! the surroundings of `--env`. Brightness is relative to the brightest light and to the size of
//! the scene.

use super::context::FrameContext;
use super::sky::Sky;
use crate::camera::{SceneBounds, front_and_up};
use crate::environment::{Environment, EnvironmentSample};
use crate::sampling::uniform_disc;
use bth::Scene;
use bth::rays::{Hit, Ray};
use bth_format::layout;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Tangent of half the angle under which a directional light is seen, for softer shadows.
const LIGHT_RADIUS: f64 = 0.02;
/// Irradiance of the brightest directional light.
const DIRECTIONAL: Vec3 = Vec3::new(2.5, 2.3, 2.0);
/// Irradiance of the brightest point or spot light at a quarter of the scene's diagonal.
const LAMP: f64 = 2.0;
/// Direction to the sun: degrees around the model from its front, and above the horizon.
const SUN: [f64; 2] = [-28.0, 43.0];

/// A sample of a light as seen from a point.
pub(crate) struct LightSample {
    /// Unit, towards the light.
    pub(crate) direction: DVec3,
    pub(crate) distance: f64,
    /// Irradiance at normal incidence if nothing blocks the light.
    pub(crate) light: Vec3,
}

enum Light {
    /// `towards` is the unit direction to the light.
    Directional { towards: DVec3, light: Vec3 },
    /// A point light, or with a cone a spot light; `light` is its irradiance at distance 1.
    Point { position: DVec3, light: Vec3, range: f64, cone: Option<Cone> },
}

struct Cone {
    axis: DVec3,
    /// Cosines of the angles to the axis at which the light begins to fade and at which it ends.
    inner: f64,
    outer: f64,
}

/// What shines where nothing is hit.
enum Surroundings<'a> {
    Picture(&'a Environment),
    Sky(Box<Sky>),
}

/// All light of a frame.
pub(crate) struct Lights<'a> {
    lights: Vec<Light>,
    /// Length of shadow rays to directional lights: beyond the bounds of the scene.
    far_distance: f64,
    surroundings: Surroundings<'a>,
}

impl<'a> Lights<'a> {
    /// The lights of a scene at the time to which it is set. A scene without lights gets a sun, or
    /// in a room a lamp, given by its position and the distance at which it is as bright as
    /// [`LAMP`].
    pub(crate) fn new(frame: &FrameContext<'a>, lamp: Option<(DVec3, f64)>) -> Self {
        let FrameContext { scene, bounds, environment, .. } = *frame;
        let mut lights = of_scene(scene, bounds);
        if let Some((position, distance)) = lamp.filter(|_| lights.is_empty()) {
            let light = Vec3::splat((LAMP * distance * distance) as f32);
            lights.push(Light::Point { position, light, range: f64::INFINITY, cone: None });
        }
        let surroundings = match environment {
            Some(picture) => Surroundings::Picture(picture),
            None => {
                let [front, vertical] = front_and_up(frame.args.up());
                let [around, above] = SUN.map(f64::to_radians);
                // Fixed in the world, so that it does not turn with a moving camera.
                let level = DVec3::X * around.sin() + front * around.cos();
                let sun = level * above.cos() + vertical * above.sin();
                let of_light = lights.iter().find_map(|light| match light {
                    Light::Directional { towards, .. } => Some(*towards).filter(|t| t.dot(vertical) > 0.0),
                    Light::Point { .. } => None,
                });
                Surroundings::Sky(Box::new(Sky::new(vertical, of_light.unwrap_or(sun), lights.is_empty())))
            }
        };
        Self { lights, far_distance: bounds.reach(), surroundings }
    }

    /// Radiance of the surroundings in a unit direction.
    pub(crate) fn sky(&self, direction: DVec3) -> Vec3 {
        match &self.surroundings {
            Surroundings::Picture(picture) => picture.radiance(direction),
            Surroundings::Sky(sky) => sky.radiance(direction),
        }
    }

    /// A sample of the surroundings for a point of the unit square, and its density with regard to
    /// solid angle. The light is radiance divided by that density and by π. `None` in the dark,
    /// and for a sky without a sun, which is much the same everywhere.
    pub(crate) fn surroundings(&self, point: DVec2) -> Option<(LightSample, f64)> {
        let EnvironmentSample { direction, radiance, density } = match &self.surroundings {
            Surroundings::Picture(picture) => picture.sample(point),
            Surroundings::Sky(sky) => sky.sample(point),
        }?;
        let light = (radiance.as_dvec3() / (density * PI)).as_vec3();
        Some((LightSample { direction, distance: self.far_distance, light }, density))
    }

    /// Density of [`Self::surroundings`] in a unit direction.
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        match &self.surroundings {
            Surroundings::Picture(picture) => picture.density(direction),
            Surroundings::Sky(sky) => sky.density(direction),
        }
    }

    /// Samples of the lights as seen from a point: one of each directional light, and one of a
    /// point light that is chosen uniformly at random. `spread` and `choice` are points of the unit
    /// square.
    pub(crate) fn samples(
        &self,
        point: DVec3,
        spread: DVec2,
        choice: DVec2,
    ) -> impl Iterator<Item = LightSample> {
        let count = self.lights.iter().filter(|l| matches!(l, Light::Point { .. })).count();
        let chosen = (choice.x * count as f64) as usize;
        let directional = self.lights.iter().filter_map(move |l| match l {
            Light::Directional { towards, light } => {
                let (tangent, bitangent) = towards.any_orthonormal_pair();
                let at = uniform_disc(spread) * LIGHT_RADIUS;
                let direction = (*towards + tangent * at.x + bitangent * at.y).normalize();
                Some(LightSample { direction, distance: self.far_distance, light: *light })
            }
            Light::Point { .. } => None,
        });
        let mut points = self.lights.iter().filter(|l| matches!(l, Light::Point { .. }));
        let point_light = points.nth(chosen.min(count.max(1) - 1));
        directional.chain(point_light.and_then(move |l| l.seen_from(point, count as f64)))
    }
}

/// The visible lights of a scene at the time to which it is set.
fn of_scene(scene: &Scene, bounds: &SceneBounds) -> Vec<Light> {
    let Some(view) = scene.description() else { return Vec::new() };
    let strength = |l: &layout::Light| l.intensity * l.color.iter().fold(0.0f64, |m, c| m.max(*c));
    let brightest = |directional: bool| {
        let same = view.lights.iter().filter(|l| (l.kind == 0) == directional);
        same.map(strength).fold(0.0f64, f64::max)
    };
    let (brightest_directional, brightest_point) = (brightest(true), brightest(false));
    let mut lights = Vec::new();
    for light in view.lights {
        let (rows, visible) = scene.node(light.node);
        let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
        let axis = (-column(2)).normalize_or(DVec3::NEG_Z);
        if !visible || strength(light) <= 0.0 {
            continue;
        }
        let color = DVec3::from_array(light.color) * light.intensity;
        if light.kind == 0 {
            let light = DIRECTIONAL * (color / brightest_directional).as_vec3();
            lights.push(Light::Directional { towards: -axis, light });
            continue;
        }
        let distance = 0.25 * bounds.diagonal();
        let cosine = |degrees: f64| degrees.to_radians().cos();
        lights.push(Light::Point {
            position: column(3),
            light: (color / brightest_point * LAMP * distance * distance).as_vec3(),
            range: if light.range > 0.0 { light.range } else { f64::INFINITY },
            cone: (light.kind == 2).then(|| Cone {
                axis,
                inner: cosine(light.inner),
                outer: cosine(light.outer),
            }),
        });
    }
    lights
}

impl Light {
    /// The sample of a point light as seen from a point, weighted with the number of lights among
    /// which it was chosen. `None` beyond its range or cone.
    fn seen_from(&self, point: DVec3, lights: f64) -> Option<LightSample> {
        let Light::Point { position, light, range, cone } = self else { return None };
        let (direction, distance) = (*position - point).normalize_and_length();
        if distance == 0.0 || distance > *range {
            return None;
        }
        let spot = cone.as_ref().map_or(1.0, |cone| {
            let part = (-direction.dot(cone.axis) - cone.outer) / (cone.inner - cone.outer);
            part.clamp(0.0, 1.0).powi(2)
        });
        let window = (1.0 - (distance / range).powi(4)).max(0.0);
        let scale = lights * spot * window / (distance * distance);
        (scale > 0.0).then(|| LightSample { direction, distance, light: *light * scale as f32 })
    }
}

/// The position of a lamp above and next to the camera, in front of the nearest wall in that
/// direction.
pub(super) fn room_lamp(frame: &FrameContext<'_>, vertical: DVec3) -> DVec3 {
    let camera = &frame.camera;
    let direction = (vertical * 0.7 - camera.right * 0.6).normalize();
    let ray = Ray {
        origin: camera.eye.as_vec3().to_array(),
        tmin: 0.0,
        direction: direction.as_vec3().to_array(),
        tmax: (0.15 * frame.bounds.diagonal()) as f32,
    };
    let mut hit = [Hit::MISS];
    frame.scene.batch(&[ray]).nearest(&mut hit);
    let free = f64::from(hit[0].t).min(f64::from(ray.tmax));
    camera.eye + direction * (0.6 * free)
}
