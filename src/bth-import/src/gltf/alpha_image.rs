//! The alpha channel of PNG, JPEG and WebP images.

use std::io::Cursor;

use crate::cutout::AlphaImage;
use crate::image_file::{MAX_TEXELS, Refused, check_size};

/// The largest ratio to which deflate expands bytes (RFC 1951: 258 bytes from two bits), rounded
/// up.
const DEFLATE_RATIO: u64 = 1040;

/// Bytes of a texel that decoders write.
const RGBA: usize = 4;

/// Result of decoding an image.
type Decoded<T> = std::result::Result<T, Refused>;

/// Returns the alpha channel of an image file; `None` where it has none: alpha is 1 everywhere.
///
/// # Errors
/// When the image is malformed, too large or of another format.
pub(super) fn decode(bytes: &[u8]) -> Decoded<Option<AlphaImage>> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        return png(bytes);
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        // JPEG has no alpha channel, so nothing of it is read.
        return Ok(None);
    }
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return webp(bytes);
    }
    Err(Refused::Malformed("expected a PNG, JPEG or WebP image, found something else".to_owned()))
}

/// Reads 16-bit channels at 8 bits, palettes and transparent colours as the alpha that they mean.
fn png(bytes: &[u8]) -> Decoded<Option<AlphaImage>> {
    let malformed = |e: png::DecodingError| Refused::Malformed(format!("malformed PNG: {e}"));
    let limits = png::Limits { bytes: MAX_TEXELS as usize * RGBA };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info().map_err(malformed)?;
    let (width, height) = reader.info().size();
    let texels = check_size(width as usize, height as usize)?;
    let bits = reader.info().color_type.samples() as u64 * reader.info().bit_depth as u64;
    if texels * bits / 8 > DEFLATE_RATIO * bytes.len() as u64 {
        return Err(Refused::Malformed(format!("malformed PNG: cut off, {} bytes", bytes.len())));
    }
    let channels = match reader.output_color_type().0 {
        png::ColorType::GrayscaleAlpha => 2,
        png::ColorType::Rgba => RGBA,
        _ => return Ok(None),
    };
    let mut decoded = vec![0; texels as usize * channels];
    reader.next_frame(&mut decoded).map_err(malformed)?;
    let alpha = decoded.chunks_exact(channels).map(|texel| texel[channels - 1]).collect();
    Ok(Some(AlphaImage { width, height, alpha }))
}

/// Reads the first frame of an animation.
fn webp(bytes: &[u8]) -> Decoded<Option<AlphaImage>> {
    let malformed = |e: image_webp::DecodingError| Refused::Malformed(format!("malformed WebP: {e}"));
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(malformed)?;
    decoder.set_memory_limit(MAX_TEXELS as usize * RGBA);
    let (width, height) = decoder.dimensions();
    let texels = check_size(width as usize, height as usize)?;
    if !decoder.has_alpha() {
        return Ok(None);
    }
    let mut decoded = vec![0; texels as usize * RGBA];
    decoder.read_image(&mut decoded).map_err(malformed)?;
    let alpha = decoded.chunks_exact(RGBA).map(|texel| texel[RGBA - 1]).collect();
    Ok(Some(AlphaImage { width, height, alpha }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(color: png::ColorType, depth: png::BitDepth, size: [u32; 2], data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == png::ColorType::Indexed {
            encoder.set_palette(vec![1, 2, 3, 4, 5, 6]);
            encoder.set_trns(vec![9, 200]);
        }
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    }

    #[test]
    fn alpha_is_found_in_every_kind_of_png() {
        use png::{BitDepth, ColorType};
        let alpha = |bytes: &[u8]| decode(bytes).unwrap().map(|image| image.alpha);
        let rgba = encoded(ColorType::Rgba, BitDepth::Eight, [2, 1], &[1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(alpha(&rgba), Some(vec![4, 8]));
        let deep = encoded(ColorType::GrayscaleAlpha, BitDepth::Sixteen, [1, 2], &[1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(alpha(&deep), Some(vec![3, 7]));
        let palette = encoded(ColorType::Indexed, BitDepth::One, [3, 1], &[0b0100_0000]);
        assert_eq!(alpha(&palette), Some(vec![9, 200, 9]));
        assert_eq!(alpha(&encoded(ColorType::Rgb, BitDepth::Eight, [1, 1], &[1, 2, 3])), None);
        assert_eq!(alpha(b"\xff\xd8\xff whatever"), None);
    }

    #[test]
    fn hostile_images_are_errors() {
        use png::{BitDepth, ColorType};
        let good = encoded(ColorType::Rgba, BitDepth::Eight, [16, 16], &[7; 1024]);
        for end in 0..good.len() - 12 {
            assert!(decode(&good[..end]).is_err(), "{end} bytes");
        }
        // A header that claims 2^31 - 1 by 2^31 - 1 texels, and one of 8,192 by 8,192 in some dozen
        // bytes.
        let mut huge = good.clone();
        huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(decode(&huge).is_err());
        assert!(matches!(check_size(8193, 8193), Err(Refused::TooLarge(_))));
        for bytes in [&b""[..], b"RIFF\0\0\0\0WEBP", b"RIFF\0\0\0\0WEBPVP8L", b"\xabKTX 20\xbb\r\n\x1a\n"] {
            assert!(decode(bytes).is_err());
        }
    }

    /// Seeded changes of a valid image: whatever they make is an image or an error.
    #[test]
    fn changed_bytes_never_panic() {
        use png::{BitDepth, ColorType};
        let good = encoded(ColorType::Rgba, BitDepth::Eight, [9, 5], &[77; 180]);
        let mut random = bth_random::Rng::new(16);
        for _ in 0..2000 {
            let mut bytes = good.clone();
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << random.below(8);
            let _ = decode(&bytes);
        }
    }
}
