//! Free directions of an object's triangles.

use super::tree::BuildTree;
use crate::bvh::BinaryBvh;
use crate::cached::{decode, encode, fields};
use crate::error::Result;
use crate::free::{self, Free, FreeOptions, FreeReport};
use crate::monitor::Monitor;
use crate::stage::{CachedStage, Stage};
use bth_cache::Key;

/// Decides in which directions rays from a triangle hit nothing. What is too close to decide may
/// depend on the tree.
pub(super) struct FindFree<'a> {
    pub(super) built: BuildTree<'a>,
    pub(super) tree: &'a BinaryBvh,
    pub(super) options: FreeOptions,
}

impl Stage for FindFree<'_> {
    type Output = (Free, FreeReport);
    const NAME: &'static str = "free directions";
    const VERSION: &'static str = "7";

    fn run(self, monitor: &dyn Monitor) -> Result<Self::Output> {
        free::find(self.built.mesh.mesh, self.tree, &self.options, monitor)
    }
}

impl CachedStage<Free, FreeReport> for FindFree<'_> {
    fn key(&self) -> Key {
        let tree = self.built.key();
        Key::new("free-directions")
            .with_all(tree.components().iter().cloned())
            .with_all(fields("free", &self.options))
            .with("free directions version", Self::VERSION)
    }

    fn encode(free: &Free) -> Vec<u8> {
        encode(free)
    }

    fn decode(&self, bytes: &[u8]) -> Option<Free> {
        decode(bytes).filter(|free: &Free| free.is_of(self.built.mesh.mesh.triangles.len()))
    }
}
