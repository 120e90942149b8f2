//! Animations in one file: animated PNG, GIF and YUV4MPEG2.

use super::picture::{Picture, set_format, write_atomically};
use super::y4m;
use crate::failure::Failure;
use std::io::Write;
use std::path::{Path, PathBuf};

/// An animation in memory, as the bytes of its file so far.
pub(crate) struct Animation {
    path: PathBuf,
    size: (u32, u32),
    encoder: Encoder,
}

enum Encoder {
    Apng(Box<png::Writer<SharedBytes>>, SharedBytes),
    /// With the duration of a frame in hundredths of a second.
    Gif(Box<gif::Encoder<Vec<u8>>>, u16),
    Y4m(Box<y4m::Y4mEncoder<Vec<u8>>>),
}

/// Bytes shared with the PNG writer, which does not return the output that it was given.
#[derive(Clone, Default)]
struct SharedBytes(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

impl Write for SharedBytes {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Animation {
    /// An animation of `frames` pictures at `rate` frames per second; the extension of the path chooses the format. `None`
    /// for other extensions.
    ///
    /// # Errors
    /// If the format cannot hold pictures of this size.
    pub(super) fn new(
        path: &Path,
        size: (u32, u32),
        frames: usize,
        rate: f64,
    ) -> Result<Option<Self>, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let encoder = match extension.as_deref() {
            Some("apng") => apng(size, frames, rate).map_err(|e| failed(path, &e))?,
            Some("gif") => gif(path, size, rate)?,
            Some("y4m") => Encoder::Y4m(Box::new(y4m::Y4mEncoder::new(Vec::new(), size, rate)?)),
            _ => return Ok(None),
        };
        Ok(Some(Animation { path: path.into(), size, encoder }))
    }

    /// Adds the next frame.
    pub(super) fn add(&mut self, picture: &Picture) -> Result<(), Failure> {
        let result = match &mut self.encoder {
            Encoder::Apng(writer, _) => {
                writer.write_image_data(picture.pixels.as_flattened()).map_err(|e| e.to_string())
            }
            Encoder::Gif(encoder, delay) => {
                let (width, height) = (self.size.0 as u16, self.size.1 as u16);
                let mut frame = gif::Frame::from_rgb_speed(width, height, picture.pixels.as_flattened(), 10);
                frame.delay = *delay;
                encoder.write_frame(&frame).map_err(|e| e.to_string())
            }
            Encoder::Y4m(encoder) => encoder.add(picture).map_err(|e| e.to_string()),
        };
        result.map_err(|e| failed(&self.path, &e))
    }

    /// Writes the file.
    pub(super) fn finish(self) -> Result<(), Failure> {
        let path = self.path;
        let bytes = match self.encoder {
            Encoder::Apng(writer, bytes) => {
                writer.finish().map_err(|e| failed(&path, &e))?;
                bytes.0.take()
            }
            Encoder::Gif(encoder, _) => encoder.into_inner().map_err(|e| failed(&path, &e))?,
            Encoder::Y4m(encoder) => encoder.finish()?,
        };
        write_atomically(&path, &bytes)
    }
}

fn failed(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::File { path: path.into(), message: error.to_string() }
}

fn apng(size: (u32, u32), frames: usize, rate: f64) -> Result<Encoder, png::EncodingError> {
    let bytes = SharedBytes::default();
    let mut encoder = png::Encoder::new(bytes.clone(), size.0, size.1);
    set_format(&mut encoder);
    encoder.set_animated(frames as u32, 0)?;
    let (numerator, denominator) = frame_delay(rate, 1000);
    encoder.set_frame_delay(numerator, denominator)?;
    Ok(Encoder::Apng(Box::new(encoder.write_header()?), bytes))
}

fn gif(path: &Path, size: (u32, u32), rate: f64) -> Result<Encoder, Failure> {
    let (Ok(width), Ok(height)) = (u16::try_from(size.0), u16::try_from(size.1)) else {
        return Err(Failure::Usage("GIF pictures have at most 65535 pixels a side".to_owned()));
    };
    let mut encoder = gif::Encoder::new(Vec::new(), width, height, &[]).map_err(|e| failed(path, &e))?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| failed(path, &e))?;
    Ok(Encoder::Gif(Box::new(encoder), frame_delay(rate, 100).0))
}

/// The duration of a frame as a fraction of a second with the denominator `parts`; the numerator is at least 1.
fn frame_delay(rate: f64, parts: u16) -> (u16, u16) {
    ((f64::from(parts) / rate).round().clamp(1.0, f64::from(u16::MAX)) as u16, parts)
}
