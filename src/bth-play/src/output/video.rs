//! Videos: frames are piped to the program ffmpeg, which must be installed.

use super::animation::Y4mEncoder;
use super::picture::Picture;
use crate::failure::Failure;
use crate::interrupt::Part;
use std::io::{BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

/// Extensions of files that are videos.
const EXTENSIONS: [&str; 4] = ["mp4", "mov", "mkv", "webm"];

/// A video that ffmpeg is writing.
pub(crate) struct Video {
    path: PathBuf,
    child: Child,
    frames: Y4mEncoder<BufWriter<ChildStdin>>,
    /// What it writes, in a folder that is removed with this; renamed when it is whole.
    part: PathBuf,
    _removed: Part,
    _folder: tempfile::TempDir,
}

impl Video {
    /// A video; `None` for paths with other extensions.
    ///
    /// # Errors
    /// `BTH-P007` if there is no ffmpeg, `BTH-P002` if nothing can be written.
    pub(super) fn new(path: &Path, size: (u32, u32), rate: f64) -> Result<Option<Self>, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let Some(extension) = extension.filter(|e| EXTENSIONS.contains(&e.as_str())) else { return Ok(None) };
        super::picture::create_folder(path)?;
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = tempfile::Builder::new().prefix(".bth-play-").tempdir_in(parent);
        let folder = folder.map_err(|e| Failure::file(path, &format!("cannot write: {e}")))?;
        let part = folder.path().join(format!("video.{extension}"));
        let encoder: &[&str] = match extension.as_str() {
            "webm" => &["libvpx-vp9", "-crf", "24", "-b:v", "0"],
            _ => &["libx264", "-crf", "17", "-movflags", "+faststart"],
        };
        let mut child = Command::new("ffmpeg")
            .args(["-loglevel", "error", "-f", "yuv4mpegpipe", "-i", "-", "-pix_fmt", "yuv420p"])
            // Players want even sizes.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-colorspace", "bt709"])
            .args(["-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv", "-c:v"])
            .args(encoder)
            .arg("-y")
            .arg(&part)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| {
                let message = match e.kind() {
                    ErrorKind::NotFound => "it needs the program ffmpeg, which is not on the PATH".to_owned(),
                    _ => format!("the program ffmpeg cannot be started: {e}"),
                };
                Failure::Video { path: path.into(), message }
            })?;
        let stdin = child.stdin.take().expect("a pipe");
        let frames = Y4mEncoder::new(BufWriter::with_capacity(1 << 20, stdin), size, rate);
        let frames = frames.map_err(|e| Failure::Video { path: path.into(), message: e.to_string() })?;
        let _removed = Part::new(folder.path());
        Ok(Some(Self { path: path.into(), child, frames, part, _removed, _folder: folder }))
    }

    /// Where it is written.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Adds the next frame.
    pub(super) fn add(&mut self, picture: &Picture) -> Result<(), Failure> {
        self.frames.add(picture).map_err(|e| ended(&self.path, &mut self.child, &e.to_string()))
    }

    /// Writes the file.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        let flushed = self.frames.finish().and_then(|mut pipe| pipe.flush());
        if let Err(error) = flushed {
            return Err(ended(&self.path, &mut self.child, &error.to_string()));
        }
        let status = self.child.wait().map_err(|e| Failure::file(&self.path, &e))?;
        if !status.success() {
            return Err(ended(&self.path, &mut self.child, &status.to_string()));
        }
        std::fs::rename(&self.part, &self.path)
            .map_err(|e| Failure::file(&self.path, &format!("cannot write: {e}")))
    }
}

/// The error of a video whose program ended too early: what the program says of it.
fn ended(path: &Path, child: &mut Child, otherwise: &str) -> Failure {
    let mut text = String::new();
    if let Some(mut stderr) = child.stderr.take() {
        let _ = stderr.read_to_string(&mut text);
    }
    let said = text.lines().last().unwrap_or(otherwise);
    Failure::Video { path: path.into(), message: format!("ffmpeg failed: {said}") }
}
