//! The nodes of an object's tree that can be tetrahedralized.

use super::tree::BuildTree;
use crate::bvh::BinaryBvh;
use crate::cached::{decode, encode};
use crate::error::Result;
use crate::marks::{self, MarkReport, Marks};
use crate::monitor::Monitor;
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;

/// Marks the nodes without bad contacts.
pub(super) struct Mark<'a> {
    pub(super) built: BuildTree<'a>,
    pub(super) tree: &'a BinaryBvh,
}

impl Stage for Mark<'_> {
    type Output = (Marks, MarkReport);
    const NAME: &'static str = "marks";
    const VERSION: &'static str = "1";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        marks::mark(self.built.mesh.mesh, self.tree, monitor)
    }
}

impl CachedStage<Marks, MarkReport> for Mark<'_> {
    fn key(&self) -> Key {
        let tree = self.built.key();
        let components = tree.components().iter().cloned();
        Key::new(Self::NAME).with_all(components).with("marks version", Self::VERSION)
    }

    fn encode(marks: &Marks) -> Vec<u8> {
        encode(marks)
    }

    fn decode(&self, bytes: &[u8]) -> Option<Marks> {
        decode(bytes).filter(|marks: &Marks| marks.suitable.len() == self.tree.nodes.len())
    }
}
