//! A document that is made from a file of another format. It is then read like a glTF file, with
//! all that these can have.

use std::array::from_fn;

use crate::error::Result;
use crate::gltf::extensions::Use;
use crate::gltf::schema::{Accessor, Buffer, BufferView, GltfDocument};
use crate::gltf::{fbx, threemf};
use crate::mesh::Polygons;
use crate::source::Source;

/// Codes of component types (glTF 2.0 specification, §3.6.2.2).
const U16: u64 = 5123;
const U32: u64 = 5125;
const F32: u64 = 5126;

/// A format whose files are read as glTF documents.
pub(crate) struct MadeFormat {
    /// Its name in reports, and the extension of its files.
    pub(crate) name: &'static str,
    /// Returns true for content of the format.
    pub(crate) is_like: fn(&[u8]) -> bool,
    /// Makes the document.
    pub(super) document: fn(&Source<'_>, Use, Polygons) -> Result<Made>,
}

impl MadeFormat {
    /// The format of a file, by its extension or its content.
    pub(super) fn of(source: &Source<'_>) -> Option<&'static MadeFormat> {
        let extension = source.path.extension().unwrap_or_default();
        let is_of = |format: &&MadeFormat| {
            extension.eq_ignore_ascii_case(format.name) || (format.is_like)(source.data)
        };
        [&fbx::FORMAT, &threemf::FORMAT].into_iter().find(is_of)
    }
}

/// The error for a file of a format that a build without a feature does not read.
#[cfg(not(all(feature = "fbx", feature = "3mf")))]
pub(super) fn not_built(source: &Source<'_>, found: &str, feature: &str) -> crate::error::Error {
    let message = format!("expected a format that this build reads, found {found}");
    let hint = format!("build with the cargo feature {feature}, or export the model as glTF");
    source.error(crate::source::UNSUPPORTED, message, &hint)
}

/// The middle of a mesh far from its origin, where f32 would move vertices by more than 2^-24 of
/// its size.
pub(super) fn center(positions: impl Iterator<Item = [f64; 3]> + Clone) -> Option<[f64; 3]> {
    let finite = || positions.clone().filter(|p| p.iter().all(|x| x.is_finite()));
    let first = finite().next()?;
    let (lower, upper) = finite().fold((first, first), |(lower, upper), p| {
        (from_fn(|k| f64::min(lower[k], p[k])), from_fn::<_, 3, _>(|k| f64::max(upper[k], p[k])))
    });
    let size = (0..3).map(|k| upper[k] - lower[k]).fold(0.0, f64::max);
    let is_far = finite().flatten().any(|x| (f64::from(x as f32) - x).abs() > size / f64::from(1 << 24));
    let middle: [f64; 3] = from_fn(|k| f64::from((lower[k] / 2.0 + upper[k] / 2.0) as f32));
    (is_far && middle.iter().all(|x| x.is_finite())).then_some(middle)
}

/// A document and the bytes of its only buffer.
#[derive(Default)]
pub(crate) struct Made {
    pub(crate) document: GltfDocument,
    pub(super) bytes: Vec<u8>,
}

impl Made {
    /// Adds rows of `N` numbers: `SCALAR`, `VEC2`, `VEC3`, `VEC4` or `MAT4`.
    pub(crate) fn floats<const N: usize>(&mut self, rows: impl IntoIterator<Item = [f32; N]>) -> usize {
        self.rows(F32, rows.into_iter().map(|row| row.map(f32::to_le_bytes)))
    }

    /// Adds the joints of vertices.
    pub(crate) fn joints(&mut self, rows: impl IntoIterator<Item = [u16; 4]>) -> usize {
        self.rows(U16, rows.into_iter().map(|row| row.map(u16::to_le_bytes)))
    }

    /// Adds indices.
    pub(crate) fn indices(&mut self, indices: impl IntoIterator<Item = u32>) -> usize {
        self.rows(U32, indices.into_iter().map(|index| [index.to_le_bytes()]))
    }

    /// Adds `count` rows that are zero but for these.
    pub(crate) fn sparse(&mut self, count: usize, rows: &[(u32, [f32; 3])]) -> usize {
        let places = self.indices(rows.iter().map(|row| row.0));
        let values = self.floats(rows.iter().map(|row| row.1));
        let view = |accessor: usize| self.document.accessors[accessor].buffer_view.unwrap_or_default();
        let sparse = serde_json::from_value(serde_json::json!({
            "count": rows.len(),
            "indices": {"bufferView": view(places), "componentType": U32},
            "values": {"bufferView": view(values)},
        }));
        let accessor = Accessor {
            component_type: F32,
            count: count as u64,
            shape: "VEC3".to_owned(),
            sparse: sparse.ok(),
            ..Accessor::default()
        };
        self.push(accessor)
    }

    /// Adds the bytes of an image, and returns their buffer view.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.view_from(start)
    }

    fn rows<const N: usize, const SIZE: usize>(
        &mut self,
        component_type: u64,
        rows: impl Iterator<Item = [[u8; SIZE]; N]>,
    ) -> usize {
        let start = self.bytes.len();
        rows.for_each(|row| self.bytes.extend_from_slice(row.as_flattened()));
        let count = ((self.bytes.len() - start) / (N * SIZE)) as u64;
        let shape = match N {
            1 => "SCALAR",
            16 => "MAT4",
            _ => ["VEC2", "VEC3", "VEC4"][N - 2],
        };
        let view = Some(self.view_from(start));
        let shape = shape.to_owned();
        self.push(Accessor { buffer_view: view, component_type, count, shape, ..Accessor::default() })
    }

    fn push(&mut self, accessor: Accessor) -> usize {
        self.document.accessors.push(accessor);
        self.document.accessors.len() - 1
    }

    /// The view of all bytes from `start` on.
    fn view_from(&mut self, start: usize) -> usize {
        let (byte_offset, byte_length) = (start as u64, (self.bytes.len() - start) as u64);
        self.document.buffer_views.push(BufferView { byte_offset, byte_length, ..BufferView::default() });
        self.document.buffer_views.len() - 1
    }

    /// Adds the buffer, once all is there.
    pub(super) fn finish(mut self) -> (GltfDocument, Vec<u8>) {
        let byte_length = self.bytes.len() as u64;
        self.document.buffers = vec![Buffer { uri: None, byte_length, extensions: Default::default() }];
        self.document.asset.version = "2.0".to_owned();
        (self.document, self.bytes)
    }
}
