//! An open glTF or GLB file: its document, its bytes, and the errors at its parts.

use serde::de::DeserializeOwned;
use serde_json::Value;
use std::borrow::Cow;
use std::cell::OnceCell;

use crate::error::{Error, Result};
use crate::gltf::container::split;
use crate::gltf::extensions::{Use, VISIBILITY, unsupported_extension};
use crate::gltf::made::MadeFormat;
use crate::gltf::schema::{GltfDocument, GltfMesh, GltfNode, Visibility};
use crate::mesh::Polygons;
use crate::source::{MALFORMED, MALFORMED_HINT, Source, UNSUPPORTED};
use crate::text::shown;

/// Code: nodes that do not make a forest, or that refer to what does not exist.
pub(crate) const GRAPH: &str = "BTH-I012";
/// Code: weights of joints or of morph targets that mean nothing.
pub(super) const WEIGHTS: &str = "BTH-I017";
/// The hint for most errors of a document.
const EXPORT: &str = "export the model again";
const CONVERT: &str = "convert the model to glTF 2.0";

/// The name of the format itself.
const GLTF: &str = "gltf";

/// A document and the bytes behind it. Buffers are read and views are decompressed at first use.
pub(crate) struct GltfFile<'a> {
    pub(crate) source: &'a Source<'a>,
    /// Name of the format.
    pub(super) format: &'static str,
    pub(crate) document: GltfDocument,
    /// The binary chunk of a GLB.
    pub(super) binary: Option<&'a [u8]>,
    pub(super) loaded: Vec<OnceCell<Cow<'a, [u8]>>>,
    pub(super) decompressed: Vec<OnceCell<Vec<u8>>>,
}

/// Bound of the rounding of a matrix's last row, relative to its 1: exporters compute matrices in
/// f32.
const LAST_ROW: f64 = 1e-6;

impl<'a> GltfFile<'a> {
    /// Reads the document, or makes one from a file of another format, whose `polygons` become
    /// triangles. Refuses required extensions that this use of it does not read.
    pub(crate) fn open(source: &'a Source<'a>, used: Use, polygons: Polygons) -> Result<Self> {
        source.fetched()?;
        if let Some(format) = MadeFormat::of(source) {
            let (document, bytes) = (format.document)(source, used, polygons)?.finish();
            let loaded = vec![OnceCell::from(Cow::Owned(bytes))];
            let decompressed = document.buffer_views.iter().map(|_| OnceCell::new()).collect();
            let format = format.name;
            return Ok(GltfFile { source, format, document, binary: None, loaded, decompressed });
        }
        let (json, binary) = split(source)?;
        let unsupported = |message| source.error_in_part(UNSUPPORTED, "asset", message, CONVERT);
        let document: GltfDocument = serde_json::from_slice(json).map_err(|e| {
            // In glTF 1 lists are objects, and the asset may be absent.
            let value: Value = serde_json::from_slice(json).unwrap_or_default();
            let is_first = ["meshes", "buffers", "accessors"].iter().any(|list| value[list].is_object());
            if is_first || value["asset"]["version"].as_str().is_some_and(|version| version.starts_with("1."))
            {
                return unsupported("expected glTF 2, found glTF 1".to_owned());
            }
            let message = format!("expected a glTF document, found: {e}");
            source.error_in_part(MALFORMED, "JSON", message, MALFORMED_HINT)
        })?;
        let version = &document.asset.version;
        if !version.starts_with("2.") {
            return Err(unsupported(format!("expected glTF 2, found version \"{version}\"")));
        }
        if let Some(least) = document.asset.min_version.as_deref().filter(|least| !is_known(least)) {
            let found = shown(least.as_bytes());
            return Err(unsupported(format!(
                "expected a glTF that readers of version 2.0 know, found minVersion \"{found}\""
            )));
        }
        let loaded = document.buffers.iter().map(|_| OnceCell::new()).collect();
        let decompressed = document.buffer_views.iter().map(|_| OnceCell::new()).collect();
        let file = GltfFile { source, format: GLTF, document, binary, loaded, decompressed };
        file.check_transforms()?;
        match file.document.extensions_required.iter().find(|name| !used.reads(name)) {
            Some(name) => Err(unsupported_extension(source, name)),
            None => Ok(file),
        }
    }

    /// Returns true if the document is made from a file of another format.
    pub(super) fn is_made(&self) -> bool {
        self.format != GLTF
    }

    /// An error in a part of the document.
    pub(super) fn error(
        &self,
        code: &'static str,
        part: impl Into<String>,
        message: impl Into<String>,
    ) -> Error {
        self.source.error_in_part(code, part, message, EXPORT)
    }

    /// An error of the graph of nodes.
    pub(super) fn graph_error(&self, part: impl Into<String>, message: impl Into<String>) -> Error {
        self.error(GRAPH, part, message)
    }

    /// Parses a part of the document that is kept as a value.
    ///
    /// # Errors
    /// `BTH-I002` where it is malformed.
    pub(super) fn typed<T: DeserializeOwned>(&self, value: &Value, part: &str) -> Result<T> {
        T::deserialize(value).map_err(|e| {
            let message = format!("expected the properties that glTF defines, found: {e}");
            self.error(MALFORMED, part, message)
        })
    }

    /// Refuses rotations without a direction, and matrices whose last row is not (0, 0, 0, 1) up to
    /// rounding, since no affine transform does what they do.
    fn check_transforms(&self) -> Result<()> {
        for (index, node) in self.document.nodes.iter().enumerate() {
            if node.matrix.is_none() && node.rotation.as_deref() == Some(&[0.0; 4]) {
                return Err(self.graph_error(format!("node {index}"), "expected a rotation that is not zero"));
            }
            let Some(columns) = &node.matrix else { continue };
            let row = [3, 7, 11, 15].map(|k| columns[k]);
            let is_affine = row.iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(x, of)| (x - of).abs() <= LAST_ROW);
            if !is_affine {
                let message = format!("expected a matrix whose last row is 0, 0, 0, 1, found {row:?}");
                let hint =
                    "export the model with affine transforms; a matrix has its columns one after the other";
                return Err(self.source.error_in_part(GRAPH, format!("node {index} matrix"), message, hint));
            }
        }
        Ok(())
    }

    /// Returns true if the node of this number is visible where its ancestors are
    /// (KHR_node_visibility).
    ///
    /// # Errors
    /// `BTH-I002` where the extension is malformed.
    pub(super) fn is_visible(&self, index: usize, node: &GltfNode) -> Result<bool> {
        let Some(value) = node.extensions.get(VISIBILITY) else { return Ok(true) };
        let visibility: Visibility = self.typed(value, &format!("node {index}"))?;
        Ok(visibility.visible.unwrap_or(true))
    }
}

/// Returns true for a version, `major.minor`, up to 2.0.
fn is_known(version: &str) -> bool {
    let (major, minor) = version.split_once('.').unwrap_or((version, "0"));
    let number = |text: &str| text.parse::<u32>().ok();
    number(major).zip(number(minor)).is_some_and(|version| version <= (2, 0))
}

impl GltfDocument {
    /// Returns the nodes that are no other node's child: the roots of a document without scenes.
    pub(super) fn parentless_nodes(&self) -> Vec<usize> {
        let parents = self.parents();
        (0..self.nodes.len()).filter(|node| parents[*node].is_none()).collect()
    }

    /// Returns for each node its parent; `None` for roots.
    pub(super) fn parents(&self) -> Vec<Option<usize>> {
        let mut parents = vec![None; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            for &child in &node.children {
                parents.get_mut(child).into_iter().for_each(|parent| *parent = Some(index));
            }
        }
        parents
    }

    /// Returns true if joints or morph targets can move a mesh.
    pub(crate) fn is_deformed(&self, mesh: usize) -> bool {
        let has_joints = |mesh: &GltfMesh| {
            mesh.primitives.iter().any(|primitive| primitive.attributes.contains_key("JOINTS_0"))
        };
        self.has_targets(mesh) || self.meshes.get(mesh).is_some_and(has_joints)
    }

    /// Returns true if a mesh has morph targets.
    pub(super) fn has_targets(&self, mesh: usize) -> bool {
        self.meshes.get(mesh).is_some_and(|m| m.primitives.iter().any(|p| !p.targets.is_empty()))
    }
}
