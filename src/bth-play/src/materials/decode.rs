//! Decodes image files, with limits.

use super::texels::Texels;
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Greatest number of texels of an image: 8,192 by 8,192, as the compiler keeps them.
const MAX_TEXELS: u64 = 1 << 26;
/// Greatest memory of a decoder, bytes.
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
