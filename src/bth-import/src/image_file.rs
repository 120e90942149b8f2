//! Reads image files and checks their format and size without decoding them.

use crate::error::{Error, Result as ImportResult};
use crate::source::read_at_most;
use imagesize::{ImageError, ImageType};
use std::path::Path;

/// The largest number of texels of an image that is kept: 8,192 by 8,192.
pub(crate) const MAX_TEXELS: u64 = 1 << 26;
/// The largest file of an image or a material library, in bytes.
const MAX_FILE: u64 = 1 << 28;

/// Why an image is not kept.
#[derive(Debug, PartialEq)]
pub(crate) enum Refused {
    /// It is of another format, or malformed.
    Malformed(String),
    /// It has this many texels, more than [`MAX_TEXELS`].
    TooLarge(u64),
}

/// Reads an image or a material library next to a model.
///
/// # Errors
/// `BTH-O001` when it cannot be read or is no regular file, `BTH-L003` for one that is too large.
pub(crate) fn read(path: &Path) -> ImportResult<Vec<u8>> {
    match bth_files::regular_file(path).map(|file| file.len()) {
        Ok(bytes) if bytes > MAX_FILE => Err(Error::Limit {
            code: "BTH-L003",
            message: format!("{} has {bytes} bytes; up to {MAX_FILE} are read", path.display()),
        }),
        _ => read_at_most(path, MAX_FILE),
    }
}

/// Checks by its header that a file is a PNG, JPEG or WebP image of a size that is kept.
pub(crate) fn check(bytes: &[u8]) -> Result<(), Refused> {
    let malformed = |what: &str| Err(Refused::Malformed(what.to_owned()));
    match imagesize::image_type(bytes) {
        Ok(ImageType::Png | ImageType::Jpeg | ImageType::Webp) => {}
        _ => return malformed("expected a PNG, JPEG or WebP image, found something else"),
    }
    match imagesize::blob_size(bytes) {
        Ok(size) => check_size(size.width, size.height).map(|_| ()),
        Err(ImageError::CorruptedImage | ImageError::IoError(_)) => {
            malformed("expected a whole image, found one that is cut off or damaged")
        }
        Err(_) => malformed("expected a PNG, JPEG or WebP image, found something else"),
    }
}

/// Returns the number of texels of an image.
pub(crate) fn check_size(width: usize, height: usize) -> Result<u64, Refused> {
    match width as u64 * height as u64 {
        0 => Err(Refused::Malformed("expected an image with texels, found none".to_owned())),
        texels if texels > MAX_TEXELS => Err(Refused::TooLarge(texels)),
        texels => Ok(texels),
    }
}

/// Returns the error for an image of too many texels.
pub(crate) fn too_large(image: impl std::fmt::Display, texels: u64) -> Error {
    let message = format!("{image} has {texels} texels; up to {MAX_TEXELS} are kept");
    Error::Limit { code: "BTH-L003", message }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR".to_vec();
        bytes.extend(width.to_be_bytes());
        bytes.extend(height.to_be_bytes());
        bytes.extend([8, 6, 0, 0, 0, 0, 0, 0, 0]);
        bytes
    }

    #[test]
    fn formats_and_sizes() {
        assert_eq!(check(&png(8192, 8192)), Ok(()));
        assert_eq!(check(&png(8193, 8192)), Err(Refused::TooLarge(8193 * 8192)));
        assert!(matches!(check(&png(u32::MAX, u32::MAX)), Err(Refused::TooLarge(_))));
        for bad in
            [&b""[..], b"GIF89a\x01\0\x01\0", b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"RIFF\0\0\0\0WEBP"]
        {
            assert!(matches!(check(bad), Err(Refused::Malformed(_))), "{bad:?}");
        }
        assert!(check(&png(0, 3)).is_err());
    }

    #[test]
    fn no_bytes_panic() {
        let mut random = bth_random::Rng::new(11);
        let starts: [&[u8]; 4] =
            [b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0", b"RIFF\x20\0\0\0WEBPVP8X", b"RIFF\x20\0\0\0WEBPVP8 "];
        for round in 0..20_000 {
            let mut bytes = starts[round % 4].to_vec();
            bytes.extend((0..random.below(60)).map(|_| random.below(256) as u8));
            let _ = check(&bytes);
        }
    }
}
