//! What the steps of a scene's import share: the document, the manifest so far, and the names that are taken.

use std::collections::HashMap;

use bth_scene::Manifest;
use serde::de::DeserializeOwned;

use crate::error::{Error, Result};
use crate::gltf::accessor::Accessors;
use crate::gltf::document::GRAPH;
use crate::gltf::placed_mesh::GltfPart;
use crate::gltf::scene::animated::{Animated, Deforming};
use crate::gltf::scene::names::Names;
use crate::gltf::scene::options::ImportReport;
use crate::gltf::schema::GltfDocument;
use crate::source::{MALFORMED, Source};

/// A manifest in the making.
pub(super) struct Importer<'a> {
    pub(super) source: &'a Source<'a>,
    pub(super) document: &'a GltfDocument,
    pub(super) accessors: Accessors<'a>,
    /// Whether what would be ignored is an error.
    pub(super) strict: bool,
    /// The path of the document as it stands in the manifest.
    pub(super) file: &'a str,
    pub(super) manifest: Manifest,
    pub(super) report: ImportReport,
    /// Names of the nodes so far.
    pub(super) node_names: Names,
    /// Names of the objects so far.
    pub(super) object_names: Names,
    /// Row of the object of each mesh, and of each node whose mesh is taken at rest.
    pub(super) objects: HashMap<GltfPart, usize>,
    /// Names of the skins so far.
    pub(super) skin_names: Names,
    /// Names of the cameras so far.
    pub(super) camera_names: Names,
    /// Names of the lights so far.
    pub(super) light_names: Names,
    /// For each node of the document its parent.
    pub(super) parents: Vec<Option<usize>>,
    /// What the chosen animations change.
    pub(super) animated: Animated,
    /// Whether meshes that are moved deform.
    pub(super) deform: bool,
    /// Nodes that deform so far.
    pub(super) deforming: Vec<Deforming>,
}

impl Importer<'_> {
    /// Reports something that is not read: an error when strict, else a warning.
    pub(super) fn ignore(&mut self, part: &str, what: String) -> Result<()> {
        if self.strict {
            let hint = "leave out --strict to go on without it";
            return Err(self.source.error_in_part("BTH-I015", part, what, hint));
        }
        let message = format!("{part}: {what}");
        if !self.report.ignored.contains(&message) {
            self.source.monitor.warn(&message);
            self.report.ignored.push(message);
        }
        Ok(())
    }

    /// An error of the scene's graph.
    pub(super) fn error(&self, part: impl Into<String>, message: impl Into<String>) -> Error {
        self.source.error_in_part(GRAPH, part, message, "export the model again")
    }

    /// Parses a part of the document that is kept as a value.
    pub(super) fn typed<T: DeserializeOwned>(&self, value: &serde_json::Value, part: &str) -> Result<T> {
        T::deserialize(value).map_err(|e| {
            let message = format!("expected the properties that glTF defines, found: {e}");
            self.source.error_in_part(MALFORMED, part, message, "export the model again")
        })
    }
}
