//! Animations in one file: animated PNG, GIF and YUV4MPEG2 (8 bits, 4:4:4, BT.709, limited range).

use super::picture::{Picture, set_format, write_atomically};
use crate::failure::Failure;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// An animation in memory, as the bytes of its file so far.
pub(crate) struct Animation {
    path: PathBuf,
    size: (u32, u32),
    encoder: Encoder,
}

enum Encoder {
    Apng(Box<png::Writer<SharedBytes>>, SharedBytes),
    /// With the number of the next frame and the rate in frames per second.
    Gif(Box<gif::Encoder<Vec<u8>>>, u32, f64),
    Y4m(Box<Y4mEncoder<Vec<u8>>>),
}

/// Bytes shared with the PNG writer, which does not return the output that it was given.
#[derive(Clone, Default)]
struct SharedBytes(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

impl Write for SharedBytes {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Animation {
    /// An animation of `frames` pictures at `rate` frames per second; the extension of the path
    /// chooses the format. `None` for other extensions.
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
            Some("y4m") => Encoder::Y4m(Box::new(Y4mEncoder::new(Vec::new(), size, rate)?)),
            _ => return Ok(None),
        };
        Ok(Some(Animation { path: path.into(), size, encoder }))
    }

    /// Where it is written.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds the next frame.
    pub(super) fn add(&mut self, picture: &Picture) -> Result<(), Failure> {
        let result = match &mut self.encoder {
            Encoder::Apng(writer, _) => {
                writer.write_image_data(picture.pixels.as_flattened()).map_err(|e| e.to_string())
            }
            Encoder::Gif(encoder, number, rate) => {
                let (width, height) = (self.size.0 as u16, self.size.1 as u16);
                let mut frame = gif::Frame::from_rgb_speed(width, height, picture.pixels.as_flattened(), 10);
                frame.delay = gif_delay(*number, *rate);
                *number += 1;
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
            Encoder::Gif(encoder, ..) => encoder.into_inner().map_err(|e| failed(&path, &e))?,
            Encoder::Y4m(encoder) => encoder.finish()?,
        };
        write_atomically(&path, &bytes)
    }
}

fn failed(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::file(path, error)
}

fn apng(size: (u32, u32), frames: usize, rate: f64) -> Result<Encoder, png::EncodingError> {
    let bytes = SharedBytes::default();
    let mut encoder = png::Encoder::new(bytes.clone(), size.0, size.1);
    set_format(&mut encoder);
    encoder.set_animated(frames as u32, 0)?;
    let (numerator, denominator) = apng_delay(rate);
    encoder.set_frame_delay(numerator, denominator)?;
    Ok(Encoder::Apng(Box::new(encoder.write_header()?), bytes))
}

fn gif(path: &Path, size: (u32, u32), rate: f64) -> Result<Encoder, Failure> {
    let (Ok(width), Ok(height)) = (u16::try_from(size.0), u16::try_from(size.1)) else {
        return Err(Failure::Usage("GIF pictures have at most 65535 pixels a side".to_owned()));
    };
    let mut encoder = gif::Encoder::new(Vec::new(), width, height, &[]).map_err(|e| failed(path, &e))?;
    encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| failed(path, &e))?;
    Ok(Encoder::Gif(Box::new(encoder), 0, rate))
}

/// The duration of a frame of a GIF, in hundredths of a second: the difference of the rounded times
/// at which it and the next one begin, so that the animation as a whole is as long as it should be.
/// At least 1.
fn gif_delay(number: u32, rate: f64) -> u16 {
    let begin = |number: u32| (100.0 * f64::from(number) / rate).round();
    (begin(number + 1) - begin(number)).clamp(1.0, f64::from(u16::MAX)) as u16
}

/// The duration of a frame of an animated PNG as a fraction of a second: exact for whole rates,
/// else the nearest one with a large numerator or denominator.
fn apng_delay(rate: f64) -> (u16, u16) {
    let limit = f64::from(u16::MAX);
    if rate.fract() == 0.0 && (1.0..=limit).contains(&rate) {
        return (1, rate as u16);
    }
    let (numerator, denominator) = match rate < 1.0 {
        true => (limit, (limit * rate).round()),
        false => ((limit / rate).round(), limit),
    };
    (numerator.clamp(1.0, limit) as u16, denominator.clamp(1.0, limit) as u16)
}

/// Writes the stream header, then one frame after another.
pub(crate) struct Y4mEncoder<W> {
    out: W,
}

impl<W: Write> Y4mEncoder<W> {
    pub(super) fn new(mut out: W, (width, height): (u32, u32), rate: f64) -> io::Result<Self> {
        // Whole rates are written exactly, others to a thousandth.
        let (rate, over) =
            if rate.fract() == 0.0 { (rate, 1) } else { ((rate * 1000.0).round().max(1.0), 1000) };
        writeln!(out, "YUV4MPEG2 W{width} H{height} F{rate:.0}:{over} Ip A1:1 C444 XCOLORRANGE=LIMITED")?;
        Ok(Self { out })
    }

    pub(super) fn add(&mut self, picture: &Picture) -> io::Result<()> {
        self.out.write_all(b"FRAME\n")?;
        for plane in 0..3 {
            let bytes: Vec<u8> = picture.pixels.iter().map(|p| component(*p, plane)).collect();
            self.out.write_all(&bytes)?;
        }
        Ok(())
    }

    pub(super) fn finish(self) -> io::Result<W> {
        Ok(self.out)
    }
}

/// Y, Cb or Cr of a pixel (ITU-R BT.709).
pub(super) fn component(pixel: [u8; 3], plane: usize) -> u8 {
    let [r, g, b] = pixel.map(|c| f64::from(c) / 255.0);
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let value = match plane {
        0 => 16.0 + 219.0 * y,
        1 => 128.0 + 224.0 * (b - y) / 1.8556,
        _ => 128.0 + 224.0 * (r - y) / 1.5748,
    };
    value.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_is_as_long_as_its_frames() {
        for (rate, frames, hundredths) in
            [(24.0, 24, 100), (30.0, 30, 100), (60.0, 60, 100), (29.97, 300, 1001)]
        {
            let sum: u32 = (0..frames).map(|number| u32::from(gif_delay(number, rate))).sum();
            assert_eq!(sum, hundredths, "{rate}");
        }
        for rate in [24.0, 23.976, 0.3, 1000.0, 1e-3, 65535.0] {
            let (numerator, denominator) = apng_delay(rate);
            let found = f64::from(denominator) / f64::from(numerator);
            assert!((found / rate - 1.0).abs() < 1e-2, "{rate}: {found}");
        }
        assert_eq!(apng_delay(24.0), (1, 24));
        assert_eq!((gif_delay(0, 1e-9), apng_delay(1e-9)), (u16::MAX, (u16::MAX, 1)));
        assert_eq!((gif_delay(0, 1e9), apng_delay(1e9)), (1, (1, u16::MAX)));
    }

    #[test]
    fn white_black_and_the_primaries_have_the_components_of_bt_709() {
        let yuv = |pixel| [0, 1, 2].map(|plane| component(pixel, plane));
        assert_eq!(yuv([255, 255, 255]), [235, 128, 128]);
        assert_eq!(yuv([0, 0, 0]), [16, 128, 128]);
        assert_eq!(yuv([255, 0, 0]), [63, 102, 240]);
        assert_eq!(yuv([0, 0, 255]), [32, 240, 118]);
    }
}
