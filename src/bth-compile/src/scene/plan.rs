//! The nodes, objects and source files of a manifest that are compiled.

use super::{encode, sources, visible};
use crate::error::Result;
use crate::pipeline::Clock;
use bth_import::Looks;
use bth_scene::Manifest;
use std::path::Path;

/// The part of a manifest that is compiled.
pub(super) struct ScenePlan<'a> {
    /// Nodes with parents before children.
    pub(super) order: Vec<usize>,
    /// For each node whether it may be visible.
    pub(super) visible: Vec<bool>,
    /// For each object of the manifest whether a visible node has an instance of it.
    pub(super) used: Vec<bool>,
    /// The files of the used objects.
    pub(super) sources: Vec<sources::File<'a>>,
}

impl<'a> ScenePlan<'a> {
    /// Finds the visible nodes and hashes the files of their objects.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(super) fn of(manifest: &'a Manifest, folder: &Path, looks: Looks, clock: &mut Clock) -> Result<Self> {
        let order = encode::order(manifest);
        let visible = visible::visible(manifest, &order);
        let mut used = vec![false; manifest.objects.len()];
        for (node, _) in manifest.nodes.iter().zip(&visible).filter(|(_, visible)| **visible) {
            node.object.into_iter().for_each(|object| used[object] = true);
        }
        let sources = clock.time("hash", || sources::files(manifest, folder, &used, looks))?;
        Ok(Self { order, visible, used, sources })
    }
}
