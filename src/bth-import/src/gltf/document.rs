//! Reads the document of a glTF or GLB file and checks what applies to it as a whole.

use serde::Deserialize;

use crate::error::Result;
use crate::gltf::container::split;
use crate::gltf::extensions::{VISIBILITY, is_supported, unsupported_extension};
use crate::gltf::schema::{GltfDocument, GltfNode, Visibility};
use crate::number::shown;
use crate::source::{MALFORMED, MALFORMED_HINT, Source, UNSUPPORTED};

/// A code for nodes that do not make a forest, or that refer to what does not exist.
pub(crate) const GRAPH: &str = "BTH-I012";

/// Reads the document of a glTF or GLB file and refuses required extensions that are not among `supported`
/// (see [`is_supported`]). The second value is the binary chunk of a GLB.
pub(crate) fn read<'a>(source: &Source<'a>, supported: &[&str]) -> Result<(GltfDocument, Option<&'a [u8]>)> {
    source.fetched()?;
    let (json, binary) = split(source)?;
    let document: GltfDocument = serde_json::from_slice(json).map_err(|e| {
        let message = format!("expected a glTF document, found: {e}");
        source.error_in_part(MALFORMED, "JSON", message, MALFORMED_HINT)
    })?;
    if !document.asset.version.starts_with("2.") {
        let message = format!("expected glTF 2, found version \"{}\"", document.asset.version);
        return Err(source.error_in_part(UNSUPPORTED, "asset", message, "convert the model to glTF 2.0"));
    }
    if let Some(least) = document.asset.min_version.as_deref().filter(|least| !is_known(least)) {
        let message = format!(
            "expected a glTF that readers of version 2.0 know, found minVersion \"{}\"",
            shown(least.as_bytes())
        );
        return Err(source.error_in_part(UNSUPPORTED, "asset", message, "convert the model to glTF 2.0"));
    }
    check_transforms(source, &document)?;
    match document.extensions_required.iter().find(|name| !is_supported(name, supported)) {
        Some(name) => Err(unsupported_extension(source, name)),
        None => Ok((document, binary)),
    }
}

/// Whether a version, `major.minor`, is 2.0 or below.
fn is_known(version: &str) -> bool {
    let (major, minor) = version.split_once('.').unwrap_or((version, "0"));
    let number = |text: &str| text.parse::<u32>().ok();
    number(major).zip(number(minor)).is_some_and(|version| version <= (2, 0))
}

/// Refuses node matrices whose last row is not (0, 0, 0, 1) up to rounding, since no affine transform does what they do, and
/// rotations without a direction.
fn check_transforms(source: &Source<'_>, document: &GltfDocument) -> Result<()> {
    for (index, node) in document.nodes.iter().enumerate() {
        if node.matrix.is_none() && node.rotation == Some([0.0; 4]) {
            let message = "expected a rotation that is not zero";
            return Err(source.error_in_part(
                GRAPH,
                format!("node {index}"),
                message,
                "export the model again",
            ));
        }
        let Some(columns) = node.matrix else { continue };
        let row = [3, 7, 11, 15].map(|k| columns[k]);
        let is_affine =
            row.iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(x, of_affine)| (x - of_affine).abs() <= 1e-6);
        if !is_affine {
            let message = format!("expected a matrix whose last row is 0, 0, 0, 1, found {row:?}");
            let hint =
                "export the model with affine transforms; a matrix has its columns one after the other";
            return Err(source.error_in_part(GRAPH, format!("node {index} matrix"), message, hint));
        }
    }
    Ok(())
}

impl GltfNode {
    /// Whether a node, of this number, is visible where its ancestors are (KHR_node_visibility).
    ///
    /// # Errors
    /// `BTH-I002` where the extension is malformed.
    pub(crate) fn is_visible(&self, source: &Source<'_>, index: usize) -> Result<bool> {
        let Some(value) = self.extensions.get(VISIBILITY) else { return Ok(true) };
        let visibility = Visibility::deserialize(value).map_err(|e| {
            let message = format!("expected the properties that glTF defines, found: {e}");
            source.error_in_part(MALFORMED, format!("node {index}"), message, "export the model again")
        })?;
        Ok(visibility.visible.unwrap_or(true))
    }
}

impl GltfDocument {
    /// The nodes that are no other node's child: the roots of a document without scenes.
    pub(crate) fn parentless_nodes(&self) -> Vec<usize> {
        let mut is_child = vec![false; self.nodes.len()];
        for &child in self.nodes.iter().flat_map(|node| &node.children) {
            is_child.get_mut(child).into_iter().for_each(|c| *c = true);
        }
        (0..self.nodes.len()).filter(|&node| !is_child[node]).collect()
    }

    /// Whether a mesh has morph targets.
    pub(crate) fn has_targets(&self, mesh: usize) -> bool {
        self.meshes.get(mesh).is_some_and(|m| m.primitives.iter().any(|p| !p.targets.is_empty()))
    }
}
