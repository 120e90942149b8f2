//! The nodes, objects and source files of a manifest that are compiled.

use super::clips::Clips;
use super::{encode, sources, visible};
use crate::error::Result;
use crate::options::CompileOptions;
use crate::stage::Clock;
use bth_scene::Manifest;
use std::path::Path;
use std::sync::Arc;

/// The part of a manifest that is compiled.
pub(super) struct ScenePlan<'a> {
    /// Nodes with parents before children.
    pub(super) order: Vec<usize>,
    /// For each node: true if it may be visible.
    pub(super) visible: Vec<bool>,
    /// For each object of the manifest: true if a visible node has an instance of it.
    pub(super) used: Vec<bool>,
    /// The files of the used objects.
    pub(super) sources: Vec<sources::File<'a>>,
}

impl<'a> ScenePlan<'a> {
    /// Finds the visible nodes and hashes the files of their objects.
    ///
    /// # Errors
    /// When a file cannot be read; `BTH-L050` beyond the limits of the format.
    pub(super) fn of(
        manifest: &'a Manifest,
        folder: &Path,
        options: &CompileOptions,
        clock: &mut Clock,
    ) -> Result<Self> {
        let order = encode::order(manifest);
        let visible = visible::visible(manifest, &order);
        let mut used = vec![false; manifest.objects.len()];
        for (node, _) in manifest.nodes.iter().zip(&visible).filter(|(_, visible)| **visible) {
            node.object.into_iter().for_each(|object| used[object] = true);
        }
        let clips = match options.motion.poses {
            0 | 1 => Clips::default(),
            _ => Clips::of(manifest, &order, &visible)?,
        };
        let parts = (options.looks(), Arc::new(clips));
        let sources = clock.time("hash", || sources::files(manifest, folder, &used, parts))?;
        Ok(Self { order, visible, used, sources })
    }
}
