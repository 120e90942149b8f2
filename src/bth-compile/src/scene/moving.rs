//! Sources of meshes whose vertices move: numbered files, and models with a vertex cache.

use super::context::Context;
use crate::error::Result;
use crate::pipeline;
use crate::source::{SourceDigest, changed};
use bth_files::Digest;
use bth_import::{self as mesh, Looks, Mesh, Timing};
use bth_scene::{Manifest, SequenceFrames, SequenceTiming, Source};
use std::path::{Path, PathBuf};

/// What moves the vertices of a source.
pub(super) struct Moving {
    /// The files: the frames, or a model and its vertex cache.
    files: Vec<PathBuf>,
    /// True if the second file is a vertex cache.
    is_cache: bool,
    /// The mesh that the vertex cache moves, if the model is a glTF file.
    mesh: Option<u32>,
    timing: Timing,
}

/// The files whose contents an object is made from, in order; empty for objects whose vertices do
/// not move by themselves.
///
/// # Errors
/// The errors of [`mesh::sequence_files`].
pub(super) fn moving_files(source: &Source, folder: &Path) -> Result<Vec<PathBuf>> {
    match source {
        Source::Sequence { frames: SequenceFrames::Numbered(pattern), .. } => {
            mesh::sequence_files(&folder.join(pattern))
        }
        Source::Sequence { frames: SequenceFrames::Listed(files), .. } => {
            Ok(files.iter().map(|file| folder.join(file)).collect())
        }
        Source::Cached { path, cache, .. } => Ok(vec![folder.join(path), folder.join(cache)]),
        _ => Ok(Vec::new()),
    }
}

impl Moving {
    /// What moves the vertices of an object; `None` where nothing does.
    ///
    /// # Errors
    /// The errors of [`moving_files`].
    pub(super) fn of(manifest: &Manifest, source: &Source, folder: &Path) -> Result<Option<Moving>> {
        let (is_cache, mesh, SequenceTiming { rate, start }) = match source {
            Source::Sequence { timing, .. } => (false, None, *timing),
            Source::Cached { mesh, timing, .. } => (true, *mesh, *timing),
            _ => return Ok(None),
        };
        let timing = Timing { rate, usual_rate: manifest.frames.rate, start };
        Ok(Some(Moving { files: moving_files(source, folder)?, is_cache, mesh, timing }))
    }

    /// The first of the files.
    pub(super) fn first(&self) -> &Path {
        self.files.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// The hashes of all files.
    ///
    /// # Errors
    /// `BTH-O001` when one cannot be read.
    pub(super) fn digest(&self, looks: Looks) -> Result<SourceDigest> {
        let mut digest = SourceDigest::of(self.first(), looks)?;
        for file in self.files.iter().skip(1) {
            digest.others.push(SourceDigest::of(file, Looks::default())?.file);
        }
        Ok(digest)
    }

    /// What the mesh depends on besides the contents of the files.
    pub(super) fn part(&self) -> String {
        let kind = if self.is_cache { "vertex cache" } else { "sequence" };
        let mesh = self.mesh.map_or_else(String::new, |mesh| format!(" of mesh {mesh}"));
        let Timing { rate, usual_rate, start } = self.timing;
        format!("{kind}{mesh} rate {rate:?} of {usual_rate:?} start {start:?} motion {}", pipeline::MOTION)
    }

    /// Reads the mesh with its frames.
    ///
    /// # Errors
    /// Errors of the import.
    pub(super) fn import(&self, context: &Context<'_>) -> Result<(Mesh, mesh::Report)> {
        let (timing, wanted, monitor) = (&self.timing, context.options.wanted(), context.monitor);
        Ok(match (self.is_cache, &self.files[..]) {
            (true, [model, cache]) => {
                mesh::import_vertex_cache((model, self.mesh), cache, timing, wanted, monitor)?
            }
            _ => mesh::import_sequence(&self.files, timing, wanted, monitor)?,
        })
    }

    /// Returns what was read if the files still have these hashes.
    ///
    /// # Errors
    /// `BTH-O002` when a file has changed since it was hashed.
    pub(super) fn unchanged<T>(&self, digest: &SourceDigest, read: T) -> Result<T> {
        let same = self.digest(digest.looks)? == *digest;
        if same { Ok(read) } else { Err(changed(self.first())) }
    }

    /// Bytes of all files.
    pub(super) fn bytes(&self) -> u64 {
        self.files.iter().map(|file| std::fs::metadata(file).map_or(0, |m| m.len())).sum()
    }
}

/// The hash of nothing, for files that have not been hashed yet.
pub(super) fn unhashed(looks: Looks) -> SourceDigest {
    SourceDigest { file: Digest::of(b""), others: Vec::new(), looks }
}
