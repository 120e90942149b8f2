//! Where pictures go: one file, numbered files, an animation, or a stream.

use super::animation::{Animation, Y4mEncoder};
use super::picture::{self, Picture};
use super::video::Video;
use crate::failure::Failure;
use std::collections::HashSet;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// A path in which the number of the frame is to be inserted.
pub(crate) struct Pattern {
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern of a path: its last run of `#` is replaced by the number, padded with zeros to
    /// the same number of digits. `None` for a path without `#`, and for one in a folder that is
    /// there and has them in its name.
    pub(crate) fn new(path: &Path) -> Option<Self> {
        let text = path.to_str()?;
        let end = text.rfind('#')? + 1;
        let is_in_name = path.file_name()?.to_str()?.contains('#');
        if !is_in_name && path.parent().is_some_and(Path::is_dir) {
            return None;
        }
        let start = text[..end].trim_end_matches('#').len();
        Some(Self { before: text[..start].to_owned(), digits: end - start, after: text[end..].to_owned() })
    }

    /// The path of a frame.
    pub(super) fn path(&self, frame: i32) -> PathBuf {
        let sign = if frame < 0 { "-" } else { "" };
        let number = format!("{sign}{:0width$}", frame.unsigned_abs(), width = self.digits);
        PathBuf::from(format!("{}{number}{}", self.before, self.after))
    }
}

/// Fails if one of these files that are to be written is one that is read, whatever the paths are
/// spelled like.
///
/// # Errors
/// Wrong usage (exit code 2).
pub(crate) fn refuse_inputs(files: &[PathBuf], inputs: &[PathBuf]) -> Result<(), Failure> {
    let inputs: HashSet<PathBuf> = inputs.iter().filter_map(|input| input.canonicalize().ok()).collect();
    let is_input = |file: &&PathBuf| file.canonicalize().is_ok_and(|real| inputs.contains(&real));
    match files.iter().find(is_input) {
        None => Ok(()),
        Some(file) => {
            let message =
                format!("{} would replace a file that is read: name another output", file.display());
            Err(Failure::Usage(message))
        }
    }
}

/// Where the pictures of a sequence go.
pub(crate) enum Sink {
    /// One PNG file.
    One(PathBuf),
    /// A PNG file for each frame.
    Numbered(Pattern),
    /// An animation, which is written after the last frame.
    Animation(Animation),
    /// A video, which ffmpeg writes.
    Video(Video),
    /// YUV4MPEG2 on standard output.
    Stream(Y4mEncoder<BufWriter<std::io::Stdout>>),
}

impl Sink {
    /// The sink that the output option describes, for a number of frames at a rate in frames per
    /// second.
    ///
    /// # Errors
    /// If the extension names no format, or one that cannot hold these pictures.
    pub(crate) fn new(output: &Path, size: (u32, u32), frames: usize, rate: f64) -> Result<Self, Failure> {
        if output == Path::new("-") {
            let out = BufWriter::with_capacity(1 << 20, std::io::stdout());
            return Ok(Sink::Stream(Y4mEncoder::new(out, size, rate)?));
        }
        if let Some(animation) = Animation::new(output, size, frames, rate)? {
            return Ok(Sink::Animation(animation));
        }
        if let Some(video) = Video::new(output, size, rate)? {
            return Ok(Sink::Video(video));
        }
        if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            return Err(Failure::Usage(format!(
                "expected an output that ends with .png, .apng, .gif, .y4m or .mp4, or is `-`, found {}",
                output.display()
            )));
        }
        match Pattern::new(output) {
            Some(pattern) => Ok(Sink::Numbered(pattern)),
            None if frames == 1 => Ok(Sink::One(output.into())),
            None => {
                let message = "a PNG file holds one frame; write numbered ones (such as frames/####.png), or .apng, .gif, .y4m or .mp4";
                Err(Failure::Usage(message.to_owned()))
            }
        }
    }

    /// The files that frames are written to; none for standard output.
    pub(crate) fn files(&self, frames: &[i32]) -> Vec<PathBuf> {
        match self {
            Sink::One(path) => vec![path.clone()],
            Sink::Numbered(pattern) => frames.iter().map(|frame| pattern.path(*frame)).collect(),
            Sink::Animation(animation) => vec![animation.path().to_owned()],
            Sink::Video(video) => vec![video.path().to_owned()],
            Sink::Stream(_) => Vec::new(),
        }
    }

    /// Fails if the files of these frames cannot be written, or would replace one of the files that
    /// are read.
    ///
    /// # Errors
    /// `BTH-P002` and wrong usage (exit code 2).
    pub(crate) fn prepare(&self, frames: &[i32], inputs: &[PathBuf]) -> Result<(), Failure> {
        let files = self.files(frames);
        refuse_inputs(&files, inputs)?;
        files.first().map_or(Ok(()), |file| picture::prepare_folder(file))
    }

    /// Returns true if the pictures go to standard output.
    pub(crate) fn takes_stdout(&self) -> bool {
        matches!(self, Sink::Stream(_))
    }

    /// Returns true if each frame is a separate file, so that frames can be skipped or rendered on
    /// several machines.
    pub(crate) fn is_numbered(&self) -> bool {
        matches!(self, Sink::Numbered(_))
    }

    /// Where a tile of a frame's picture is until all are there; `None` for outputs that are not
    /// pictures. `grid` has columns and rows, and tiles count from 1.
    pub(crate) fn tile_path(&self, frame: i32, (columns, rows): (u32, u32), tile: u32) -> Option<PathBuf> {
        let picture = match self {
            Sink::One(path) => path.clone(),
            Sink::Numbered(pattern) => pattern.path(frame),
            _ => return None,
        };
        Some(picture.with_extension(format!("{columns}x{rows}-{tile}.png")))
    }

    /// Returns true if the picture of a frame exists already, complete and of this size.
    pub(crate) fn has(&self, frame: i32, size: (u32, u32)) -> bool {
        matches!(self, Sink::Numbered(pattern) if picture::is_complete(&pattern.path(frame), size))
    }

    /// Writes the picture of a frame, or adds it to the animation.
    pub(crate) fn write(&mut self, frame: i32, picture: &Picture) -> Result<(), Failure> {
        match self {
            Sink::One(path) => picture.write(path),
            Sink::Numbered(pattern) => {
                // The number may be in the name of the folder.
                picture.write_in_folder(&pattern.path(frame))
            }
            Sink::Animation(animation) => animation.add(picture),
            Sink::Video(video) => video.add(picture),
            Sink::Stream(encoder) => Ok(encoder.add(picture)?),
        }
    }

    /// Finishes the output after the last frame.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        match self {
            Sink::One(_) | Sink::Numbered(_) => Ok(()),
            Sink::Animation(animation) => animation.finish(),
            Sink::Video(video) => video.finish(),
            Sink::Stream(encoder) => Ok(encoder.finish()?.flush()?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_replace_the_last_run_of_number_signs() {
        let path = |text: &str, frame| Pattern::new(Path::new(text)).map(|p| p.path(frame));
        assert_eq!(path("a#/b####.png", 7), Some("a#/b0007.png".into()));
        assert_eq!(path("####.png", 12345), Some("12345.png".into()));
        assert_eq!(path("x##.png", -3), Some("x-03.png".into()));
        assert_eq!(path("x.png", 0), None);
        assert_eq!(path("a#/x.png", 7), Some("a7/x.png".into()));
    }

    #[test]
    fn a_folder_that_is_there_is_not_numbered() {
        let folder = tempfile::tempdir().unwrap();
        let there = folder.path().join("c#");
        std::fs::create_dir(&there).unwrap();
        assert!(Pattern::new(&there.join("x.png")).is_none());
        assert_eq!(Pattern::new(&there.join("#.png")).unwrap().path(3), there.join("3.png"));
    }
}
