//! Light from all around, given by a picture over longitude and latitude, and sampling of
//! directions by its brightness.

use crate::color::luminance;
use crate::failure::Failure;
use glam::{DVec2, DVec3, Vec3};
use image::{ImageDecoder, ImageReader, Limits};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Pictures are scaled to this mean luminance over all directions, about the built-in sky's.
const MEAN_LUMINANCE: f64 = 0.6;
/// Largest number of texels of a picture.
const MAX_TEXELS: u64 = 1 << 26;
/// Largest size of its file, bytes.
const MAX_FILE: u64 = 1 << 30;

/// A picture of the surroundings. The upper edge is the vertical; the middle column is in the
/// direction of the model's front.
#[derive(Clone, Debug)]
pub(crate) struct Environment {
    width: usize,
    height: usize,
    /// Radiance, rows from the top.
    texels: Vec<Vec3>,
    /// For each row the brightness of its texels, each added to those before it.
    columns: Vec<f64>,
    /// The brightness of rows, times their solid angles, each added to those before it.
    rows: Vec<f64>,
    /// Unit axes: towards the middle of the picture, its left and its upper edge.
    axes: [DVec3; 3],
}

/// A direction that was chosen by brightness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnvironmentSample {
    /// Unit.
    pub(crate) direction: DVec3,
    pub(crate) radiance: Vec3,
    /// Density with regard to solid angle.
    pub(crate) density: f64,
}

impl Environment {
    /// Reads a Radiance file; `front` and `vertical` are unit and orthogonal.
    ///
    /// # Errors
    /// `BTH-P006` if it cannot be read or used.
    pub(crate) fn read(path: &Path, front: DVec3, vertical: DVec3) -> Result<Self, Failure> {
        let wrong = |message: String, exit: u8| Failure::Environment { path: path.into(), message, exit };
        let cannot = |e: std::io::Error| wrong(format!("cannot read: {e}"), 4);
        let size = bth_files::regular_file(path).map_err(cannot)?.len();
        if size > MAX_FILE {
            return Err(wrong(format!("expected at most {MAX_FILE} bytes, found {size}"), 3));
        }
        let bytes = std::fs::read(path).map_err(cannot)?;
        let (width, height, texels) = decoded(&bytes).map_err(|what| wrong(what, 3))?;
        Self::new((width, height), texels, front, vertical).map_err(|what| wrong(what, 3))
    }

    /// The surroundings in a picture of rows from the top.
    fn new(
        (width, height): (usize, usize),
        mut texels: Vec<Vec3>,
        front: DVec3,
        vertical: DVec3,
    ) -> Result<Self, String> {
        if !texels.iter().all(|t| t.is_finite() && t.min_element() >= 0.0) {
            return Err("expected finite colors from 0".to_owned());
        }
        let sines: Vec<f64> =
            (0..height).map(|row| (PI * (row as f64 + 0.5) / height as f64).sin()).collect();
        let weighted = |row: usize| {
            texels[row * width..][..width].iter().map(|t| luminance(*t)).sum::<f64>() * sines[row]
        };
        let mean = (0..height).map(weighted).sum::<f64>() / (width as f64 * sines.iter().sum::<f64>());
        if mean > 0.0 {
            let scale = MEAN_LUMINANCE / mean;
            texels.iter_mut().for_each(|t| *t = (t.as_dvec3() * scale).as_vec3());
        }
        let (mut columns, mut rows, mut total) =
            (Vec::with_capacity(texels.len()), Vec::with_capacity(height), 0.0);
        for row in 0..height {
            let mut sum = 0.0;
            for texel in &texels[row * width..][..width] {
                sum += luminance(*texel);
                columns.push(sum);
            }
            total += sum * sines[row];
            rows.push(total);
        }
        let axes = [front, vertical.cross(front), vertical];
        Ok(Self { width, height, texels, columns, rows, axes })
    }

    /// The texel in a unit direction.
    fn texel_of(&self, direction: DVec3) -> (usize, usize) {
        let [x, y, z] = self.axes.map(|axis| direction.dot(axis));
        let u = 0.5 - y.atan2(x) / TAU;
        let v = z.clamp(-1.0, 1.0).acos() / PI;
        let at = |part: f64, size: usize| ((part * size as f64) as usize).min(size - 1);
        (at(u, self.width), at(v, self.height))
    }

    /// Radiance in a unit direction.
    pub(crate) fn radiance(&self, direction: DVec3) -> Vec3 {
        let (i, j) = self.texel_of(direction);
        self.texels[j * self.width + i]
    }

    /// Density of [`Self::sample`] in a unit direction.
    pub(crate) fn density(&self, direction: DVec3) -> f64 {
        let (i, j) = self.texel_of(direction);
        let total = self.rows[self.height - 1];
        if total <= 0.0 {
            return 0.0;
        }
        // The share of the texel, in which directions are uniform over longitude and latitude.
        let middle = (PI * (j as f64 + 0.5) / self.height as f64).sin();
        let share = luminance(self.texels[j * self.width + i]) * middle / total;
        let [.., z] = self.axes.map(|axis| direction.dot(axis));
        let sine = (1.0 - z * z).max(0.0).sqrt();
        if sine <= 0.0 { 0.0 } else { share * (self.width * self.height) as f64 / (TAU * PI * sine) }
    }

    /// A direction, chosen by brightness, for a point of the unit square; `None` in the dark.
    pub(crate) fn sample(&self, point: DVec2) -> Option<EnvironmentSample> {
        let total = self.rows[self.height - 1];
        if total <= 0.0 {
            return None;
        }
        let (j, v) = chosen(&self.rows, point.y);
        let (i, u) = chosen(&self.columns[j * self.width..][..self.width], point.x);
        let longitude = (0.5 - (i as f64 + u) / self.width as f64) * TAU;
        let latitude = (j as f64 + v) / self.height as f64 * PI;
        let [x, y, z] = self.axes;
        let across = x * longitude.cos() + y * longitude.sin();
        let direction = (across * latitude.sin() + z * latitude.cos()).normalize();
        let density = self.density(direction);
        (density > 0.0).then(|| EnvironmentSample { direction, radiance: self.radiance(direction), density })
    }
}

/// The row that a number from 0 to below 1 chooses by running sums, and how far in it.
fn chosen(sums: &[f64], number: f64) -> (usize, f64) {
    let wanted = number * sums[sums.len() - 1];
    let row = sums.partition_point(|sum| *sum <= wanted).min(sums.len() - 1);
    let before = if row == 0 { 0.0 } else { sums[row - 1] };
    let width = sums[row] - before;
    (row, if width > 0.0 { ((wanted - before) / width).clamp(0.0, 1.0) } else { 0.5 })
}

/// Width, height and linear colours of a Radiance file.
fn decoded(bytes: &[u8]) -> Result<(usize, usize, Vec<Vec3>), String> {
    let reader = image::codecs::hdr::HdrDecoder::new(bytes)
        .map_err(|e| format!("expected a Radiance file (.hdr): {e}"))?;
    let (width, height) = reader.dimensions();
    let texels = u64::from(width) * u64::from(height);
    if texels == 0 || texels > MAX_TEXELS {
        return Err(format!("expected 1 to {MAX_TEXELS} texels, found {texels}"));
    }
    let mut reader = ImageReader::with_format(std::io::Cursor::new(bytes), image::ImageFormat::Hdr);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_TEXELS * 16);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| format!("malformed: {e}"))?.into_rgb32f();
    let texels = picture.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    Ok((width as usize, height as usize, texels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, fibonacci_sphere};

    fn environment(width: usize, height: usize, color: impl Fn(usize, usize) -> f32) -> Environment {
        let texels = (0..width * height).map(|k| Vec3::splat(color(k % width, k / width))).collect();
        Environment::new((width, height), texels, DVec3::Z, DVec3::Y).unwrap()
    }

    #[test]
    fn the_vertical_is_above_and_the_front_in_the_middle() {
        let picture = environment(8, 4, |i, j| (1 + i + 8 * j) as f32);
        let at = |direction: DVec3| picture.texel_of(direction.normalize());
        assert_eq!(at(DVec3::Y).1, 0);
        assert_eq!(at(-DVec3::Y).1, 3);
        assert_eq!(at(DVec3::new(0.01, -0.01, 1.0)), (3, 2));
        assert_eq!(at(DVec3::new(-0.01, 0.01, 1.0)), (4, 1));
        // The picture shows what somebody in the middle sees who turns to the right.
        assert_eq!(at(DVec3::new(-1.0, 0.01, 0.05)).0, 5);
    }

    /// The mean of radiance / density is the integral over all directions; the mean of 1 / density
    /// is their solid angle.
    #[test]
    fn samples_integrate_the_picture() {
        let picture = environment(16, 8, |i, j| if (i, j) == (11, 2) { 900.0 } else { 0.5 + j as f32 });
        let samples = 1 << 15;
        let sampler = Sampler::new(3, 1);
        let (mut light, mut angle) = (0.0, 0.0);
        for index in 0..samples {
            let sample = picture.sample(sampler.point(0, index)).unwrap();
            assert!((sample.direction.length() - 1.0).abs() < 1e-9);
            assert!((picture.density(sample.direction) - sample.density).abs() < 1e-9 * sample.density);
            light += luminance(sample.radiance) / sample.density / f64::from(samples);
            angle += 1.0 / sample.density / f64::from(samples);
        }
        assert!((light - MEAN_LUMINANCE * 4.0 * PI).abs() < 0.02 * light, "{light}");
        assert!((angle - 4.0 * PI).abs() < 0.02 * angle, "{angle}");
        let mean = fibonacci_sphere(100_000).map(|d| luminance(picture.radiance(d))).sum::<f64>() / 1e5;
        assert!((mean - MEAN_LUMINANCE).abs() < 0.02 * mean, "{mean}");
    }

    #[test]
    fn the_dark_has_no_samples_and_bad_files_are_errors() {
        let dark = environment(4, 2, |_, _| 0.0);
        assert!(dark.sample(DVec2::splat(0.3)).is_none() && dark.density(DVec3::X) == 0.0);
        for bytes in
            [&b""[..], b"#?RADIANCE\n\n", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999999 +X 99999999\n"]
        {
            assert!(decoded(bytes).is_err());
        }
    }
}
