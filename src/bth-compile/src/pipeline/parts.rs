//! The file, from what the stages made.

use super::{Object, Options};
use crate::error::Result;
use crate::write;
use bth_format::layout::Object as Header;

/// The bytes of a file with one object, checked as a reader will, and how many of them tracing reads.
pub(super) fn file(object: &Object, provenance: String, options: &Options) -> Result<(Vec<u8>, u64)> {
    let parts = parts(object, options);
    let mut builder = write::FileBuilder::new();
    write::object(&mut builder, 0, &parts)?;
    builder.provenance(provenance)?;
    let bytes = builder.finish();
    write::self_check(&bytes, false)?;
    Ok((bytes, resident_bytes(&parts)))
}

/// The sections of an object.
pub(crate) fn parts<'a>(object: &'a Object, options: &Options) -> write::ObjectParts<'a> {
    let Object { mesh, tree, wide, .. } = object;
    let mut parts = write::ObjectParts {
        bounds: tree.nodes.first().map(|root| (root.lower, root.upper)),
        root: wide.root,
        triangles: mesh.triangles.len() as u32,
        dropped: (mesh.triangles.len() - tree.order.len()) as u32,
        lines: &wide.lines,
        triangle_ids: &wide.triangle_ids,
        ..Default::default()
    };
    if let Some(encoded) = &object.encoded {
        parts.record = Some(options.record);
        parts.tet_leaves = &encoded.leaves;
        parts.tets = &encoded.tets;
        parts.tet_vertices = &encoded.vertices;
        parts.tet_faces = &encoded.faces;
        parts.hull_faces = &encoded.hulls;
        parts.triangle_faces = &encoded.homes;
    }
    parts.grid = object.on_grid.as_ref().map(|on| (on.grid, on.displacement));
    parts.packed_nodes = object.packed_nodes;
    let mut source = write::Source::default();
    if options.geometry {
        let positions = object.on_grid.as_ref().map_or(&mesh.positions, |on| &on.source);
        (source.positions, source.triangles) = (positions, &mesh.triangles);
    }
    if let Some(attributes) = &mesh.attributes {
        source.corners = &attributes.corners;
        source.normals = &attributes.normals;
        source.uvs = &attributes.uvs;
    }
    parts.source = Some(source);
    parts
}

/// Bytes of the sections that tracing reads.
pub(crate) fn resident_bytes(parts: &write::ObjectParts<'_>) -> u64 {
    let bytes = size_of::<Header>()
        + size_of_val(parts.lines)
        + size_of_val(parts.triangle_ids)
        + size_of_val(parts.tet_leaves)
        + size_of_val(parts.tets)
        + size_of_val(parts.tet_vertices)
        + size_of_val(parts.tet_faces)
        + size_of_val(parts.hull_faces)
        + size_of_val(parts.triangle_faces);
    bytes as u64
}
