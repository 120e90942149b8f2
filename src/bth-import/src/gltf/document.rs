//! Reads the document of a glTF or GLB file and checks what applies to it as a whole.

use crate::error::Result;
use crate::gltf::container::split;
use crate::gltf::extensions::{is_supported, unsupported_extension};
use crate::gltf::schema::GltfDocument;
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
    match document.extensions_required.iter().find(|name| !is_supported(name, supported)) {
        Some(name) => Err(unsupported_extension(source, name)),
        None => Ok((document, binary)),
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
