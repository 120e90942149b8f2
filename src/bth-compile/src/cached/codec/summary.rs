//! Encodes report and hashes of a mesh. By these the stages that follow see if their inputs are the
//! same.

use super::super::rows::{HashedRows, Sink};
use super::Codec;
use bth_files::Digest;
use bth_import::{self as mesh, Mesh};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Hash of a mesh's positions, exact ones included, and triangles: the input of all stages between
/// import and file.
pub(crate) fn geometry(mesh: &Mesh) -> Digest {
    let mut hasher = HashedRows::new("geometry");
    hasher.add(&mesh.positions);
    hasher.add(&mesh.triangles);
    if let Some(exact) = &mesh.exact {
        exact.write(&mut hasher);
    }
    hasher.finish()
}

/// Report and hashes of a mesh, without the mesh itself.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct MeshSummary {
    /// The import's report.
    pub(crate) report: mesh::Report,
    /// Hash of positions and triangles.
    pub(crate) geometry: Digest,
    /// Hash of everything else that the mesh has, by name.
    pub(crate) parts: BTreeMap<String, Digest>,
}

impl MeshSummary {
    /// A mesh with its summary.
    pub(crate) fn of((mesh, report): (Mesh, mesh::Report)) -> (Mesh, Self) {
        let Mesh {
            positions: _,
            exact: _,
            triangles: _,
            attributes,
            opacity,
            groups,
            materials,
            sequence,
            deformation,
        } = &mesh;
        let parts = [
            hash("shading", attributes),
            hash("opacity", opacity),
            hash("groups", groups),
            hash("surface materials", materials),
            hash("sequence", sequence),
            hash("deformation", deformation),
        ];
        let summary =
            Self { report, geometry: geometry(&mesh), parts: parts.into_iter().flatten().collect() };
        (mesh, summary)
    }

    /// Returns true if skins or morph targets move the vertices.
    pub(crate) fn deforms(&self) -> bool {
        self.parts.contains_key("deformation")
    }

    /// A hash of all that an object is made from: the mesh, and the clip that poses it.
    pub(crate) fn content(&self, clip: Option<Digest>) -> blake3::Hash {
        let mut text = format!("mesh {}", self.geometry.hex());
        for (name, hash) in
            self.parts.iter().map(|(n, h)| (n.as_str(), h)).chain(clip.iter().map(|c| ("clip", c)))
        {
            text += &format!(" {name} {}", hash.hex());
        }
        blake3::hash(text.as_bytes())
    }
}

/// Hash of a part of a mesh, if the mesh has it.
fn hash(name: &str, part: &Option<impl Codec>) -> Option<(String, Digest)> {
    let mut hasher = HashedRows::new(name);
    part.as_ref()?.write(&mut hasher);
    Some((name.to_owned(), hasher.finish()))
}
