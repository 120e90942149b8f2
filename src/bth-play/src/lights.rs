//! Light of mode path: the scene's lights, or a sun; and a sky. Brightness is taken relative to the brightest
//! light and the size of the scene, so that no exposure is needed and frames do not flicker.

use crate::sampling::disc;
use crate::stage::Space;
use bth::Scene;
use glam::{DVec2, DVec3, Vec3};

/// Half the angle of the sun, as a tangent: softer than the real one.
const SUN_RADIUS: f64 = 0.02;
/// Light of the sun, or of the brightest directional light.
const SUN: Vec3 = Vec3::new(2.1, 1.95, 1.7);
/// Light of the brightest lamp at a quarter of the scene's diagonal.
const LAMP: f64 = 2.0;
/// Sky at the zenith, at the horizon and below.
const ZENITH: Vec3 = Vec3::new(0.42, 0.58, 0.86);
const HORIZON: Vec3 = Vec3::new(0.86, 0.90, 0.94);
const BELOW: Vec3 = Vec3::new(0.34, 0.32, 0.30);

/// A way that light may come.
pub(crate) struct LightRay {
    /// Unit, towards the light.
    pub(crate) direction: DVec3,
    pub(crate) distance: f64,
    /// What arrives, before the cosine of the surface.
    pub(crate) light: Vec3,
}

enum Light {
    Far { towards: DVec3, light: Vec3 },
    Near { place: DVec3, light: Vec3, range: f64, cone: Option<Cone> },
}

struct Cone {
    axis: DVec3,
    /// Cosines of the angles where it begins to fade and ends.
    inner: f64,
    outer: f64,
}

/// All light of a frame.
pub(crate) struct Lights {
    lights: Vec<Light>,
    vertical: DVec3,
    /// Far light travels this far.
    reach: f64,
}

impl Lights {
    /// The lights of a scene at its time. One without any gets a sun, or in a room the lamp: a place, and the distance
    /// at which it is as bright as the brightest.
    pub(crate) fn new(scene: &Scene, space: &Space, vertical: DVec3, lamp: Option<(DVec3, f64)>) -> Self {
        let reach = 4.0 * space.diagonal();
        let mut lights = Vec::new();
        if let Some(view) = scene.description() {
            let strength =
                |l: &bth_format::layout::Light| l.intensity * l.color.iter().fold(0.0f64, |m, c| m.max(*c));
            let brightest = |far: bool| {
                let same = view.lights.iter().filter(|l| (l.kind == 0) == far);
                same.map(strength).fold(0.0f64, f64::max)
            };
            let (far, near) = (brightest(true), brightest(false));
            for light in view.lights {
                let (rows, seen) = scene.node(light.node);
                let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
                let axis = (-column(2)).normalize_or(DVec3::NEG_Z);
                if !seen || strength(light) <= 0.0 {
                    continue;
                }
                let color = DVec3::from_array(light.color) * light.intensity;
                if light.kind == 0 {
                    let light = SUN * (color / far).as_vec3();
                    lights.push(Light::Far { towards: -axis, light });
                    continue;
                }
                let distance = 0.25 * space.diagonal();
                let cosine = |degrees: f64| degrees.to_radians().cos();
                lights.push(Light::Near {
                    place: column(3),
                    light: (color / near * LAMP * distance * distance).as_vec3(),
                    range: if light.range > 0.0 { light.range } else { f64::INFINITY },
                    cone: (light.kind == 2).then(|| Cone {
                        axis,
                        inner: cosine(light.inner),
                        outer: cosine(light.outer),
                    }),
                });
            }
        }
        if let Some((place, distance)) = lamp.filter(|_| lights.is_empty()) {
            let light = Vec3::splat((LAMP * distance * distance) as f32);
            lights.push(Light::Near { place, light, range: f64::INFINITY, cone: None });
        }
        if lights.is_empty() {
            // Fixed in the world, so that it does not turn with a moving camera.
            let (side, front) = vertical.any_orthonormal_pair();
            let towards = (vertical * 0.9 + side * 0.45 + front * 0.35).normalize();
            lights.push(Light::Far { towards, light: SUN });
        }
        Self { lights, vertical, reach }
    }

    /// Light of the sky from a direction.
    pub(crate) fn sky(&self, direction: DVec3) -> Vec3 {
        let height = direction.dot(self.vertical) as f32;
        if height < 0.0 {
            HORIZON.lerp(BELOW, (-height * 4.0).min(1.0))
        } else {
            HORIZON.lerp(ZENITH, height.sqrt())
        }
    }

    /// Ways that light may come to a point: of far lights one each, of lamps one that is chosen by chance.
    pub(crate) fn samples(
        &self,
        point: DVec3,
        spread: DVec2,
        choice: DVec2,
    ) -> impl Iterator<Item = LightRay> {
        let lamps = self.lights.iter().filter(|l| matches!(l, Light::Near { .. })).count();
        let chosen = (choice.x * lamps as f64) as usize;
        let far = self.lights.iter().filter_map(move |l| match l {
            Light::Far { towards, light } => {
                let (tangent, bitangent) = towards.any_orthonormal_pair();
                let at = disc(spread) * SUN_RADIUS;
                let direction = (*towards + tangent * at.x + bitangent * at.y).normalize();
                Some(LightRay { direction, distance: self.reach, light: *light })
            }
            Light::Near { .. } => None,
        });
        let near =
            self.lights.iter().filter(|l| matches!(l, Light::Near { .. })).nth(chosen.min(lamps.max(1) - 1));
        far.chain(near.and_then(move |l| l.from(point, lamps as f64)))
    }
}

impl Light {
    /// Light of a lamp at a point, times the number of lamps among which it was chosen.
    fn from(&self, point: DVec3, lamps: f64) -> Option<LightRay> {
        let Light::Near { place, light, range, cone } = self else { return None };
        let (direction, distance) = (*place - point).normalize_and_length();
        if distance == 0.0 || distance > *range {
            return None;
        }
        let spot = cone.as_ref().map_or(1.0, |cone| {
            let part = (-direction.dot(cone.axis) - cone.outer) / (cone.inner - cone.outer);
            part.clamp(0.0, 1.0).powi(2)
        });
        let window = (1.0 - (distance / range).powi(4)).max(0.0);
        let scale = lamps * spot * window / (distance * distance);
        (scale > 0.0).then(|| LightRay {
            direction,
            distance: distance * 0.999,
            light: *light * scale as f32,
        })
    }
}
