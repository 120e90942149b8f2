//! How a surface scatters light: a matte part, and the gloss of glTF's metallic-roughness model
//! (glTF 2.0, appendix B) with the microfacets of GGX. Light that the single bounce of that model
//! loses between facets is given back (Turquin, "Practical multiple scattering compensation for
//! microfacet models", 2019), and the matte part gets what the gloss lets pass. So a white surface
//! reflects all light, and none reflects more.

use crate::sampling::{Sampler, cosine_hemisphere};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

/// Reflectance of what is no metal, seen along the normal.
const DIELECTRIC: f32 = 0.04;
/// Smallest roughness: below it the highlights of lights are too small for samples to find.
const SMOOTHEST: f64 = 0.06;
/// Smallest cosine between the normal and the direction to the viewer.
const GRAZING: f64 = 0.02;
/// Smallest share of the matte part, relative to all light, so that it can be divided by.
const BLACK: f32 = 1e-4;

/// A surface as it is seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bsdf {
    /// Columns: tangent, bitangent and normal.
    frame: DMat3,
    /// Unit, to the viewer, in the frame.
    to_viewer: DVec3,
    matte: Vec3,
    gloss: Option<Gloss>,
}

#[derive(Clone, Copy, Debug)]
struct Gloss {
    /// Width of the distribution of normals.
    alpha: f64,
    /// Reflectance along the normal.
    f0: Vec3,
    /// Factor for the light that is scattered more than once.
    more: Vec3,
    /// The share of light that is reflected towards the viewer.
    albedo: Vec3,
    /// Probability with which directions of the gloss are chosen.
    chance: f64,
}

impl Bsdf {
    /// A surface with a base colour; `gloss` is how metallic and how rough it is. `normal` and
    /// `to_viewer` are unit.
    pub(super) fn new(normal: DVec3, to_viewer: DVec3, base: Vec3, gloss: Option<[f32; 2]>) -> Self {
        // A normal that is turned away from the viewer is bent back.
        let lacks = (GRAZING - normal.dot(to_viewer)).max(0.0);
        let normal = (normal + to_viewer * lacks).normalize();
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let frame = DMat3::from_cols(tangent, bitangent, normal);
        let to_viewer = frame.transpose() * to_viewer;
        let gloss = gloss.map(|[metallic, roughness]| {
            let alpha = f64::from(roughness).max(SMOOTHEST).powi(2);
            let f0 = Vec3::splat(DIELECTRIC).lerp(base, metallic);
            let [scale, bias] = REFLECTED.at(to_viewer.z, alpha.sqrt());
            let more = Vec3::ONE + f0 * (1.0 / (scale + bias) - 1.0);
            let albedo = (f0 * scale + bias) * more;
            let matte = base.max_element() * (1.0 - metallic) * (1.0 - albedo.max_element());
            let chance = f64::from(albedo.max_element() / (albedo.max_element() + matte.max(BLACK)));
            (Gloss { alpha, f0, more, albedo, chance: chance.clamp(0.1, 1.0) }, metallic)
        });
        let matte =
            gloss.map_or(base, |(gloss, metallic)| base * (1.0 - metallic) * (Vec3::ONE - gloss.albedo));
        Self { frame, to_viewer, matte: matte.max(Vec3::ZERO), gloss: gloss.map(|(gloss, _)| gloss) }
    }

    /// The normal, on the side of the viewer.
    pub(super) fn normal(&self) -> DVec3 {
        self.frame.z_axis
    }

    /// The share of light that is scattered towards the viewer.
    pub(super) fn albedo(&self) -> Vec3 {
        self.matte + self.gloss.map_or(Vec3::ZERO, |gloss| gloss.albedo)
    }

    /// The share of light that is reflected by the gloss alone.
    pub(super) fn gloss_albedo(&self) -> Vec3 {
        self.gloss.map_or(Vec3::ZERO, |gloss| gloss.albedo)
    }

    /// The share of light that is scattered by the matte part alone.
    pub(super) fn matte_albedo(&self) -> Vec3 {
        self.matte
    }

    /// For a unit direction to a light: π times the scattered share of its radiance, with the
    /// cosine, and the density of [`Self::sample`]. Zeros below the surface.
    pub(super) fn scattered(&self, direction: DVec3) -> (Vec3, f64) {
        let to_light = self.frame.transpose() * direction;
        if to_light.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (matte, density) = (self.matte * to_light.z as f32, to_light.z / PI);
        let Some(gloss) = &self.gloss else { return (matte, density) };
        let half = (to_light + self.to_viewer).normalize();
        let facets = PI * facets(half.z, gloss.alpha);
        let [seen, lit] = [self.to_viewer.z, to_light.z].map(|cosine| hidden(cosine, gloss.alpha));
        let shape = facets / (4.0 * self.to_viewer.z);
        let fresnel = schlick(gloss.f0, self.to_viewer.dot(half)) * gloss.more;
        let of_gloss = shape / (1.0 + seen) / PI;
        let value = matte + fresnel * (shape / (1.0 + seen + lit)) as f32;
        (value, density * (1.0 - gloss.chance) + of_gloss * gloss.chance)
    }

    /// A direction for a point of the unit square, and the weight of light from there.
    pub(super) fn sample(&self, point: DVec2) -> Option<(DVec3, Vec3)> {
        let to_light = match &self.gloss {
            Some(gloss) if point.x < gloss.chance => {
                let point = DVec2::new(point.x / gloss.chance, point.y);
                let half = visible_facet(self.to_viewer, gloss.alpha, point);
                half * (2.0 * half.dot(self.to_viewer)) - self.to_viewer
            }
            Some(gloss) => {
                let point = DVec2::new((point.x - gloss.chance) / (1.0 - gloss.chance), point.y);
                cosine_hemisphere(DVec3::Z, point)
            }
            None => return Some((self.frame * cosine_hemisphere(DVec3::Z, point), self.matte)),
        };
        let direction = (self.frame * to_light).normalize();
        let (value, density) = self.scattered(direction);
        (density > 0.0).then(|| (direction, value * (1.0 / (PI * density)) as f32))
    }
}

/// Schlick's approximation of Fresnel's reflectance.
fn schlick(f0: Vec3, cosine: f64) -> Vec3 {
    f0 + (Vec3::ONE - f0) * (1.0 - cosine.clamp(0.0, 1.0)).powi(5) as f32
}

/// Density of facets with an angle to the normal (Trowbridge and Reitz, called GGX).
fn facets(cosine: f64, alpha: f64) -> f64 {
    let spread = cosine * cosine * (alpha * alpha - 1.0) + 1.0;
    alpha * alpha / (PI * spread * spread)
}

/// Smith's Λ: how much facets hide each other.
fn hidden(cosine: f64, alpha: f64) -> f64 {
    let tangent = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    ((1.0 + alpha * alpha * tangent).sqrt() - 1.0) / 2.0
}

/// The normal of a facet that the viewer sees (Dupuy and Benyoub, "Sampling visible GGX normals
/// with spherical caps", 2023).
fn visible_facet(to_viewer: DVec3, alpha: f64, point: DVec2) -> DVec3 {
    let stretch = |v: DVec3| DVec3::new(v.x * alpha, v.y * alpha, v.z).normalize();
    let viewer = stretch(to_viewer);
    let z = (1.0 - point.x) * (1.0 + viewer.z) - viewer.z;
    let across = DVec2::from_angle(TAU * point.y) * (1.0 - z * z).max(0.0).sqrt();
    stretch(across.extend(z) + viewer)
}

/// How much light GGX reflects by single bounces, for cosines and roughnesses from 0 to 1.
struct Reflected([[[f32; 2]; SIZE]; SIZE]);

const SIZE: usize = 24;
static REFLECTED: LazyLock<Reflected> = LazyLock::new(Reflected::new);

impl Reflected {
    fn new() -> Self {
        const SAMPLES: u32 = 512;
        let sampler = Sampler::new(0, 0);
        let mean = |cosine: f64, roughness: f64| {
            let (cosine, alpha) = (cosine.max(GRAZING / 2.0), roughness.max(SMOOTHEST).powi(2));
            let viewer = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let mut sums = [0.0; 2];
            for index in 0..SAMPLES {
                let half = visible_facet(viewer, alpha, sampler.point(0, index));
                let light = half * (2.0 * half.dot(viewer)) - viewer;
                if light.z > 0.0 {
                    let [seen, lit] = [cosine, light.z].map(|cosine| hidden(cosine, alpha));
                    let share = (1.0 + seen) / (1.0 + seen + lit);
                    let grazing = (1.0 - half.dot(viewer)).clamp(0.0, 1.0).powi(5);
                    sums[0] += share * (1.0 - grazing);
                    sums[1] += share * grazing;
                }
            }
            sums.map(|sum| (sum / f64::from(SAMPLES)) as f32)
        };
        let at = |row: usize| row as f64 / (SIZE - 1) as f64;
        // Rows are closer together at grazing angles, where more changes.
        Self(std::array::from_fn(|i| std::array::from_fn(|j| mean(at(i).powi(2), at(j)))))
    }

    /// The factor of the reflectance along the normal, and what is added to it.
    fn at(&self, cosine: f64, roughness: f64) -> [f32; 2] {
        let place = |x: f64| {
            let x = x.clamp(0.0, 1.0) * (SIZE - 1) as f64;
            let row = (x as usize).min(SIZE - 2);
            (row, (x - row as f64) as f32)
        };
        let ((i, s), (j, t)) = (place(cosine.max(0.0).sqrt()), place(roughness));
        std::array::from_fn(|k| {
            let row = |i: usize| self.0[i][j][k] * (1.0 - t) + self.0[i][j + 1][k] * t;
            row(i) * (1.0 - s) + row(i + 1) * s
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWS: [f64; 5] = [0.1, 0.3, 0.6, 0.9, 1.0];

    fn each(mut check: impl FnMut(Bsdf, String)) {
        for cosine in VIEWS {
            for roughness in [0.0, 0.1, 0.3, 0.5, 0.8, 1.0] {
                for metallic in [0.0, 0.5, 1.0] {
                    let viewer = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                    let bsdf = Bsdf::new(DVec3::Z, viewer, Vec3::ONE, Some([metallic, roughness]));
                    check(bsdf, format!("cosine {cosine}, roughness {roughness}, metallic {metallic}"));
                }
            }
        }
    }

    /// The white furnace: light of 1 from everywhere comes back whole from white paint and from
    /// white metal, and at most whole from what lies between.
    #[test]
    fn a_white_surface_reflects_all_light_and_no_more() {
        let sampler = Sampler::new(5, 6);
        each(|bsdf, what| {
            let count = 1 << 13;
            let weight = |index| bsdf.sample(sampler.point(0, index)).map_or(0.0, |(_, w)| w.x);
            let mean = (0..count).map(weight).sum::<f32>() / count as f32;
            let least = if what.ends_with("0.5") { 0.5 } else { 0.96 };
            assert!((least..1.015).contains(&mean), "{what}: {mean}");
            assert!((bsdf.albedo().x - mean).abs() < 0.04, "{what}: {mean}");
        });
    }

    /// Densities over the sphere sum up to 1, and what they choose is what `scattered` says.
    #[test]
    fn densities_are_those_of_samples() {
        each(|bsdf, what| {
            if bsdf.gloss.is_some_and(|gloss| gloss.alpha < 0.2) {
                return;
            }
            let directions = crate::sampling::fibonacci_sphere(20_000);
            let sum: f64 = directions.map(|d| bsdf.scattered(d).1).sum();
            let mean = sum * 4.0 * PI / 20_000.0;
            // Directions of the gloss that lead below the surface have none.
            assert!((0.5..1.01).contains(&mean), "{what}: {mean}");
        });
    }
}
