//! Decodes primitives that KHR_draco_mesh_compression holds, by the crate `draco-core`.

use draco_core::{DecodeLimits, DecoderBuffer, Mesh as DracoMesh, MeshDecoder};
use serde::Deserialize;
use serde_json::Value;

use crate::error::Result;
use crate::gltf::extensions::DRACO;
use crate::gltf::file::GltfFile;
use crate::gltf::schema::DracoCompression;
use crate::source::MALFORMED;
use bth_format::limits::MAX_TRIANGLES;

/// The decoder allocates for attributes at most this many bytes for each byte of a stream, and a
/// little more. Equal values cost Draco nothing, so no ratio holds for all streams; models stay far
/// below this one.
const MOST_BYTES_PER_BYTE: u64 = 4096;
const MOST_EXTRA_BYTES: u64 = 1 << 20;

/// A decoded primitive.
pub(super) struct DracoPrimitive {
    compression: DracoCompression,
    mesh: DracoMesh,
}

impl DracoPrimitive {
    /// Decodes the stream that the extension's value describes.
    ///
    /// # Errors
    /// `BTH-I002` where the value or the stream is malformed, and as for a buffer view.
    pub(super) fn decode(file: &GltfFile<'_>, value: &Value, part: &str) -> Result<Self> {
        let error = |message: String| file.error(MALFORMED, part, message);
        let compression = DracoCompression::deserialize(value)
            .map_err(|e| error(format!("expected the properties of {DRACO}, found: {e}")))?;
        let (stream, _) = file.view(compression.buffer_view)?;
        let bytes = stream.len() as u64 * MOST_BYTES_PER_BYTE + MOST_EXTRA_BYTES;
        let limits = DecodeLimits::default()
            .with_max_points(u64::from(u32::MAX - 1))
            .with_max_faces(u64::from(MAX_TRIANGLES))
            .with_max_decoded_bytes(bytes);
        let mut mesh = DracoMesh::new();
        let mut buffer = DecoderBuffer::new(stream).with_limits(limits);
        MeshDecoder::new()
            .decode(&mut buffer, &mut mesh)
            .map_err(|e| error(format!("expected a stream of Draco, found: {e}")))?;
        Ok(DracoPrimitive { compression, mesh })
    }

    /// Number of vertices.
    pub(super) fn rows(&self) -> u64 {
        self.mesh.num_points() as u64
    }

    /// Corners of the triangles, three by three.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.mesh.faces().as_flattened().iter().map(|point| point.0).collect()
    }

    /// Returns the vertices' values of a named attribute, which `accessor` describes; `None` if the
    /// stream does not have it.
    ///
    /// # Errors
    /// `BTH-I002` where the stream has no attribute of the given identifier and shape, `BTH-I013`
    /// for a bad accessor.
    pub(super) fn attribute<const N: usize>(
        &self,
        file: &GltfFile<'_>,
        name: &str,
        accessor: usize,
        part: &str,
    ) -> Result<Option<Vec<[f32; N]>>> {
        let Some(&id) = self.compression.attributes.get(name) else { return Ok(None) };
        let Some(attribute) =
            self.mesh.attribute_by_unique_id(id).filter(|a| usize::from(a.num_components()) == N)
        else {
            let message =
                format!("expected an attribute {id} of {N} components for {name} in the Draco stream");
            return Err(file.error(MALFORMED, part, message));
        };
        let numbers = attribute.read_f32s(self.mesh.num_points(), N);
        file.decoded(accessor, &numbers).map(Some)
    }
}
