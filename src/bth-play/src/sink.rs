//! Where pictures go: one file, numbered files, an animation, or a stream.

use crate::failure::Failure;
use crate::picture::{self, Picture};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Where the pictures of a sequence go.
pub(crate) enum Sink {
    /// One PNG file.
    One(PathBuf),
    /// A PNG file for each frame.
    Numbered(Pattern),
    /// An animation that is written when all frames are there.
    Animation(Animation),
    /// YUV4MPEG2 on standard output.
    Stream(y4m::Encoder<BufWriter<std::io::Stdout>>),
}

/// A path with a place for the number of the frame.
pub(crate) struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The last run of `#` in a path is the number's place.
    pub(crate) fn new(path: &Path) -> Option<Self> {
        let text = path.to_str()?;
        let end = text.rfind('#')? + 1;
        let start = text[..end].trim_end_matches('#').len();
        Some(Self { before: text[..start].to_owned(), digits: end - start, after: text[end..].to_owned() })
    }

    pub(crate) fn path(&self, frame: i32) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let number = format!("{sign}{:0width$}", frame.unsigned_abs(), width = self.digits);
        PathBuf::from(format!("{}{number}{}", self.before, self.after))
    }
}

/// An animation in memory, as the bytes of its file so far.
pub(crate) struct Animation {
    path: PathBuf,
    size: (u32, u32),
    encoder: Encoder,
}

enum Encoder {
    Apng(Box<png::Writer<Shared>>, Shared),
    Gif(Box<gif::Encoder<Vec<u8>>>, u16),
    Y4m(Box<y4m::Encoder<Vec<u8>>>),
}

/// Bytes that the writer of a PNG file and we both hold, since it does not give them back.
#[derive(Clone, Default)]
pub(crate) struct Shared(std::rc::Rc<std::cell::RefCell<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Sink {
    /// The sink that an output stands for, for so many frames of a rate.
    pub(crate) fn new(output: &Path, size: (u32, u32), frames: usize, rate: f64) -> Result<Self, Failure> {
        let extension = output.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if output == Path::new("-") {
            let out = BufWriter::with_capacity(1 << 20, std::io::stdout());
            return Ok(Sink::Stream(y4m::Encoder::new(out, size, rate)?));
        }
        let failed =
            |e: &dyn std::fmt::Display| Failure::File { path: output.into(), message: e.to_string() };
        let encoder = match extension.as_deref() {
            Some("apng") => {
                let bytes = Shared::default();
                let mut encoder = png::Encoder::new(bytes.clone(), size.0, size.1);
                picture::describe(&mut encoder);
                encoder.set_animated(frames as u32, 0).map_err(|e| failed(&e))?;
                let (numerator, denominator) = delay(rate, 1000);
                encoder.set_frame_delay(numerator, denominator).map_err(|e| failed(&e))?;
                let writer = encoder.write_header().map_err(|e| failed(&e))?;
                Encoder::Apng(Box::new(writer), bytes)
            }
            Some("gif") => {
                let (Ok(width), Ok(height)) = (u16::try_from(size.0), u16::try_from(size.1)) else {
                    return Err(Failure::Usage("GIF pictures have at most 65535 pixels a side".to_owned()));
                };
                let mut encoder =
                    gif::Encoder::new(Vec::new(), width, height, &[]).map_err(|e| failed(&e))?;
                encoder.set_repeat(gif::Repeat::Infinite).map_err(|e| failed(&e))?;
                Encoder::Gif(Box::new(encoder), delay(rate, 100).0)
            }
            Some("y4m") => Encoder::Y4m(Box::new(y4m::Encoder::new(Vec::new(), size, rate)?)),
            Some("png") => {
                if let Some(pattern) = Pattern::new(output) {
                    return Ok(Sink::Numbered(pattern));
                }
                if frames == 1 {
                    return Ok(Sink::One(output.into()));
                }
                let message = "a PNG file holds one frame; write numbered ones (such as frames/####.png), or .apng, .gif or .y4m";
                return Err(Failure::Usage(message.to_owned()));
            }
            _ => {
                let found = output.display();
                return Err(Failure::Usage(format!(
                    "expected an output that ends with .png, .apng, .gif or .y4m, or is `-`, found {found}"
                )));
            }
        };
        Ok(Sink::Animation(Animation { path: output.into(), size, encoder }))
    }

    /// Whether standard output is taken.
    pub(crate) fn takes_stdout(&self) -> bool {
        matches!(self, Sink::Stream(_))
    }

    /// Whether frames are files of their own: those can be skipped and shared out.
    pub(crate) fn is_numbered(&self) -> bool {
        matches!(self, Sink::Numbered(_))
    }

    /// Whether the picture of a frame is there and whole.
    pub(crate) fn has(&self, frame: i32, size: (u32, u32)) -> bool {
        matches!(self, Sink::Numbered(pattern) if picture::is_whole(&pattern.path(frame), size))
    }

    /// Takes the picture of a frame.
    pub(crate) fn write(&mut self, frame: i32, picture: &Picture) -> Result<(), Failure> {
        match self {
            Sink::One(path) => picture.write(path),
            Sink::Numbered(pattern) => {
                let path = pattern.path(frame);
                if let Some(folder) = path.parent().filter(|f| !f.as_os_str().is_empty()) {
                    std::fs::create_dir_all(folder)
                        .map_err(|e| Failure::File { path: folder.into(), message: e.to_string() })?;
                }
                picture.write(&path)
            }
            Sink::Animation(animation) => animation.add(picture),
            Sink::Stream(encoder) => Ok(encoder.add(picture)?),
        }
    }

    /// Writes what waits for the last frame.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self {
            Sink::One(_) | Sink::Numbered(_) => Ok(()),
            Sink::Animation(animation) => animation.finish(),
            Sink::Stream(encoder) => Ok(encoder.finish()?.flush()?),
        }
    }
}

impl Animation {
    fn failed(&self, e: &dyn std::fmt::Display) -> Failure {
        Failure::File { path: self.path.clone(), message: e.to_string() }
    }

    fn add(&mut self, picture: &Picture) -> Result<(), Failure> {
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
        result.map_err(|e| self.failed(&e))
    }

    fn finish(self) -> Result<(), Failure> {
        let path = self.path;
        let failed = |e: &dyn std::fmt::Display| Failure::File { path: path.clone(), message: e.to_string() };
        let bytes = match self.encoder {
            Encoder::Apng(writer, bytes) => {
                writer.finish().map_err(|e| failed(&e))?;
                bytes.0.take()
            }
            Encoder::Gif(encoder, _) => encoder.into_inner().map_err(|e| failed(&e))?,
            Encoder::Y4m(encoder) => encoder.finish()?,
        };
        picture::write_whole(&path, &bytes)
    }
}

/// Seconds of a frame as a fraction over `parts`, at least one part.
fn delay(rate: f64, parts: u16) -> (u16, u16) {
    ((f64::from(parts) / rate).round().clamp(1.0, f64::from(u16::MAX)) as u16, parts)
}

/// YUV4MPEG2: 8 bits, 4:4:4, BT.709, limited range.
mod y4m {
    use crate::picture::Picture;
    use std::io::{Result, Write};

    pub(crate) struct Encoder<W> {
        out: W,
    }

    impl<W: Write> Encoder<W> {
        pub(crate) fn new(mut out: W, (width, height): (u32, u32), rate: f64) -> Result<Self> {
            // Whole rates as they are, others to a thousandth.
            let (rate, over) =
                if rate.fract() == 0.0 { (rate, 1) } else { ((rate * 1000.0).round().max(1.0), 1000) };
            writeln!(out, "YUV4MPEG2 W{width} H{height} F{rate:.0}:{over} Ip A1:1 C444 XCOLORRANGE=LIMITED")?;
            Ok(Self { out })
        }

        pub(crate) fn add(&mut self, picture: &Picture) -> Result<()> {
            self.out.write_all(b"FRAME\n")?;
            for plane in 0..3 {
                let bytes: Vec<u8> = picture.pixels.iter().map(|p| component(*p, plane)).collect();
                self.out.write_all(&bytes)?;
            }
            Ok(())
        }

        pub(crate) fn finish(self) -> Result<W> {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_in_the_last_run_of_marks() {
        let path = |text: &str, frame| Pattern::new(Path::new(text)).map(|p| p.path(frame));
        assert_eq!(path("a#/b####.png", 7), Some("a#/b0007.png".into()));
        assert_eq!(path("####.png", 12345), Some("12345.png".into()));
        assert_eq!(path("x##.png", -3), Some("x-03.png".into()));
        assert_eq!(path("x.png", 0), None);
    }

    #[test]
    fn white_black_and_the_primaries_have_the_components_of_bt_709() {
        let yuv = |pixel| [0, 1, 2].map(|plane| y4m::component(pixel, plane));
        assert_eq!(yuv([255, 255, 255]), [235, 128, 128]);
        assert_eq!(yuv([0, 0, 0]), [16, 128, 128]);
        assert_eq!(yuv([255, 0, 0]), [63, 102, 240]);
        assert_eq!(yuv([0, 0, 255]), [32, 240, 118]);
    }
}
