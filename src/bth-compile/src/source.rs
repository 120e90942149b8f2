//! The files of a model, or the triangles in memory that take their place, and the hashes of their
//! contents.

use crate::error::{Error, Result};
use bth_files::Digest;
use bth_import::{Looks, PositionRows};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use zerocopy::IntoBytes;

/// A mesh in memory, in the space of its object.
#[derive(Clone, Copy, Debug)]
pub struct TriangleMesh<'a> {
    /// The positions of vertices; equal ones are merged. Those of triangles must be finite.
    pub positions: PositionRows<'a>,
    /// For each triangle the rows of its corners in `positions`, counter-clockwise seen from the
    /// front. The row of a triangle here is its id in hits.
    pub triangles: &'a [[u32; 3]],
}

/// Name of a mesh in memory in messages.
pub(crate) const MESH_NAME: &str = "mesh";

/// Hashes of a model's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceDigest {
    /// BLAKE3 of the model's file.
    pub file: Digest,
    /// BLAKE3 of the files that it refers to, in order.
    pub others: Vec<Digest>,
    /// What of the looks is read: the images are among the files.
    pub looks: Looks,
}

/// A model whose files have been hashed.
#[derive(Clone, Copy)]
pub(crate) struct Model<'a> {
    pub(crate) path: &'a Path,
    pub(crate) digest: &'a SourceDigest,
}

impl SourceDigest {
    /// Reads and hashes the files of a model.
    ///
    /// # Errors
    /// `BTH-O001` when one cannot be read, or read once only, such as a pipe.
    pub fn of(path: &Path, looks: impl Into<Looks>) -> Result<Self> {
        let looks = looks.into();
        if let Err(error) = bth_files::regular_file(path) {
            return Err(match error.kind() {
                ErrorKind::NotSeekable => {
                    let why = "and a model is read more than once; `-` stands for standard input";
                    cannot_read(path, &format_args!("{error}, {why}"))
                }
                _ => cannot_read(path, &error),
            });
        }
        let others = files(path, looks)?.iter().skip(1).map(|other| digest(other)).collect::<Result<_>>()?;
        Ok(Self { file: digest(path)?, others, looks })
    }

    /// Hashes a mesh in memory: the numbers of positions and triangles, each with their
    /// little-endian bytes.
    pub(crate) fn of_triangles(mesh: TriangleMesh<'_>) -> Self {
        let mut hasher = blake3::Hasher::new();
        let (name, positions) = match mesh.positions {
            PositionRows::F32(rows) => (&b"triangles in memory"[..], rows.as_bytes()),
            PositionRows::F64(rows) => (&b"triangles in memory, f64"[..], rows.as_bytes()),
        };
        hasher.update(name);
        for (count, bytes) in
            [(mesh.positions.len(), positions), (mesh.triangles.len(), mesh.triangles.as_bytes())]
        {
            hasher.update(&(count as u64).to_le_bytes()).update(bytes);
        }
        Self { file: hasher.finalize().into(), others: Vec::new(), looks: Looks::default() }
    }

    /// Returns `read` if the files still have these hashes, which proves that it was read from the
    /// hashed content.
    ///
    /// # Errors
    /// `BTH-O002` when they do not.
    pub(crate) fn unchanged<T>(&self, path: &Path, read: T) -> Result<T> {
        if Self::of(path, self.looks)? == *self {
            return Ok(read);
        }
        Err(changed(path))
    }

    /// The text of all hashes, as cache keys contain it.
    pub(crate) fn text(&self) -> String {
        let all: Vec<String> = std::iter::once(&self.file).chain(&self.others).map(Digest::hex).collect();
        all.join("+")
    }
}

/// The extension of a model, lower-case, if it is supported; else empty.
pub(crate) fn extension(path: &Path) -> String {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is_supported = |e: &String| bth_import::extensions().any(|known| known == e);
    extension.filter(is_supported).unwrap_or_default()
}

/// The files of a model: the model itself, then those to which it refers.
///
/// # Errors
/// `BTH-O001` when the model cannot be read.
pub fn files(path: &Path, looks: impl Into<Looks>) -> Result<Vec<PathBuf>> {
    bth_import::source_files(path, looks)
}

/// The error for a file that changed between two looks at it.
pub(crate) fn changed(path: &Path) -> Error {
    Error::File {
        code: "BTH-O002",
        path: path.to_owned(),
        message: "the file changed while it was read".to_owned(),
    }
}

fn digest(path: &Path) -> Result<Digest> {
    let read = bth_files::regular_file(path).and_then(|_| File::open(path)).and_then(Digest::of_reader);
    read.map(|(digest, _)| digest).map_err(|e| cannot_read(path, &e))
}

pub(crate) fn cannot_read(path: &Path, error: &dyn std::fmt::Display) -> Error {
    Error::File { code: "BTH-O001", path: path.to_owned(), message: format!("cannot read: {error}") }
}
