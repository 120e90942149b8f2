//! The finished picture and its PNG file.

use crate::failure::Failure;
use crate::interrupt::Part;
use std::io::Write;
use std::path::Path;

/// A picture, sRGB, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Picture {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) pixels: Vec<[u8; 3]>,
}

/// A linear component in sRGB (IEC 61966-2-1); values above 1 are clipped.
pub(super) fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear.max(0.0) * 12.92
    } else {
        1.055 * linear.min(1.0).powf(1.0 / 2.4) - 0.055
    }
}

/// Rounds components from 0 to 1 to 8 bits.
pub(super) fn quantized(color: [f32; 3]) -> [u8; 3] {
    color.map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

impl Picture {
    /// Sets a pixel, if it lies within the picture.
    pub(super) fn set(&mut self, x: u32, y: u32, color: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize] = color;
        }
    }

    /// The part of the picture with this upper left corner and size.
    pub(crate) fn part(self, (left, top): (u32, u32), (width, height): (u32, u32)) -> Picture {
        if (left, top, width, height) == (0, 0, self.width, self.height) {
            return self;
        }
        let rows = (top..top + height).map(|y| (y * self.width + left) as usize);
        let pixels = rows.flat_map(|at| &self.pixels[at..at + width as usize]).copied().collect();
        Picture { width, height, pixels }
    }

    /// Puts another picture into this one, whose upper left corner is at a pixel.
    pub(crate) fn put(&mut self, (left, top): (u32, u32), part: &Picture) {
        for (row, y) in part.pixels.chunks(part.width.max(1) as usize).zip(top..) {
            let at = (y * self.width + left) as usize;
            self.pixels[at..at + row.len()].copy_from_slice(row);
        }
    }

    /// Reads a PNG file that [`Picture::write`] wrote; `None` if it is not there or not whole.
    pub(crate) fn read(path: &Path, size: (u32, u32)) -> Option<Picture> {
        if !is_complete(path, size) {
            return None;
        }
        let file = std::io::BufReader::new(std::fs::File::open(path).ok()?);
        let mut reader = png::Decoder::new(file).read_info().ok()?;
        let mut bytes = vec![0; reader.output_buffer_size()?];
        reader.next_frame(&mut bytes).ok()?;
        let (pixels, _) = bytes.as_chunks::<3>();
        let is_whole = pixels.len() == size.0 as usize * size.1 as usize;
        is_whole.then(|| Picture { width: size.0, height: size.1, pixels: pixels.to_vec() })
    }

    /// The bytes of a PNG file.
    fn encoded(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        set_format(&mut encoder);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Does the same as [`Self::write`] and creates the folder where it is missing.
    pub(crate) fn write_in_folder(&self, path: &Path) -> Result<(), Failure> {
        create_folder(path)?;
        self.write(path)
    }

    /// Writes a PNG file, atomically.
    ///
    /// # Errors
    /// `BTH-P002` if it cannot be written.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let bytes = self.encoded().map_err(|e| Failure::file(path, &e))?;
        write_atomically(path, &bytes)
    }
}

/// Sets the pixel format and color space of a PNG file or animation.
pub(super) fn set_format<W: Write>(encoder: &mut png::Encoder<'_, W>) {
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
}

/// Returns true if a file is a complete PNG file of this size.
pub(super) fn is_complete(path: &Path, (width, height): (u32, u32)) -> bool {
    let Ok(bytes) = std::fs::read(path) else { return false };
    let end = [0, 0, 0, 0, b'I', b'E', b'N', b'D', 0xae, 0x42, 0x60, 0x82];
    let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
    bytes.starts_with(b"\x89PNG\r\n\x1a\n") && bytes.get(16..24) == Some(&size) && bytes.ends_with(&end)
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Creates the folder of a file where it is missing.
///
/// # Errors
/// `BTH-P002` if it cannot be created.
pub(super) fn create_folder(path: &Path) -> Result<(), Failure> {
    let folder = folder_of(path);
    std::fs::create_dir_all(folder).map_err(|e| Failure::file(folder, &e))
}

/// The same as [`create_folder`]; also fails if no file can be written there: before hours of
/// rendering, not after them.
///
/// # Errors
/// `BTH-P002` if it cannot be written.
pub(super) fn prepare_folder(path: &Path) -> Result<(), Failure> {
    create_folder(path)?;
    temporary_in(path).map(drop)
}

/// A temporary file in the folder of a file.
fn temporary_in(path: &Path) -> Result<tempfile::NamedTempFile, Failure> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bth-play-").suffix(".tmp");
    #[cfg(unix)]
    {
        // The permissions of any new file, which the umask reduces; temporary files get fewer by
        // default.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder_of(path)).map_err(|e| cannot_write(path, &e))
}

/// The message has the kind alone where the system gives no number: errors of temporary files name
/// these.
fn cannot_write(path: &Path, error: &std::io::Error) -> Failure {
    let reason = match error.raw_os_error() {
        Some(number) => std::io::Error::from_raw_os_error(number).to_string(),
        None => error.kind().to_string(),
    };
    Failure::file(path, &format!("cannot write: {reason}"))
}

/// Writes a file by renaming a finished temporary one, so that it is never seen in part.
///
/// # Errors
/// `BTH-P002` if it cannot be written.
pub(super) fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut file = temporary_in(path)?;
    let name = file.path().to_owned();
    let _part = Part::new(&name);
    file.write_all(bytes).map_err(|e| cannot_write(path, &e))?;
    file.persist(path).map_err(|e| cannot_write(path, &e.error))?;
    Ok(())
}
