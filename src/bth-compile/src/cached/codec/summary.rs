//! Report and hashes of a mesh, which tell the stages that follow whether their inputs are the same.

use super::super::rows::{HashedRows, RowWriter};
use super::Codec;
use bth_files::Digest;
use bth_import::{self as mesh, Mesh};
use serde::{Deserialize, Serialize};

/// Hash of a mesh's positions and triangles, the input of all stages between import and file.
pub(in crate::cached) fn geometry(mesh: &Mesh) -> Digest {
    let mut hasher = HashedRows::new("geometry");
    hasher.add(&mesh.positions);
    hasher.add(&mesh.triangles);
    hasher.finish()
}

/// Hash of a mesh's shading attributes, if it has any.
fn shading(mesh: &Mesh) -> Option<Digest> {
    let attributes = mesh.attributes.as_ref()?;
    let mut hasher = HashedRows::new("shading");
    hasher.add(&attributes.corners);
    hasher.add(&attributes.normals);
    hasher.add(&attributes.uvs);
    Some(hasher.finish())
}

/// Hash of the opacity of a mesh's triangles, where some are not opaque.
fn opacity(mesh: &Mesh) -> Option<Digest> {
    let opacity = mesh.opacity.as_ref()?;
    let mut hasher = HashedRows::new("opacity");
    hasher.add(&opacity.rows);
    hasher.add(&opacity.micro);
    Some(hasher.finish())
}

/// Hash of a mesh's groups, if they are wanted.
fn groups(mesh: &Mesh) -> Option<Digest> {
    let mut rows = RowWriter::default();
    mesh.groups.as_ref()?.write(&mut rows);
    let mut hasher = HashedRows::new("groups");
    hasher.add(&rows.finish());
    Some(hasher.finish())
}

/// Hash of how a mesh's materials look, if that is wanted.
fn materials(mesh: &Mesh) -> Option<Digest> {
    let mut rows = RowWriter::default();
    mesh.materials.as_ref()?.write(&mut rows);
    let mut hasher = HashedRows::new("materials");
    hasher.add(&rows.finish());
    Some(hasher.finish())
}

/// Hash of the frames of a mesh that is a sequence.
fn sequence(mesh: &Mesh) -> Option<Digest> {
    let sequence = mesh.sequence.as_ref()?;
    let mut hasher = HashedRows::new("sequence");
    hasher.add(&sequence.times);
    hasher.add(&sequence.positions);
    Some(hasher.finish())
}

/// Hash of what moves a mesh's vertices, if that is wanted.
fn deformation(mesh: &Mesh) -> Option<Digest> {
    let mut rows = RowWriter::default();
    mesh.deformation.as_ref()?.write(&mut rows);
    let mut hasher = HashedRows::new("deformation");
    hasher.add(&rows.finish());
    Some(hasher.finish())
}

/// Report and hashes of a mesh, without the mesh itself.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct MeshSummary {
    /// The import's report.
    pub(crate) report: mesh::Report,
    /// Hash of positions and triangles.
    pub(crate) geometry: Digest,
    /// Hash of the shading attributes.
    pub(crate) shading: Option<Digest>,
    /// Hash of the opacity.
    #[serde(default)]
    pub(crate) opacity: Option<Digest>,
    /// Hash of the groups.
    #[serde(default)]
    pub(crate) groups: Option<Digest>,
    /// Hash of how materials look.
    #[serde(default)]
    pub(crate) materials: Option<Digest>,
    /// Hash of the frames of a sequence.
    #[serde(default)]
    pub(crate) sequence: Option<Digest>,
    /// Hash of what moves the vertices.
    #[serde(default)]
    pub(crate) deformation: Option<Digest>,
}

impl MeshSummary {
    /// A mesh with its summary.
    pub(crate) fn of((mesh, report): (Mesh, mesh::Report)) -> (Mesh, Self) {
        let summary = Self {
            report,
            geometry: geometry(&mesh),
            shading: shading(&mesh),
            opacity: opacity(&mesh),
            groups: groups(&mesh),
            materials: materials(&mesh),
            sequence: sequence(&mesh),
            deformation: deformation(&mesh),
        };
        (mesh, summary)
    }
}
