//! Import of a model.

use crate::cached::{MeshSummary, decode, encode, text};
use crate::error::Result;
use crate::monitor::Monitor;
use crate::opacity;
use crate::source::{Model, SourceDigest, extension};
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;
use bth_import::{self as mesh, Looks, Mesh, Wanted};
use std::path::Path;

/// Reads the mesh of a model whose files have been hashed, and finds where its triangles let rays
/// pass.
pub(crate) struct Import<'a> {
    pub(crate) model: &'a Model<'a>,
    pub(crate) wanted: Wanted,
}

impl Import<'_> {
    /// The mesh, without the hashes of its summary.
    ///
    /// # Errors
    /// Errors of the import; `BTH-O002` when a file has changed since it was hashed.
    pub(crate) fn read(&self, monitor: &dyn Monitor) -> Result<(Mesh, mesh::Report)> {
        let Model { path, digest } = *self.model;
        let (mut mesh, mut report) = mesh::import(path, self.wanted, monitor)?;
        if digest.looks.alpha != mesh::AlphaMode::None {
            let cutouts = mesh::import_cutouts(path, digest.looks, monitor)?;
            opacity::add(&mut mesh, &mut report, &cutouts, monitor)?;
        }
        digest.unchanged(path, (mesh, report))
    }

    /// The key of a mesh, the part `part` of a model. A supported extension determines the format
    /// in which the file is read.
    pub(crate) fn key_of(source: &SourceDigest, path: &Path, part: &str, wanted: Wanted) -> Key {
        let Wanted { attributes, groups, materials, unreadable, polygons, positions, vertices } = wanted;
        let Looks { alpha, materials: _, unreadable: _, polygons: _ } = source.looks;
        Key::new(Self::NAME)
            .with("source", source.text())
            .with("format", extension(path))
            .with("part", part)
            .with("attributes", text(&attributes))
            .with("names", groups.to_string())
            .with("materials", materials.to_string())
            .with("unreadable images", format!("{unreadable:?}"))
            .with("polygons", text(&polygons))
            .with("positions", text(&positions))
            .with("all vertices", vertices.to_string())
            .with("alpha", text(&alpha))
            .with("mesh version", Self::VERSION)
    }
}

impl Stage for Import<'_> {
    type Output = (Mesh, MeshSummary);
    const NAME: &'static str = "mesh";
    const VERSION: &'static str = "10";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        Ok(MeshSummary::of(self.read(monitor)?))
    }
}

impl CachedStage<Mesh, MeshSummary> for Import<'_> {
    fn key(&self) -> Key {
        Self::key_of(self.model.digest, self.model.path, "flat", self.wanted)
    }

    fn encode(mesh: &Mesh) -> Vec<u8> {
        encode(mesh)
    }

    fn decode(&self, bytes: &[u8]) -> Option<Mesh> {
        decode(bytes)
    }
}
