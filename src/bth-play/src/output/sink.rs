//! Where pictures go: one file, numbered files, an animation, or a stream.

use super::animation::Animation;
use super::numbered::Pattern;
use super::picture::{self, Picture};
use super::y4m;
use crate::failure::Failure;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Where the pictures of a sequence go.
pub(crate) enum Sink {
    /// One PNG file.
    One(PathBuf),
    /// A PNG file for each frame.
    Numbered(Pattern),
    /// An animation, which is written after the last frame.
    Animation(Animation),
    /// YUV4MPEG2 on standard output.
    Stream(y4m::Y4mEncoder<BufWriter<std::io::Stdout>>),
}

impl Sink {
    /// The sink that the output option describes, for a number of frames at a rate in frames per second.
    ///
    /// # Errors
    /// If the extension names no format, or one that cannot hold these pictures.
    pub(crate) fn new(output: &Path, size: (u32, u32), frames: usize, rate: f64) -> Result<Self, Failure> {
        if output == Path::new("-") {
            let out = BufWriter::with_capacity(1 << 20, std::io::stdout());
            return Ok(Sink::Stream(y4m::Y4mEncoder::new(out, size, rate)?));
        }
        if let Some(animation) = Animation::new(output, size, frames, rate)? {
            return Ok(Sink::Animation(animation));
        }
        if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Failure::Usage(format!(
                "expected an output that ends with .png, .apng, .gif or .y4m, or is `-`, found {}",
                output.display()
            )));
        }
        match Pattern::new(output) {
            Some(pattern) => Ok(Sink::Numbered(pattern)),
            None if frames == 1 => Ok(Sink::One(output.into())),
            None => {
                let message = "a PNG file holds one frame; write numbered ones (such as frames/####.png), or .apng, .gif or .y4m";
                Err(Failure::Usage(message.to_owned()))
            }
        }
    }

    /// Whether the pictures go to standard output.
    pub(crate) fn takes_stdout(&self) -> bool {
        matches!(self, Sink::Stream(_))
    }

    /// Whether each frame is a file of its own, so that frames can be skipped or rendered on several machines.
    pub(crate) fn is_numbered(&self) -> bool {
        matches!(self, Sink::Numbered(_))
    }

    /// Whether the picture of a frame exists already, complete and of this size.
    pub(crate) fn has(&self, frame: i32, size: (u32, u32)) -> bool {
        matches!(self, Sink::Numbered(pattern) if picture::is_complete(&pattern.path(frame), size))
    }

    /// Writes the picture of a frame, or adds it to the animation.
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

    /// Finishes the output after the last frame.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self {
            Sink::One(_) | Sink::Numbered(_) => Ok(()),
            Sink::Animation(animation) => animation.finish(),
            Sink::Stream(encoder) => Ok(encoder.finish()?.flush()?),
        }
    }
}
