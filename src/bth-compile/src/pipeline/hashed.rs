//! A mesh with the hash of its geometry.

use crate::cached;
use bth_files::Digest;
use bth_import::Mesh;
use std::cell::OnceCell;

/// A mesh with the hash of its positions and triangles, which is computed when a key first needs
/// it.
#[derive(Clone, Copy)]
pub(crate) struct Hashed<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) known: &'a OnceCell<Digest>,
}

impl Hashed<'_> {
    /// The hash, hexadecimal.
    pub(crate) fn hash(&self) -> String {
        self.known.get_or_init(|| cached::geometry(self.mesh)).hex()
    }
}
