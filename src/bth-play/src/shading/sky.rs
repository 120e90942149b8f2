//! A clear sky with a sun: Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight"
//! (1999). The sun is a disc in the sky, so that rays find it and light is sampled there, too.

use super::surface::GROUND;
use crate::color::luminance;
use crate::environment::EnvironmentSample;
use crate::sampling::fibonacci_sphere;
use glam::{DVec2, DVec3, Mat3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Haze: 2 is clear air, 6 is hazy.
const TURBIDITY: f64 = 2.6;
/// Mean luminance of the upper half of the sky, and the irradiance of the sun over π. They are
/// closer together than in nature, so that shadows are not black.
const SKY: f64 = 0.55;
const SUN: f64 = 2.0;
/// Cosine of half the angle under which the sun is seen: four times the real one, for softer
/// shadows.
const SUN_COSINE: f64 = 0.999_8;
/// The sky, and the sun in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sky {
    vertical: DVec3,
    /// Unit, towards the sun.
    towards: DVec3,
    /// Radiance of the disc of the sun; zero where lights of the scene take its place.
    sun: Vec3,
    /// Radiance in the middle of the disc of the sun, with the air in front of it.
    middle: Vec3,
    /// Radiance of the earth below the horizon, which reflects as the ground does.
    earth: Vec3,
    /// For luminance Y and chromaticities x and y: the value at the zenith over the distribution
    /// there, and the coefficients A to E of the distribution.
    channels: [(f64, [f64; 5]); 3],
}

/// The distribution F of the paper, for the cosine of the angle to the zenith, and the angle to the
/// sun with its cosine.
fn distribution([a, b, c, d, e]: [f64; 5], cosine: f64, (angle, of_sun): (f64, f64)) -> f64 {
    (1.0 + a * (b / cosine).exp()) * (1.0 + c * (d * angle).exp() + e * of_sun * of_sun)
}

impl Sky {
    /// The sky around a vertical with the sun in a unit direction, or as low as the model allows.
    /// `has_sun` is true if the disc of the sun itself shines.
    pub(crate) fn new(vertical: DVec3, towards: DVec3, has_sun: bool) -> Self {
        let t = TURBIDITY;
        let angle = towards.dot(vertical).clamp(-1.0, 1.0).acos().min(FRAC_PI_2 * 0.94);
        let powers = [angle.powi(3), angle.powi(2), angle, 1.0];
        let dot = |row: [f64; 4]| row.iter().zip(powers).map(|(a, b)| a * b).sum::<f64>();
        let chromaticity = |rows: [[f64; 4]; 3]| t * t * dot(rows[0]) + t * dot(rows[1]) + dot(rows[2]);
        let zenith = [
            (4.0453 * t - 4.9710) * ((4.0 / 9.0 - t / 120.0) * (PI - 2.0 * angle)).tan() - 0.2155 * t
                + 2.4192,
            chromaticity([
                [0.001_66, -0.003_75, 0.002_09, 0.0],
                [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
                [0.116_93, -0.211_96, 0.060_52, 0.258_86],
            ]),
            chromaticity([
                [0.002_75, -0.006_10, 0.003_17, 0.0],
                [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
                [0.153_46, -0.267_56, 0.066_70, 0.266_88],
            ]),
        ];
        let shapes = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let channel = |k: usize| (zenith[k] / distribution(shapes[k], 1.0, (angle, angle.cos())), shapes[k]);
        let channels = [channel(0), channel(1), channel(2)];
        let (sun, middle, earth) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let mut sky = Self { vertical, towards, sun, middle, earth, channels };
        let above = || fibonacci_sphere(512).filter(|d| d.dot(vertical) > 0.0);
        let mean = above().map(|d| luminance(sky.air(d))).sum::<f64>() / above().count() as f64;
        sky.channels[0].0 *= SKY / mean;
        let color = sunlight(angle);
        sky.earth = GROUND * (SKY + SUN * angle.cos()) as f32;
        if has_sun {
            let radiance = SUN * PI / (TAU * (1.0 - SUN_COSINE));
            sky.sun = color * (radiance / luminance(color)) as f32;
            sky.middle = sky.radiance(towards);
        }
        sky
    }

    /// Radiance of the air in a unit direction above the horizon.
    fn air(&self, direction: DVec3) -> Vec3 {
        let cosine = direction.dot(self.vertical).max(0.02);
        let of_sun = direction.dot(self.towards).clamp(-1.0, 1.0);
        let sun = (of_sun.acos(), of_sun);
        let [big, x, y] = self.channels.map(|(scale, shape)| scale * distribution(shape, cosine, sun));
        // From Yxy to XYZ to linear sRGB (IEC 61966-2-1).
        let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y) * big;
        let to_rgb = Mat3::from_cols_array_2d(&[
            [3.2406, -0.9689, 0.0557],
            [-1.5372, 1.8758, -0.2040],
            [-0.4986, 0.0415, 1.0570],
        ]);
        (to_rgb * xyz.as_vec3()).max(Vec3::ZERO)
    }

    /// Radiance of sky and sun in a unit direction; below the horizon of the earth, in haze.
    pub(crate) fn radiance(&self, direction: DVec3) -> Vec3 {
        let height = direction.dot(self.vertical);
        let sun = if self.sees_sun(direction) { self.sun } else { Vec3::ZERO };
        let air = self.air(direction) + sun;
        if height < 0.0 { air.lerp(self.earth, (-height * 5.0).min(1.0) as f32) } else { air }
    }

    fn sees_sun(&self, direction: DVec3) -> bool {
        self.sun != Vec3::ZERO && direction.dot(self.towards) >= SUN_COSINE
    }

    /// A direction to the sun for a point of the unit square; `None` without a sun.
    pub(crate) fn sample(&self, point: DVec2) -> Option<EnvironmentSample> {
        if self.sun == Vec3::ZERO {
            return None;
        }
        let cosine = 1.0 - point.x * (1.0 - SUN_COSINE);
        let across = DVec2::from_angle(TAU * point.y) * (1.0 - cosine * cosine).max(0.0).sqrt();
        let (tangent, bitangent) = self.towards.any_orthonormal_pair();
        let direction = (tangent * across.x + bitangent * across.y + self.towards * cosine).normalize();
        let density = self.density(direction);
        // The air differs by millionths of the sun within its disc.
        (density > 0.0).then_some(EnvironmentSample { direction, radiance: self.middle, density })
    }

    /// Density of [`Self::sample`] in a unit direction, with regard to solid angle.
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        if self.sees_sun(direction) { 1.0 / (TAU * (1.0 - SUN_COSINE)) } else { 0.0 }
    }
}

/// The colour of the sun at an angle from the zenith: what air molecules and haze let pass of white
/// light at 650, 550 and 450 nm (equations of the paper's appendix).
fn sunlight(angle: f64) -> Vec3 {
    let mass = 1.0 / (angle.cos() + 0.15 * (93.885 - angle.to_degrees()).powf(-1.253));
    let haze = 0.046_08 * TURBIDITY - 0.045_86;
    let passes = |wave: f64| (-(0.008_735 * wave.powf(-4.08) + haze * wave.powf(-1.3)) * mass).exp();
    DVec3::new(passes(0.65), passes(0.55), passes(0.45)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    #[test]
    fn the_sky_is_blue_brightest_at_the_sun_and_as_bright_as_it_says() {
        let towards = DVec3::new(0.6, 0.7, 0.4).normalize();
        let sky = Sky::new(DVec3::Y, towards, true);
        let zenith = sky.radiance(DVec3::Y);
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        let (near, far) = (DVec3::new(0.6, 0.7, 0.5).normalize(), DVec3::new(-0.6, 0.7, -0.4).normalize());
        assert!(luminance(sky.radiance(near)) > 1.3 * luminance(sky.radiance(far)));
        let above = || fibonacci_sphere(20_000).filter(|d| d.y > 0.0);
        let mean = above().map(|d| luminance(sky.air(d))).sum::<f64>() / above().count() as f64;
        assert!((mean - SKY).abs() < 0.01 * SKY, "{mean}");
        // From every height of the sun all directions have finite light.
        for angle in 0..=18 {
            let angle = f64::from(angle) * PI / 18.0;
            let sky = Sky::new(DVec3::Y, DVec3::new(angle.sin(), angle.cos(), 0.0), true);
            assert!(fibonacci_sphere(1000).all(|d| sky.radiance(d).is_finite()), "{angle}");
        }
    }

    /// Samples of the sun have the density that they claim, and bring the light that it is said to
    /// have.
    #[test]
    fn samples_of_the_sun_bring_its_light() {
        let towards = DVec3::new(0.3, 0.8, -0.2).normalize();
        let sky = Sky::new(DVec3::Y, towards, true);
        let sampler = Sampler::new(1, 2);
        let light = |index: u32| {
            let sample = sky.sample(sampler.point(0, index)).unwrap();
            luminance(sample.radiance - sky.air(sample.direction)) / sample.density
        };
        let mean = (0..1000).map(light).sum::<f64>() / 1000.0;
        assert!((mean - SUN * PI).abs() < 0.01 * mean, "{mean}");
        let dark = Sky::new(DVec3::Y, towards, false);
        assert!(dark.sample(DVec2::splat(0.5)).is_none() && dark.density(towards) == 0.0);
    }
}
