//! A small picture, and how far two of them are apart.

use crate::model::{Model, position};
use crate::rays::{self, Finder, LIFT};
use crate::tracer::{Batch, Tracer};
use bth::rays::{Hit, Ray};
use glam::DVec3;

/// The camera's rays in tiles of 4×4 pixels, and the light.
pub struct PictureSetup {
    rays: Vec<Ray>,
    size: (u32, u32),
    light: DVec3,
    diagonal: f64,
}

/// Brightness of pixels, 0 to 1, by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: usize,
    values: Vec<f64>,
}

/// Brightness of the sky.
const SKY: f64 = 1.0;
/// Squares along the diagonal of the model: errors of t show in this pattern.
const SQUARES: f64 = 150.0;

impl PictureSetup {
    /// The view of the `primary` rays, in so many pixels, multiples of 4.
    pub fn new(finder: &Finder<'_>, model: &Model, size: (u32, u32)) -> PictureSetup {
        let options = rays::Options { size, most: usize::MAX, view: None };
        let (_, [rays, _]) = rays::cameras(finder, &options);
        let bounds = model.bounds();
        let eye = position(rays[0].origin);
        // Besides the camera, so that there are shadows both in rooms and around objects.
        let light = eye + DVec3::new(0.05, 0.21, -0.13) * bounds.diagonal();
        PictureSetup { rays, size, light, diagonal: bounds.diagonal() }
    }

    /// Draws with Lambert's law, a shadow and squares of two shades. What is visible, where it is, and whether it is lit are
    /// the tracer's answers.
    pub fn draw(&self, model: &Model, tracer: &dyn Tracer) -> Picture {
        let mut hits = vec![Hit::MISS; self.rays.len()];
        tracer.nearest(Batch { rays: &self.rays, starts: None, coherent: true }, &mut hits);
        let lit: Vec<(Ray, f64)> =
            self.rays.iter().zip(&hits).map(|(ray, hit)| self.light_at(model, ray, hit)).collect();
        let to_light: Vec<Ray> = lit.iter().map(|(ray, _)| *ray).collect();
        let mut hidden = vec![false; to_light.len()];
        tracer.any(Batch { rays: &to_light, starts: None, coherent: true }, &mut hidden);

        let (width, height) = (self.size.0 as usize, self.size.1 as usize);
        let mut values = vec![0.0; width * height];
        for (i, ((_, value), hidden)) in lit.iter().zip(hidden).enumerate() {
            let (tile, pixel) = (i / 16, i % 16);
            let (x, y) = (4 * (tile % (width / 4)) + pixel % 4, 4 * (tile / (width / 4)) + pixel / 4);
            values[y * width + x] = if hidden { 0.2 * value } else { *value };
        }
        Picture { width, values }
    }

    /// The shadow ray of a hit and its brightness if it is lit; for a miss a ray that hits nothing and the brightness of the sky.
    fn light_at(&self, model: &Model, ray: &Ray, hit: &Hit) -> (Ray, f64) {
        if !hit.is_hit() {
            return (Ray { tmin: 1.0, tmax: 0.0, ..*ray }, SKY);
        }
        let direction = position(ray.direction);
        let point = position(ray.origin) + direction * f64::from(hit.t);
        let normal = model.normal(hit.primitive.triangle);
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let start = point + normal * (LIFT * self.diagonal);
        let to_light = self.light - start;
        let squares = (point * (SQUARES / self.diagonal)).floor();
        let albedo = if (squares.x + squares.y + squares.z).rem_euclid(2.0) < 1.0 { 0.9 } else { 0.6 };
        let lambert = normal.dot(to_light.normalize_or_zero()).max(0.0);
        let shadow = Ray {
            origin: start.to_array().map(|x| x as f32),
            tmin: 0.0,
            direction: to_light.to_array().map(|x| x as f32),
            tmax: 0.9999,
        };
        (shadow, albedo * (0.15 + 0.85 * lambert))
    }
}

impl Picture {
    /// Root of the mean square of differences.
    pub fn rmse(&self, other: &Picture) -> f64 {
        let squares = self.values.iter().zip(&other.values).map(|(a, b)| (a - b) * (a - b));
        (squares.sum::<f64>() / self.values.len().max(1) as f64).sqrt()
    }

    /// 1 - SSIM (Wang, Bovik, Sheikh and Simoncelli 2004, "Image quality assessment", equation 13), the mean over
    /// uniform windows of 8×8 pixels, 4 apart; 0 for equal pictures.
    pub fn dissimilarity(&self, other: &Picture) -> f64 {
        const WINDOW: usize = 8;
        const C1: f64 = 0.01 * 0.01;
        const C2: f64 = 0.03 * 0.03;
        let height = self.values.len() / self.width;
        let starts = |n: usize| (0..(n + 1).saturating_sub(WINDOW)).step_by(WINDOW / 2);
        let (mut sum, mut windows) = (0.0, 0);
        for (left, top) in starts(height).flat_map(|y| starts(self.width).map(move |x| (x, y))) {
            let [mut a, mut b, mut aa, mut bb, mut ab] = [0.0; 5];
            for i in (top..top + WINDOW).flat_map(|y| (left..left + WINDOW).map(move |x| y * self.width + x))
            {
                let (p, q) = (self.values[i], other.values[i]);
                (a, b, aa, bb, ab) = (a + p, b + q, aa + p * p, bb + q * q, ab + p * q);
            }
            let n = (WINDOW * WINDOW) as f64;
            let (a, b) = (a / n, b / n);
            let (aa, bb, ab) = (aa / n - a * a, bb / n - b * b, ab / n - a * b);
            sum += (2.0 * a * b + C1) * (2.0 * ab + C2) / ((a * a + b * b + C1) * (aa + bb + C2));
            windows += 1;
        }
        if windows == 0 { 0.0 } else { (1.0 - sum / f64::from(windows)).max(0.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(shift: f64) -> Picture {
        let values = (0..32 * 16).map(|i| (f64::from(i % 32) / 32.0 + shift).fract()).collect();
        Picture { width: 32, values }
    }

    #[test]
    fn equal_pictures_do_not_differ_and_others_the_more_the_farther() {
        let (same, near, far) = (ramp(0.0), ramp(0.01), ramp(0.3));
        assert_eq!((same.rmse(&same), same.dissimilarity(&same)), (0.0, 0.0));
        assert!(same.rmse(&near) < same.rmse(&far));
        assert!(0.0 < same.dissimilarity(&near) && same.dissimilarity(&near) < same.dissimilarity(&far));
    }

    #[test]
    fn the_measures_are_those_of_a_worked_example() {
        let plain = |value: f64| Picture { width: 8, values: vec![value; 64] };
        assert!((plain(0.5).rmse(&plain(0.25)) - 0.25).abs() < 1e-15);
        // Without variance only the first factor is left: (2·0.125 + 1e-4) / (0.3125 + 1e-4).
        let expected = 1.0 - 0.2501 / 0.3126;
        assert!((plain(0.5).dissimilarity(&plain(0.25)) - expected).abs() < 1e-12);
    }
}
