//! Texels of a decoded image: limits, sRGB to linear, wrap modes, and interpolation.

use bth::Wrap;
use glam::{Vec3, Vec4};
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::sync::LazyLock;

/// A decoded image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Texels {
    /// At least 1.
    pub(super) width: u32,
    /// At least 1.
    pub(super) height: u32,
    /// Red, green, blue (sRGB) and alpha (linear), rows from the top.
    pub(super) rgba: Vec<[u8; 4]>,
}

/// A component from 0 to 1 of a colour in sRGB (IEC 61966-2-1), linear.
pub(super) fn linear(srgb: f32) -> f32 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// The linear values of the bytes of a component.
static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear(byte as f32 / 255.0)));

/// The row of a texel that a wrap mode takes for any number; `size` is at least 1.
fn wrapped(at: i64, size: u32, wrap: Wrap) -> usize {
    let size = i64::from(size);
    let row = match wrap {
        Wrap::Repeat => at.rem_euclid(size),
        Wrap::Clamp => at.clamp(0, size - 1),
        Wrap::Mirror => {
            let twice = at.rem_euclid(2 * size);
            twice.min(2 * size - 1 - twice)
        }
    };
    row as usize
}

impl Texels {
    /// The colour at coordinates of the image, linear. Coordinates that are not finite count as 0.
    pub(super) fn at(&self, coordinates: [f32; 2], wrap: [Wrap; 2], nearest: bool) -> Vec4 {
        self.sampled(coordinates, wrap, nearest, |byte| LINEAR[usize::from(byte)])
    }

    /// The same where red, green and blue are no colour, but linear.
    pub(super) fn data_at(&self, coordinates: [f32; 2], wrap: [Wrap; 2], nearest: bool) -> Vec4 {
        self.sampled(coordinates, wrap, nearest, |byte| f32::from(byte) / 255.0)
    }

    fn sampled(
        &self,
        coordinates: [f32; 2],
        wrap: [Wrap; 2],
        nearest: bool,
        decoded: impl Fn(u8) -> f32,
    ) -> Vec4 {
        let place = |k: usize| {
            let (x, size) = (f64::from(coordinates[k]), f64::from([self.width, self.height][k]));
            // Numbers beyond this have no fraction to interpolate with.
            let x = if x.is_finite() { (x * size).clamp(-1e15, 1e15) } else { 0.0 };
            if nearest {
                (x.floor() as i64, 0.0)
            } else {
                ((x - 0.5).floor() as i64, (x - 0.5).rem_euclid(1.0) as f32)
            }
        };
        let ((i, s), (j, t)) = (place(0), place(1));
        let texel = |i: i64, j: i64| {
            let at = wrapped(j, self.height, wrap[1]) * self.width as usize + wrapped(i, self.width, wrap[0]);
            let [r, g, b, a] = self.rgba[at];
            Vec3::from_array([r, g, b].map(&decoded)).extend(f32::from(a) / 255.0)
        };
        if nearest {
            return texel(i, j);
        }
        let row = |j: i64| texel(i, j).lerp(texel(i + 1, j), s);
        row(j).lerp(row(j + 1), t)
    }
}

/// Largest number of texels of an image: 8,192 by 8,192, as the compiler keeps them.
const MAX_TEXELS: u64 = 1 << 26;
/// Largest memory of a decoder, bytes.
const MAX_MEMORY: u64 = 1 << 30;

/// The texels of a PNG, JPEG or WebP file.
///
/// # Errors
/// What is wrong with the file.
pub(super) fn decode(bytes: &[u8]) -> Result<Texels, String> {
    let format = image::guess_format(bytes).ok();
    let known = format.filter(|f| matches!(f, ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP));
    let Some(format) = known else {
        return Err("expected a PNG, JPEG or WebP image, found something else".to_owned());
    };
    let (width, height) =
        ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(|e| e.to_string())?;
    let texels = u64::from(width) * u64::from(height);
    if texels == 0 || texels > MAX_TEXELS {
        return Err(format!("expected 1 to {MAX_TEXELS} texels, found {texels}"));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_MEMORY);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    let (width, height) = decoded.dimensions();
    Ok(Texels { width, height, rgba: decoded.into_raw().as_chunks::<4>().0.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(bytes: &[u8]) -> Texels {
        let rgba = bytes.iter().map(|b| [*b, *b, *b, *b]).collect();
        Texels { width: bytes.len() as u32, height: 1, rgba }
    }

    /// IEC 61966-2-1: 188 is about half the light; 0 and 255 are the ends; the two pieces of the
    /// curve join.
    #[test]
    fn srgb_is_made_linear_by_its_definition() {
        assert_eq!((LINEAR[0], LINEAR[255]), (0.0, 1.0));
        let exact = |byte: f64| ((byte / 255.0 + 0.055) / 1.055).powf(2.4);
        for byte in 11..256 {
            assert!((f64::from(LINEAR[byte]) - exact(byte as f64)).abs() < 1e-6, "{byte}");
        }
        assert!((LINEAR[10] - 10.0 / 255.0 / 12.92).abs() < 1e-7);
        assert!((LINEAR[188] - 0.5029).abs() < 1e-4);
    }

    #[test]
    fn light_is_interpolated_and_not_its_code() {
        let texels = row(&[0, 255]);
        let half = texels.at([0.5, 0.5], [Wrap::Clamp; 2], false);
        assert_eq!(half, Vec4::splat(0.5));
        assert_eq!(texels.at([0.25, 0.5], [Wrap::Clamp; 2], false), Vec4::ZERO);
        assert_eq!(texels.at([0.4375, 9.0], [Wrap::Repeat; 2], false), Vec4::splat(0.375));
        assert_eq!(texels.at([0.49, 0.5], [Wrap::Clamp; 2], true), Vec4::ZERO);
        assert_eq!(texels.at([0.51, 0.5], [Wrap::Clamp; 2], true), Vec4::ONE);
    }

    #[test]
    fn wrap_modes_continue_the_image() {
        let rows = |wrap| (-5..8).map(|at| wrapped(at, 3, wrap)).collect::<Vec<_>>();
        assert_eq!(rows(Wrap::Repeat), [1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1]);
        assert_eq!(rows(Wrap::Mirror), [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0, 1]);
        assert_eq!(rows(Wrap::Clamp), [0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn any_coordinates_find_a_texel() {
        let texels = row(&[7, 9, 200]);
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, f32::MIN_POSITIVE, -0.0, 1e20] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                for nearest in [false, true] {
                    assert!(texels.at([x, x], [wrap; 2], nearest).is_finite());
                }
            }
        }
    }

    fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.write_header().unwrap().write_image_data(rgba).unwrap();
        bytes
    }

    #[test]
    fn texels_are_those_of_the_file() {
        let bytes = png(2, 1, &[1, 2, 3, 4, 250, 251, 252, 253]);
        let texels = decode(&bytes).unwrap();
        assert_eq!(texels.rgba, [[1, 2, 3, 4], [250, 251, 252, 253]]);
        assert_eq!((texels.width, texels.height), (2, 1));
    }

    #[test]
    fn broken_and_huge_images_are_errors() {
        let good = png(16, 16, &[7; 1024]);
        for end in 0..good.len() - 12 {
            assert!(decode(&good[..end]).is_err(), "{end} bytes");
        }
        let mut huge = good.clone();
        huge[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        assert!(decode(&huge).is_err());
        assert!(decode(b"GIF89a\x01\0\x01\0\0\0\0").unwrap_err().contains("expected a PNG"));
        let mut random = bth_random::Rng::new(5);
        for _ in 0..500 {
            let mut bytes = good.clone();
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << random.below(8);
            let _ = decode(&bytes);
        }
    }
}
